"""Views of a rig: one pose rendered to a file, with the facts that go with it."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cad.meshes import rig_meshes
from optics.gaze import forward_gaze
from optics.layout import Layout, check_stows
from optics.stowed_view import parts_in_body
from rigs import Rig
from scenes.image import check_image_path, write_image
from scenes.renderer import FastRenderer
from scenes.stage import stage


@dataclass(frozen=True, kw_only=True)
class View:
    """Facts of a rendered pose.

    Attributes
    ----------
    file : str
    q1_deg, q2_deg : float
    width_px, height_px : int
    region_px : dict
        Pixels of each region (housing, direct, fold, gaze).
    gaze_deg : dict, optional
        Azimuth, elevation and image roll of the virtual camera; None for a rig without mirrors.
    target_px : tuple, optional
        Centroid of the visible target; None when it is not seen.
    time_s : float
        Of the frame itself.
    """

    file: str
    q1_deg: float
    q2_deg: float
    width_px: int
    height_px: int
    region_px: dict[str, int]
    gaze_deg: dict[str, float] | None
    target_px: tuple[float, float] | None
    time_s: float

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return asdict(self)


def render_view(
    rig: Rig,
    *,
    q1_deg: float,
    q2_deg: float,
    path: Path,
    width_px: int | None = None,
    height_px: int | None = None,
    samples: int = 1,
    world: str = "tank",
    depth_m: float = 5.0,
    jerlov_type: str | None = None,
    stowed: bool = False,
) -> View:
    """Render one pose, with the fold mirror in use or stowed, and write it.

    Raises
    ------
    ValueError
        For a bad argument, before anything is computed.
    """
    check_image_path(path)
    if stowed:
        check_stows(rig)
    if rig.has_mirrors:
        layout = Layout.from_rig(rig)
        layout.check_joints(np.radians(q1_deg), np.radians(q2_deg))
    scene = stage(rig, world=world, depth_m=depth_m, jerlov_type=jerlov_type)
    parts = rig_meshes(rig, stowed=stowed) if rig.has_mirrors else []
    if stowed:
        # What is left of the train is the camera alone, and the gaze mirror is a part like any other.
        parts = parts_in_body(layout, parts, np.radians(q1_deg), np.radians(q2_deg))
        rig = rig.without_mirrors()
    renderer = FastRenderer(rig, parts, scene, width_px=width_px, height_px=height_px, samples=samples)
    return view_of(renderer, q1_deg=q1_deg, q2_deg=q2_deg, path=path)


def view_of(renderer: FastRenderer, *, q1_deg: float, q2_deg: float, path: Path) -> View:
    """Render one pose with a renderer that is there already, and write it."""
    q1, q2 = np.radians([q1_deg, q2_deg])
    start = time.perf_counter()
    frame = renderer.render(q1=q1, q2=q2)
    elapsed = time.perf_counter() - start
    write_image(frame, renderer.stage, path)
    gaze = forward_gaze(Layout.from_rig(renderer.rig), q1, q2) if renderer.rig.has_mirrors else None
    height, width = renderer.shape
    return View(
        file=path.name,
        q1_deg=q1_deg,
        q2_deg=q2_deg,
        width_px=width,
        height_px=height,
        region_px=frame.region_counts(),
        gaze_deg=None
        if gaze is None
        else {name: float(np.degrees(getattr(gaze, name))) for name in ("azimuth", "elevation", "roll")},
        target_px=frame.target_centroid_px(),
        time_s=elapsed,
    )
