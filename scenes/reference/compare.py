"""Both renderers on the same scene at the same pose: numbers, times and an image side by side."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cad.assembly.meshes import rig_meshes
from optics.kernels.arrays import unit
from optics.layout import Layout
from optics.status import Region
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.image import check_image_path, display_image, write_image
from scenes.reference.agreement import Agreement, agreements, pixel_error, time_to_target_error_s
from scenes.reference.limits import check_known_to_reference, without_lamps
from scenes.reference.render import Progress, ReferenceFrame, render_reference
from scenes.renderer import FastRenderer
from scenes.stage.frame import Frame
from scenes.stage.scene import Scene
from scenes.stage.state import State
from scenes.truth import ground_truth
from scenes.truth.virtual_view import exit_rays

FAST_SAMPLES = 16
"""Of the fast frame whose bias is taken: edges are averaged over the pixel as the reference does."""

WARM_UP, TIMED_FRAMES = 3, 7
"""The first frames are traced and compiled."""

FULL_COLOUR = 0.5
"""Difference, in units of the channel's mean radiance, that is shown in full red (fast too bright) or blue."""

NARROWEST_PANEL_PX = 320

NEAR_SUN_DEG = 5.0
"""Pixels that look closer to the sun are counted once more apart: its peak is the part of the light that neither
renderer knows well, the one by its tables' steps and the other by its rare bright paths."""

BESIDE_SUN = f"without {NEAR_SUN_DEG:g} deg about the sun"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What `compare` found.

    Attributes
    ----------
    agreements : list of Agreement
        Whole image; the same without the pixels that look within 5 degrees of the sun, when there are such; regions;
        labels.
    fast_time_s : float
        A frame with one sample per pixel, median.
    reference_time_s : float
        Of all samples, scene building included.
    reference_samples : int
    reference_pixel_error : float
        Relative standard error of a pixel after that time, median.
    reference_time_to_3_percent_s : float
        Time that it would need to bring that down to 3 %.
    speed_ratio : float
        That time over the fast frame's.
    notes : tuple of str
        What of rig and world neither of the two shows.
    """

    agreements: list[Agreement]
    fast_time_s: float
    reference_time_s: float
    reference_samples: int
    reference_pixel_error: float
    reference_time_to_3_percent_s: float
    speed_ratio: float
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        plain = {name: value for name, value in vars(self).items() if name != "agreements"}
        return {"agreements": [each.as_dict() for each in self.agreements], **plain}


def compare(
    rig: Rig,
    scene: Scene,
    *,
    q1_deg: float,
    q2_deg: float,
    path: Path,
    width_px: int,
    height_px: int,
    samples: int,
    seed: int = 0,
    progress: Progress | None = None,
) -> Comparison:
    """Render a pose with both renderers, and write fast, reference and their difference side by side as a PNG.

    Raises
    ------
    ValueError
        For a bad argument, or a scene with waves or snow, before anything is computed.
    """
    check_image_path(path, ".png")
    check_known_to_reference(scene)
    q1, q2 = np.radians([q1_deg, q2_deg])
    if rig.gaze is not None:
        Layout.from_rig(rig).check_joints(q1, q2)
    rig, notes = without_lamps(rig)
    parts = rig_meshes(rig) if rig.gaze is not None else []
    lit = prepare(scene, rig, parts)
    smooth, quick = (
        FastRenderer(lit, width_px=width_px, height_px=height_px, samples=count) for count in (FAST_SAMPLES, 1)
    )
    frame = smooth.render(q1=q1, q2=q2)
    fast_time = _frame_time_s(quick, q1, q2)
    start = time.perf_counter()
    reference = render_reference(
        rig,
        parts,
        scene,
        q1=q1,
        q2=q2,
        width_px=width_px,
        height_px=height_px,
        samples=samples,
        seed=seed,
        progress=progress,
    )
    reference_time = time.perf_counter() - start
    write_image(side_by_side(frame, reference, scene), path)
    error = pixel_error(frame, reference)
    needed = time_to_target_error_s(reference_time, error)
    state = State(q1=float(q1), q2=float(q2), world_from_body=scene.world_from_body)
    near = looks_within(frame, rig, state, direction=scene.light.towards_sun, angle_deg=NEAR_SUN_DEG)
    return Comparison(
        agreements=_with_and_without(near, frame, reference),
        fast_time_s=fast_time,
        reference_time_s=reference_time,
        reference_samples=samples,
        reference_pixel_error=error,
        reference_time_to_3_percent_s=needed,
        speed_ratio=needed / fast_time,
        notes=scene.world.notes + notes,
    )


def looks_within(frame: Frame, rig: Rig, state: State, *, direction: ArrayLike, angle_deg: float) -> NDArray[np.bool_]:
    """Pixels that look, behind port and mirrors of their region, within an angle of a world direction, shape (h, w)."""
    rows, columns = frame.region.shape
    rays = exit_rays(rig, rows, columns).direction
    looked_for = unit("direction", direction)
    cosine = np.full(frame.region.shape, -1.0)
    for region, pose in ground_truth(frame, rig, state).world_from_virtual().items():
        along = (rays @ (pose[:3, :3].T @ looked_for)).reshape(rows, columns)
        cosine = np.where(frame.region == region, along, cosine)
    return np.asarray(cosine > np.cos(np.radians(angle_deg)))


def _with_and_without(near_sun: NDArray[np.bool_], frame: Frame, reference: ReferenceFrame) -> list[Agreement]:
    """Agreements of all pixels, and behind the whole image's those of the pixels that are not near the sun."""
    whole, *others = agreements(frame, reference)
    if near_sun.any():
        # What sees the housing is left out of all agreements.
        away = replace(frame, region=np.where(near_sun, np.uint8(Region.HOUSING), frame.region))
        others = [replace(each, name=BESIDE_SUN) for each in agreements(away, reference)[:1]] + others
    return [whole, *others]


def side_by_side(frame: Frame, reference: ReferenceFrame, scene: Scene) -> NDArray[np.uint8]:
    """Fast frame, reference, and their difference (red: fast too bright, blue: too dark), shape (h, 3 w, 3).

    Small frames are enlarged by a whole number.
    """
    shown = [frame, replace(frame, radiance=reference.radiance.astype(np.float32))]
    panels = [*(display_image(each, scene) for each in shown), difference_map(frame, reference)]
    scale = max(1, -(-NARROWEST_PANEL_PX // frame.radiance.shape[1]))
    return np.concatenate([panel.repeat(scale, axis=0).repeat(scale, axis=1) for panel in panels], axis=1)


def difference_map(frame: Frame, reference: ReferenceFrame) -> NDArray[np.uint8]:
    """Difference in units of each channel's mean radiance, mean of the channels; white where there is none."""
    mean = reference.radiance.mean(axis=(0, 1))
    off = ((frame.radiance - reference.radiance) / np.where(mean > 0, mean, 1)).mean(axis=-1) / FULL_COLOUR
    fade = 1 - np.clip(np.abs(off), 0, 1)
    ones = np.ones_like(fade)
    colours = np.where((off > 0)[..., np.newaxis], np.stack([ones, fade, fade], -1), np.stack([fade, fade, ones], -1))
    return np.round(255 * colours).astype(np.uint8)


def _frame_time_s(renderer: FastRenderer, q1: float, q2: float) -> float:
    times = []
    for _ in range(WARM_UP + TIMED_FRAMES):
        start = time.perf_counter()
        renderer.render(q1=q1, q2=q2)
        times.append(time.perf_counter() - start)
    return statistics.median(times[WARM_UP:])
