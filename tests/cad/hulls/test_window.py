"""A window is cut out of a hull's mesh where the light goes, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from cad.hulls.hull import file_hull_surface
from cad.hulls.window import RIM_MM, WINDOW_REACH_MM, solid_with_window, window_body, with_window
from optics.layout import camera_pose
from optics.train import OpticalTrain, Rays, pixel_grid
from rigs import FileHull, NoPortSpec, Rig

ROUNDING_MM = 1e-6
FRONT_MM = 335.0
"""5 mm in front of aqua2's port."""


@pytest.fixture(scope="module")
def box_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("hull") / "box.stl"
    trimesh.creation.box(bounds=[[-300, -150, -60], [FRONT_MM, 150, 60]]).export(file)
    return file


def rig_in_box(file: Path, window: str, **camera: float) -> Rig:
    aqua2 = Rig.load("aqua2")
    hull = FileHull(shape="file", file=file, unit="mm", window=window)
    return aqua2.model_copy(update={"camera": aqua2.camera.model_copy(update=camera)}).with_gaze(hull=hull)


def view(rig: Rig) -> Rays:
    """All that the camera sees through its port, in its own water; body frame."""
    train = OpticalTrain.bare(rig)
    rays = train.trace(pixel_grid(train.camera, 160, 120))
    return rays[rays.passed].moved(camera_pose(rig.camera))


def test_skin_as_drawn_stays(box_file: Path) -> None:
    surface = trimesh.creation.box()
    assert with_window(surface, rig_in_box(box_file, "as-drawn")) is surface
    assert with_window(surface, Rig.load("aqua2")) is surface


def test_light_gets_out_of_a_cut_window_and_not_out_of_closed_skin(box_file: Path) -> None:
    rig = rig_in_box(box_file, "cut")
    rays = view(rig)
    closed = file_hull_surface(rig.file_hull)
    cut = with_window(closed, rig)
    for surface, hit in ((closed, True), (cut, False)):
        blocked = surface.ray.intersects_any(1000 * rays.origin_m, rays.direction)
        assert (blocked == hit).all()
    assert cut.is_watertight
    assert (cut.bounds == closed.bounds).all()


def test_light_passes_a_clear_window_and_parts_do_not(box_file: Path) -> None:
    clear, cut = (rig_in_box(box_file, window) for window in ("clear", "cut"))
    closed = file_hull_surface(clear.file_hull)
    assert with_window(closed, clear).volume == pytest.approx(with_window(closed, cut).volume)
    assert solid_with_window(closed, clear) is closed
    assert solid_with_window(closed, cut).volume < closed.volume


def test_narrow_view_cuts_a_prism_of_its_rim(box_file: Path) -> None:
    # Without width, the light widened by r along the axes is the prism |y| + |z| < r (area 2 r^2) from the pinhole to
    # the front, and half an octahedron (2 r^3 / 3) behind the pinhole.
    rig = rig_in_box(box_file, "cut", fx_px=1e7, fy_px=1e7).model_copy(update={"port": NoPortSpec(shape="none")})
    closed = file_hull_surface(rig.file_hull)
    depth = FRONT_MM - rig.camera.position_mm[0]
    removed = closed.volume - with_window(closed, rig).volume
    assert removed == pytest.approx(2 * RIM_MM**2 * depth + 2 * RIM_MM**3 / 3, rel=1e-3)


def test_open_surfaces_lose_the_same_skin_as_closed_ones(box_file: Path) -> None:
    # Without its back the box is no solid. Both lose as much of the front as the window's section with it.
    rig = rig_in_box(box_file, "cut")
    closed = file_hull_surface(rig.file_hull)
    opened = trimesh.Trimesh(closed.vertices, closed.faces[closed.face_normals[:, 0] > -0.5], process=False)
    areas = []
    for surface in (closed, opened):
        cut = with_window(surface, rig)
        front = (np.abs(cut.triangles[:, :, 0] - FRONT_MM) < ROUNDING_MM).all(axis=1)
        areas.append(cut.area_faces[front].sum())
    section = trimesh.convex.convex_hull(window_body(rig).to_mesh64().vert_properties).section(
        [1, 0, 0], [FRONT_MM, 0, 0]
    )
    expected = 300 * 120 - section.to_2D()[0].area
    assert areas == pytest.approx([expected, expected], rel=1e-6)


def test_skin_further_in_front_than_a_window_stays(box_file: Path) -> None:
    rig = rig_in_box(box_file, "cut", position_mm=(FRONT_MM - 28 - WINDOW_REACH_MM - RIM_MM - 20, 60.0, 0.0))
    rays = view(rig)
    surface = with_window(file_hull_surface(rig.file_hull), rig)
    assert np.all(surface.ray.intersects_any(1000 * rays.origin_m, rays.direction))
