"""Views of a rig: one pose rendered to files, with the facts that go with it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from cad.assembly.meshes import rig_meshes
from optics.gaze.kinematics import forward_gaze
from optics.gaze.stowed_view import parts_in_body
from optics.kernels.backend import dr
from optics.kernels.clock import CLOCK
from optics.layout import Layout, check_stows
from optics.mesh import PartMesh
from optics.workers.threads import woken_threads
from rigs import Rig
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import LitScene, is_long_to_light, prepare, prepare_from_cache
from scenes.image import display_image, write_image
from scenes.renderer import FastRenderer
from scenes.requests.request import Light, Output, RenderRequest, RenderResult
from scenes.stage.frame import Frame
from scenes.stage.scene import Scene
from scenes.stage.state import State
from scenes.stage.targets import Ball

# Reference, blur, sensor and ground truth take longer to import than a frame to render: they are, where asked for.
if TYPE_CHECKING:
    from scenes.truth import GroundTruth

Made = TypeVar("Made")

Progress = Callable[[int, int], None]
"""Called with the launches done and to do."""


def render(
    rig: Rig,
    scene: Scene,
    request: RenderRequest,
    output: Output,
    *,
    progress: Progress | None = None,
    on_draft: Callable[[RenderResult], None] | None = None,
) -> RenderResult:
    """Render one pose and write it, with its ground truth where that is wanted.

    Geometry is known for one ray through each pixel's centre: with more samples, and beside the reference's light, a
    frame of one sample shows it.

    Parameters
    ----------
    progress : callable, optional
        Called with the launches done and to do, by the reference renderer.
    on_draft : callable, optional
        With it, a view for which the full light of its world must be found is written with a draft of it first, and
        this is called.

    Raises
    ------
    ValueError
        For a bad argument, before anything is computed.
    """
    notes = scene.world.notes
    if request.renderer == "reference":
        from scenes.reference.limits import check_known_to_reference, without_lamps  # noqa: PLC0415

        check_known_to_reference(scene)
        rig, dark = without_lamps(rig)
        notes += dark
    rig, parts = _in_pose(rig, request)

    def written(lit: LitScene, request: RenderRequest, output: Output) -> RenderResult:
        return replace(_written(lit, parts, request, output, progress), notes=notes)

    CLOCK.begin("light")
    lit = prepare_from_cache(scene, rig, parts)
    if lit is not None:
        return written(lit, replace(request, light="full"), output)
    if request.light == "draft" or request.renderer == "reference":
        return written(_draft(scene, rig, parts), request, output)
    if on_draft is not None and is_long_to_light(scene):
        CLOCK.begin("draft")
        # Nobody holds it while the full light is found: it is large.
        on_draft(written(_draft(scene, rig, parts), replace(request, light="draft"), replace(output, truth=None)))
        CLOCK.begin("light")
    return written(prepare(scene, rig, parts), request, output)


def _draft(scene: Scene, rig: Rig, parts: Sequence[PartMesh]) -> LitScene:
    return prepare(scene, rig, parts, quality=LightQuality.draft(), full_if_kept=True)


def _written(
    lit: LitScene, parts: Sequence[PartMesh], request: RenderRequest, output: Output, progress: Progress | None
) -> RenderResult:
    """Render one pose of a lit scene and write it."""
    rig, scene = lit.rig, lit.scene
    CLOCK.begin("frame")

    def fast(samples: int) -> FastRenderer:
        return FastRenderer(lit, width_px=request.width_px, height_px=request.height_px, samples=samples)

    state = _state(scene, request)
    renderer = fast(1 if request.renderer == "reference" else request.samples)
    frame, elapsed = _timed(lambda: renderer.render_states([state])[0])
    exact = frame
    if request.renderer == "reference":
        from scenes.reference.render import render_reference  # noqa: PLC0415

        light, elapsed = _timed(
            lambda: render_reference(
                rig,
                parts,
                scene,
                q1=state.q1,
                q2=state.q2,
                width_px=request.width_px,
                height_px=request.height_px,
                samples=request.samples,
                seed=request.seed,
                progress=progress,
            )
        )
        frame = replace(exact, radiance=light.radiance.astype(np.float32))
    elif request.samples > 1 and output.has_truth:
        exact = fast(1).render_states([state])[0]
    if request.blur:
        from scenes.forward_scatter import blurred  # noqa: PLC0415

        frame = replace(frame, radiance=blurred(replace(exact, radiance=frame.radiance), scene.light, rig))
    CLOCK.begin("files")
    files: list[Path] = []
    if output.has_truth:
        seen = replace(exact, radiance=frame.radiance, target_fraction=frame.target_fraction)
        truth = _truth_of(seen, rig, scene, state, parts=parts, instance_names=renderer.instance_names)
        files = _write_truth(truth, output, request.light)
    exposure = None
    if output.sensor:
        image, exposure = _sensor_image(frame, rig, scene, seed=request.seed)
        write_image(image, output.path, light=request.light)
    elif not output.layered:
        write_image(display_image(frame, scene), output.path, light=request.light)
    facts = _facts(frame, rig, scene, request, path=output.path, time_s=elapsed)
    return replace(facts, exposure=exposure, truth_files=len(files))


def render_with(renderer: FastRenderer, *, q1_deg: float, q2_deg: float, path: Path) -> RenderResult:
    """Render one pose with a renderer that is there already, and write it as an image."""
    request = RenderRequest(q1_deg=q1_deg, q2_deg=q2_deg, samples=renderer.samples)
    frame, elapsed = _timed(lambda: renderer.render_states([_state(renderer.scene, request)])[0])
    write_image(display_image(frame, renderer.scene), path)
    return _facts(frame, renderer.rig, renderer.scene, request, path=path, time_s=elapsed)


def _in_pose(rig: Rig, request: RenderRequest) -> tuple[Rig, Sequence[PartMesh]]:
    """Rig as it is rendered, and the parts around its camera; `ValueError` for a pose that it cannot take."""
    if request.stowed:
        check_stows(rig)
    if rig.gaze is None:
        return rig, []
    layout = Layout.from_rig(rig)
    q1, q2 = np.radians([request.q1_deg, request.q2_deg])
    layout.check_joints(q1, q2)
    parts = rig_meshes(rig, stowed=request.stowed)
    if not request.stowed:
        return rig, parts
    # What is left of the train is the camera alone, and the gaze mirror is a part like any other.
    return rig.without_mirrors(), parts_in_body(layout, parts, q1, q2)


def _state(scene: Scene, request: RenderRequest) -> State:
    """State with all poses said, as ground truth needs it."""
    return State(
        q1=float(np.radians(request.q1_deg)),
        q2=float(np.radians(request.q2_deg)),
        world_from_body=scene.world_from_body,
        world_from_target=None if scene.target is None else scene.target.world_from_target,
        time_s=request.time_s,
    )


def _truth_of(
    frame: Frame, rig: Rig, scene: Scene, state: State, *, parts: Sequence[PartMesh], instance_names: tuple[str, ...]
) -> GroundTruth:
    from scenes.truth import ground_truth  # noqa: PLC0415

    ball = scene.target.shape if scene.target is not None and isinstance(scene.target.shape, Ball) else None
    return ground_truth(
        frame,
        rig,
        state,
        parts=parts,
        instance_names=instance_names,
        target_radius_m=None if ball is None else ball.radius_m,
    )


def _write_truth(truth: GroundTruth, output: Output, light: Light) -> list[Path]:
    from scenes.truth import write_truth  # noqa: PLC0415
    from scenes.truth.layers import write_layers  # noqa: PLC0415

    if output.layered:
        write_layers(truth, output.path, light=light)
    return [] if output.truth is None else write_truth(output.truth, truth, light=light)


def _sensor_image(frame: Frame, rig: Rig, scene: Scene, *, seed: int) -> tuple[NDArray[np.uint8], dict[str, float]]:
    """What the rig's image sensor takes once exposure and white balance have settled, and with which exposure."""
    from scenes.sensor import ImageSensor, capture, frame_key, settled_settings  # noqa: PLC0415

    height, width = frame.label.shape
    sensor = ImageSensor.from_rig(rig, width_px=width, height_px=height)
    card = scene.light.white_radiance(scene.depth_m)
    settings = settled_settings(frame.radiance, sensor, card_radiance=card)
    taken = capture(frame.radiance, sensor, settings, frame_key(seed, 0))
    return taken.image, {"time_ms": 1000 * settings.exposure_s, "gain_db": settings.gain_db}


def _facts(frame: Frame, rig: Rig, scene: Scene, request: RenderRequest, *, path: Path, time_s: float) -> RenderResult:
    gaze = None
    if rig.gaze is not None:
        gaze = forward_gaze(Layout.from_rig(rig), *np.radians([request.q1_deg, request.q2_deg]))
    sun = scene.light.daylight.sun
    height, width = frame.label.shape
    return RenderResult(
        file=path.name,
        q1_deg=request.q1_deg,
        q2_deg=request.q2_deg,
        width_px=width,
        height_px=height,
        region_px=frame.region_counts(),
        gaze_deg=None
        if gaze is None
        else {name: float(np.degrees(getattr(gaze, name))) for name in ("azimuth", "elevation", "roll")},
        target_px=frame.target_centroid_px(),
        sun_deg={"elevation": sun.elevation_deg, "azimuth": sun.azimuth_deg},
        exposure=None,
        truth_files=0,
        notes=scene.world.notes,
        light=request.light,
        time_s=time_s,
    )


def _timed(make: Callable[[], Made]) -> tuple[Made, float]:
    """What is made, and how long that took without compiling, which the clock is given."""
    start = time.perf_counter()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory), woken_threads():
        made = make()
        kernels = dr.kernel_history()
    compiling_s = sum(kernel.get("codegen_time", 0.0) + kernel.get("backend_time", 0.0) for kernel in kernels) / 1000
    CLOCK.told_apart(compiling_s, "compile")
    return made, time.perf_counter() - start - compiling_s
