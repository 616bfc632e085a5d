"""Frames: the fast renderer beside stock Mitsuba on the same rig, worlds and poses, in one run.

Every frame has a new pose of the gimbal, a new place of the target and a new time of waves and flicker. Stock `path`
sees the same triangles, the port as two dielectric planes, the mirrors as aluminium rectangles and the same sun and
sky, and takes poses and places through its scene parameters. It has no water between things (its `path` knows no
media) and no hull (the camera would stand in the solid), so it does less work per sample. `volpathmis` has all of
that and the water (`scenes.reference`): the time that it would take to know a pixel as well.
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.assembly.meshes import rig_meshes
from optics.kernels.backend import BACKEND_VARIABLE, THREADS_VARIABLE, activate, dr, mi
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.ports.port import FlatPort, port_from_spec
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.light.waves import Wind
from scenes.reference.agreement import TARGET_ERROR, pixel_error
from scenes.reference.render import render_reference
from scenes.renderer import FastRenderer
from scenes.stage.scene import Scene, make_scene
from scenes.stage.state import State
from scenes.stage.targets import Ball

WORLDS = ("reef", "tank")
SIZES = ((640, 480), (320, 240))
CASES = [(world, size) for world in WORLDS for size in SIZES]
WARM_UP, FRAMES = 5, 40
STOCK_WARM_UP, STOCK_FRAMES = 2, 6
BATCH = 8
FRAMES_PER_S = 30.0
SWAY_M = 0.3
"""How far the target goes to each side."""

REFERENCE_SIZE = (64, 48)
REFERENCE_SAMPLES = (40, 160)
"""What the second takes longer than the first is the time of the samples alone, without building scene and kernels."""

ALLOWED_MEMORY_MB = 2048.0

CARD_BATCHES = [(world, size, count) for world in WORLDS for size, count in (((640, 480), 16), ((64, 64), 1024))]
"""World, size and states in a call: what fills a graphics card."""

CARD_CALLS = 6

ON_PROCESSOR = (
    "import json; from benchmarks.render import batches, fast_frames; print(json.dumps([fast_frames(), batches()]))"
)
"""Code of the child process that measures the fast renderer without the graphics card."""


def run() -> list[dict[str, Any]]:
    """Times of frames, alone and in batches, beside stock Mitsuba's, and the memory they took."""
    fast = fast_frames()
    # Before anything of stock Mitsuba's is made.
    memory = _peak_memory_mb()
    rig = Rig.load("aqua2")
    parts = rig_meshes(rig)
    stages = {world: make_scene(rig, world=world) for world in WORLDS}
    rows = []
    for (world, size), (bare, full) in zip(CASES, fast, strict=True):
        stock = _stock(rig, parts, stages[world], size)
        triangles = sum(len(part.faces) for part in parts) + len(stages[world].world.faces)
        name = f"{world}, {size[0]} x {size[1]}, {triangles / 1000:.0f} k triangles"
        peer = "peer: stock path, 1 spp, no water, rebuilds its tree"
        rows += [
            _row(name, bare, stock, "ms", f"{1000 / bare:.0f} frames/s, no noise; {peer}"),
            _row(f"{name}, ground truth", full, stock, "ms", f"{full / bare:.2f} x the time without; {peer}"),
        ]
    if activate().kind == "cuda":
        rows += _card_rows(fast)
    rows.append(_batch_row(rig, parts, stages["tank"]))
    note = "peer: what is allowed; two worlds, both sizes, lighting of the worlds when it was not in the cache"
    rows.append(_row("peak memory of the process", memory, ALLOWED_MEMORY_MB, "MB", note))
    rows.append(_equal_error_row(rig, parts))
    return rows


def fast_frames() -> list[tuple[float, float]]:
    """Milliseconds of the fast renderer's frames without and with ground truth, in the order of `CASES`."""
    rig = Rig.load("aqua2")
    parts = rig_meshes(rig)
    return [_fast(rig, parts, make_scene(rig, world=world), size) for world, size in CASES]


def _card_rows(on_card: list[tuple[float, float]]) -> list[dict[str, Any]]:
    """The same frames, alone and many in a call, on the graphics card, on two threads of the processor and on all."""
    rows = []
    ours = [full for _, full in on_card] + batches()
    names = [f"{world}, {width} x {height}, ground truth" for world, (width, height) in CASES]
    names += [
        f"{world}, {width} x {height}, {count} states in a call" for world, (width, height), count in CARD_BATCHES
    ]
    for threads in (2, os.cpu_count() or 1):
        note = f"of one frame; {activate().device}; peer: our own in {threads} threads of its processor"
        peers = _on_processor(threads)
        rows += [
            _row(f"{name}, graphics card", *both, "ms", note) for name, *both in zip(names, ours, peers, strict=True)
        ]
    return rows


def _on_processor(threads: int) -> list[float]:
    """What `_card_rows` measures on the card, by the processor in a process of its own."""
    child = subprocess.run(
        [sys.executable, "-c", ON_PROCESSOR],
        env={**os.environ, BACKEND_VARIABLE: "llvm", THREADS_VARIABLE: str(threads)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    frames, many = json.loads(child.stdout.splitlines()[-1])
    return [full for _, full in frames] + many


def batches() -> list[float]:
    """Milliseconds of one of many frames of a call, in the order of `CARD_BATCHES`."""
    rig = Rig.load("aqua2")
    parts = rig_meshes(rig)
    found = []
    for world, (width, height), count in CARD_BATCHES:
        scene = make_scene(rig, world=world)
        renderer = FastRenderer(prepare(scene, rig, parts), width_px=width, height_px=height)
        states = _states(scene, count * (2 + CARD_CALLS))
        calls = [states[k : k + count] for k in range(0, len(states), count)]
        found.append(_call_ms(renderer, calls, truth=False, warm_up=2) / count)
    return found


def _row(name: str, ours: float, peer: float, unit: str, note: str) -> dict[str, Any]:
    return {"name": name, "ours": ours, "peer": peer, "unit": unit, "ratio": peer / ours, "note": note}


def _states(scene: Scene, count: int) -> list[State]:
    """A new pose, place of the target and time for every frame."""
    assert scene.target is not None
    poses = np.radians(np.linspace([-60.0, -20.0], [60.0, 20.0], count))
    sway = SWAY_M * np.sin(np.linspace(0, 2 * np.pi, count))
    return [
        State(
            q1=float(q1),
            q2=float(q2),
            world_from_body=scene.world_from_body,
            world_from_target=RigidTransform.from_translation([0.0, offset, 0.0]) * scene.target.world_from_target,
            time_s=k / FRAMES_PER_S,
        )
        for k, ((q1, q2), offset) in enumerate(zip(poses, sway, strict=True))
    ]


def _fast(rig: Rig, parts: list[PartMesh], scene: Scene, size: tuple[int, int]) -> tuple[float, float]:
    """Milliseconds of a frame without and with ground truth."""
    renderer = FastRenderer(prepare(scene, rig, parts), width_px=size[0], height_px=size[1])
    states = [[state] for state in _states(scene, WARM_UP + FRAMES)]
    bare, full = (_call_ms(renderer, states, truth=truth) for truth in (False, True))
    return bare, full


def _call_ms(renderer: FastRenderer, calls: list[list[State]], *, truth: bool, warm_up: int = WARM_UP) -> float:
    """Median milliseconds of a call."""

    def call(states: list[State]) -> None:
        dr.eval(renderer.arrays(states, truth=truth))
        dr.sync_thread()

    return _median_ms(call, calls, warm_up)


def _median_ms(frame: Callable[[Any], None], arguments: list[Any], warm_up: int) -> float:
    times = []
    for argument in arguments:
        start = time.perf_counter()
        frame(argument)
        times.append(time.perf_counter() - start)
    return 1000 * statistics.median(times[warm_up:])


def _batch_row(rig: Rig, parts: list[PartMesh], scene: Scene) -> dict[str, Any]:
    """Several states in one call, beside as many calls."""
    width, height = SIZES[-1]
    renderer = FastRenderer(prepare(scene, rig, parts), width_px=width, height_px=height)
    states = _states(scene, BATCH * (WARM_UP + FRAMES // 2))
    one_by_one = _call_ms(renderer, [[state] for state in states], truth=True)
    together = _call_ms(renderer, [states[k : k + BATCH] for k in range(0, len(states), BATCH)], truth=True) / BATCH
    name = f"tank, {width} x {height}, {BATCH} states in a call, ground truth"
    return _row(name, together, one_by_one, "ms", "of one frame; peer: our own, a call for each state")


def _peak_memory_mb() -> float:
    """Largest resident memory of the process so far."""
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # Kilobytes, but bytes on macOS.
    return largest / (2**20 if sys.platform == "darwin" else 2**10)


def _equal_error_row(rig: Rig, parts: list[PartMesh]) -> dict[str, Any]:
    """Fast frame beside the time that `volpathmis` needs to know a pixel to what the fast one may be off."""
    width, height = SIZES[0]
    # The reference knows no waves.
    scene = make_scene(rig, wind=Wind(speed_m_per_s=0))
    bare, _ = _fast(rig, parts, scene, (width, height))
    small = {"width_px": REFERENCE_SIZE[0], "height_px": REFERENCE_SIZE[1]}
    frame = FastRenderer(prepare(scene, rig, parts), **small).render()
    seconds = []
    for samples in REFERENCE_SAMPLES:
        start = time.perf_counter()
        reference = render_reference(rig, parts, scene, samples=samples, **small)
        seconds.append(time.perf_counter() - start)
    few, many = REFERENCE_SAMPLES
    error = pixel_error(frame, reference)
    of_a_sample = (seconds[1] - seconds[0]) / ((many - few) * REFERENCE_SIZE[0] * REFERENCE_SIZE[1])
    needed = many * (error / TARGET_ERROR) ** 2
    note = (
        f"peer: stock volpathmis with the water, to know a pixel to {TARGET_ERROR:.0%}: {needed:.0f} spp; extrapolated "
        f"from {error:.0%} at {many} spp and {1e6 * of_a_sample:.1f} us a sample of {small['width_px']} x "
        f"{small['height_px']} pixels"
    )
    return _row(f"tank, {width} x {height}, equal error", bare / 1000, of_a_sample * needed * width * height, "s", note)


def _stock(rig: Rig, parts: list[PartMesh], scene: Scene, size: tuple[int, int]) -> float:
    """Milliseconds of a frame of stock Mitsuba `path`, one sample per pixel."""
    frame = _stock_path(rig, parts, scene, *size)
    return _median_ms(frame, _states(scene, STOCK_WARM_UP + STOCK_FRAMES), STOCK_WARM_UP)


def _stock_path(rig: Rig, parts: list[PartMesh], scene: Scene, width: int, height: int) -> Callable[[State], None]:
    """Function that puts gimbal and target into their places and renders one frame with stock Mitsuba."""
    layout = Layout.from_rig(rig)
    body = scene.world_from_body
    description: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 12, "hide_emitters": False},
        "sensor": _sensor(rig, body.as_matrix() @ layout.body_from_camera.as_matrix(), width, height),
        "sun": {"type": "directional", "direction": list(-scene.light.towards_sun), "irradiance": 3.0},
        "sky": {"type": "constant", "radiance": 0.3},
        "world": _mesh(scene.world.vertices_m, scene.world.faces),
        "m1": _rectangle(body.as_matrix() @ layout.body_from_m1.as_matrix(), rig.gaze.fold_mirror),
        "m2": _rectangle(np.eye(4), rig.gaze.gaze_mirror),
    }
    assert scene.target is not None
    description["target"] = _ball(scene, scene.target.world_from_target)
    description |= _port(rig, body.as_matrix() @ layout.body_from_camera.as_matrix())
    visible = [part for part in parts if part.role not in (Role.MIRROR, Role.HULL)]
    for part in visible:
        description[part.name] = _mesh(part.vertices_m, part.faces)
    # Merged shapes could not be moved one by one.
    loaded = mi.load_dict(description, optimize=False)
    parameters = mi.traverse(loaded)
    half = [rig.gaze.gaze_mirror.width_mm / 2000, rig.gaze.gaze_mirror.height_mm / 2000, 1.0]
    for part in visible:
        if part.group == Group.FIXED:
            placed = body.apply(part.vertices_m)
            parameters[f"{part.name}.vertex_positions"] = placed.astype(np.float32).ravel()

    def frame(state: State) -> None:
        tilt = body * layout.body_from_m2(state.q1, state.q2)
        frames = {Group.PAN: body * layout.body_from_pan(state.q1), Group.TILT: tilt}
        for part in visible:
            if part.group in frames:
                placed = frames[part.group].apply(part.vertices_m)
                parameters[f"{part.name}.vertex_positions"] = placed.astype(np.float32).ravel()
        parameters["m2.to_world"] = mi.ScalarTransform4f(tilt.as_matrix() @ np.diag([*half, 1.0]))
        assert state.world_from_target is not None
        parameters["target.to_world"] = _ball(scene, state.world_from_target)["to_world"]
        parameters.update()
        dr.eval(mi.render(loaded, spp=1))
        dr.sync_thread()

    return frame


def _sensor(rig: Rig, world_from_camera: np.ndarray, width: int, height: int) -> dict[str, Any]:
    camera = rig.camera
    # Mitsuba's camera looks along +z with x to the left and y up: half a turn about z from OpenCV's.
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    return {
        "type": "perspective",
        "fov": float(np.degrees(2 * np.arctan(camera.width_px / 2 / camera.fx_px))),
        "near_clip": 1e-3,
        "to_world": mi.ScalarTransform4f(world_from_camera @ half_turn),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": 1},
    }


def _port(rig: Rig, world_from_camera: np.ndarray) -> dict[str, Any]:
    port = port_from_spec(rig.port, rig.water)
    assert isinstance(port, FlatPort)
    radius = port.aperture_radius_m
    faces = {
        "port_inner": (port.distance_m, port.n_port, port.n_inside),
        "port_outer": (port.distance_m + port.thickness_m, port.n_water, port.n_port),
    }
    described = {}
    for name, (distance, behind, before) in faces.items():
        # The disk's normal, -z, looks at the camera: there the exterior index holds.
        pose = np.diag([radius, -radius, -1.0, 1.0])
        pose[2, 3] = distance
        described[name] = {
            "type": "disk",
            "to_world": mi.ScalarTransform4f(world_from_camera @ pose),
            "bsdf": {"type": "dielectric", "int_ior": behind, "ext_ior": before},
        }
    return described


def _ball(scene: Scene, world_from_target: RigidTransform) -> dict[str, Any]:
    assert scene.target is not None and isinstance(scene.target.shape, Ball)
    scale = np.diag([*[scene.target.shape.radius_m] * 3, 1.0])
    return {"type": "sphere", "to_world": mi.ScalarTransform4f(world_from_target.as_matrix() @ scale)}


def _rectangle(pose: np.ndarray, plate: Any) -> dict[str, Any]:
    scale = np.diag([plate.width_mm / 2000, plate.height_mm / 2000, 1.0, 1.0])
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f(pose @ scale),
        "bsdf": {"type": "conductor", "material": "Al"},
    }


def _mesh(vertices_m: np.ndarray, faces: np.ndarray) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse"}})
    mesh = mi.Mesh("mesh", len(vertices_m), len(faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices_m.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh
