"""Where the camera looks past both mirrors, beside rays that are traced and points that are projected one by one."""

from __future__ import annotations

import numpy as np
import pytest

from dives.views.direct_view import DISTANCE_M, direct_view, traced_view
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from tracking.perception.direct_view import DirectView

RIG = Rig.load("aqua2")
LAYOUT = Layout.from_rig(RIG)
TRAIN = OpticalTrain.from_rig(RIG, q1=0.0, q2=0.0)

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], dtype=np.int32
)  # fmt: skip

HALF_M = 0.05


@pytest.fixture(scope="module")
def bare() -> DirectView:
    return traced_view(RIG, [])


def block(group: Group, centre_m: np.ndarray, half_m: float = HALF_M) -> PartMesh:
    return PartMesh(name="block", group=group, role=Role.HULL, vertices_m=half_m * CUBE + centre_m, faces=FACES)


def test_without_parts_it_is_what_passes_m1_but_for_a_cell_at_its_edge(bare):
    rows, columns = bare.water.shape
    pixels = pixel_grid(TRAIN.camera, columns, rows)
    past_m1 = (TRAIN.trace(pixels).status == Status.MISSED_M1).reshape(rows, columns)
    assert past_m1.any()
    inside = past_m1.copy()
    inside[1:] &= past_m1[:-1]
    inside[:-1] &= past_m1[1:]
    inside[:, 1:] &= inside[:, :-1].copy()
    inside[:, :-1] &= inside[:, 1:].copy()
    assert bare.water.sum() > 0
    assert not (bare.water & ~past_m1).any()
    assert (bare.water & inside).sum() > 0.95 * inside.sum()


def test_its_directions_are_those_of_points_that_the_camera_sees_there(bare):
    """What is `DISTANCE_M` behind the port on a cell's ray is projected into that cell, without the mirrors."""
    rows, columns = bare.water.shape
    row, column = np.nonzero(bare.water)
    some = np.linspace(0, len(row) - 1, 40).astype(int)
    row, column = row[some], column[some]
    direct = TRAIN.without_mirrors()
    cells_per_px = np.array([columns, rows]) / [RIG.camera.width_px, RIG.camera.height_px]
    pixels = (np.stack([column, row], axis=1) + 0.5) / cells_per_px - 0.5
    rays = direct.trace(pixels).moved(LAYOUT.body_from_camera)
    from_m2 = rays.origin_m + DISTANCE_M * rays.direction - LAYOUT.body_from_gimbal.translation
    places = (pixels + 0.5) / [RIG.camera.width_px, RIG.camera.height_px]
    for place, expected in zip(places, from_m2, strict=True):
        found = bare.direction_at(place)
        assert found == pytest.approx(expected / np.linalg.norm(expected), abs=1e-6)


def test_a_part_in_its_way_hides_it(bare):
    """A block on the way of one cell takes that cell and leaves most."""
    row, column = (int(each[len(each) // 2]) for each in np.nonzero(bare.water))
    ahead_m = LAYOUT.body_from_gimbal.translation + DISTANCE_M * bare.direction[row, column]
    seen = traced_view(RIG, [block(Group.FIXED, ahead_m)])
    assert not seen.water[row, column]
    assert not (seen.water & ~bare.water).any()
    assert seen.water.sum() > 0.5 * bare.water.sum()


def test_where_a_part_may_turn_nothing_is_seen(bare):
    """A part that reaches 3 m from the gimbal's centre may be before any cell."""
    part = block(Group.PAN, np.array([3.0, 0.0, 0.0]))
    assert not traced_view(RIG, [part]).water.any()
    assert direct_view(RIG, [part]) is None


def test_without_parts_the_gaze_mirror_itself_is_not_taken_for_water():
    """In the bluerov2 rays past M1 come within 64 mm of M2's centre, and its corners turn at 89 mm."""
    rig = Rig.load("bluerov2")
    layout, train = Layout.from_rig(rig), OpticalTrain.from_rig(rig, q1=0.0, q2=0.0)
    view = traced_view(rig, [])
    rows, columns = view.water.shape
    rays = train.without_mirrors().trace(pixel_grid(train.camera, columns, rows)).moved(layout.body_from_camera)
    to_m2 = layout.body_from_gimbal.translation - rays.origin_m
    nearest_m = np.linalg.norm(np.cross(rays.direction, to_m2), axis=1).reshape(rows, columns)
    past_m1 = (train.trace(pixel_grid(train.camera, columns, rows)).status == Status.MISSED_M1).reshape(rows, columns)
    half_m = np.hypot(rig.gaze.gaze_mirror.width_mm, rig.gaze.gaze_mirror.height_mm) / 2000
    assert (past_m1 & (nearest_m < half_m)).any()
    assert view.water.any()
    assert (nearest_m[view.water] >= half_m).all()


def test_it_is_kept(bare, monkeypatch):
    first = direct_view(RIG, [])
    monkeypatch.setattr("dives.views.direct_view.traced_view", lambda rig, parts: pytest.fail("it is made again"))
    again = direct_view(RIG, [])
    assert first is not None
    assert again is not None
    assert again.water.tobytes() == first.water.tobytes() == bare.water.tobytes()
    assert again.direction.tobytes() == first.direction.tobytes()
