"""Which part of the crop a rig hides from itself, against rays that are traced pose by pose."""

from __future__ import annotations

import numpy as np
import pytest

from dives.views.robot_view import CELLS_ACROSS, CROP_CELLS, MOST_COLUMNS, VIEW_VERSION, traced_view
from optics.coverage.outcome import Outcome
from optics.coverage.pose_axes import PoseAxes
from optics.coverage.poses import seen_cells
from optics.coverage.usable_fov import usable_fov
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.occlusion import Occluder
from optics.status import Status
from optics.train import OpticalTrain
from rigs import Rig
from tracking.perception import Crop, ExactCorners
from tracking.perception.robot_view import MARGIN_PX, RobotView

RIG = Rig.load("aqua2")

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], dtype=np.int32
)  # fmt: skip

CELL_PX, TRACED_PX = 320 // CROP_CELLS[0], 320 / CELLS_ACROSS

AHEAD_M = 0.4
HALF_M = 0.03


def block_ahead() -> PartMesh:
    """A cube on the level gaze, ahead of M2."""
    centre = Layout.from_rig(RIG).body_from_gimbal.translation + np.array([AHEAD_M, 0.0, 0.0])
    return PartMesh(name="block", group=Group.FIXED, role=Role.HULL, vertices_m=HALF_M * CUBE + centre, faces=FACES)


@pytest.fixture(scope="module")
def bare() -> RobotView:
    return traced_view(RIG, [], step_deg=10.0)


@pytest.fixture(scope="module")
def blocked() -> RobotView:
    return traced_view(RIG, [block_ahead()], step_deg=10.0)


def test_a_level_gaze_of_bare_mirrors_hides_the_crops_rim_alone(bare):
    hidden = bare.mask([0.0, 0.0], 320, 240) > 0
    assert not hidden[40:200, 40:280].any()


def test_a_part_is_hidden_where_the_train_sees_it(bare, blocked):
    """The block, traced by the exact train, lies in what is hidden; what is far from it does not.

    Its corners are rounded by half a cell of those that are traced.
    """
    q = np.array([0.0, blocked.q2[np.abs(blocked.q2).argmin()]])
    train = OpticalTrain.from_rig(RIG, q1=q[0], q2=q[1])
    seen = train.project(Layout.from_rig(RIG).body_from_camera.inv().apply(block_ahead().vertices_m))
    assert (seen.status == Status.OK).all()
    x, y = np.rint(Crop.of(ExactCorners(RIG).corners(q)).from_image(seen.pixels)).astype(int).T
    added = (blocked.mask(q, 320, 240) > 0) & (bare.mask(q, 320, 240) == 0)
    middle = np.array([x.mean(), y.mean()])
    inwards = np.stack([x, y], axis=1) + TRACED_PX / 2 * np.sign(middle - np.stack([x, y], axis=1))
    assert added[tuple(inwards.astype(int).T[::-1])].all()
    margin = MARGIN_PX + 2 * CELL_PX
    rows, columns = added.nonzero()
    assert x.min() - margin <= columns.min() <= columns.max() <= x.max() + margin
    assert y.min() - margin <= rows.min() <= rows.max() <= y.max() + margin


def pole() -> PartMesh:
    """An upright pole of 2 cm beside the level gaze, as near to M2 as the robot's own parts are."""
    centre = Layout.from_rig(RIG).body_from_gimbal.translation + np.array([0.25, 0.03, 0.0])
    vertices = CUBE * [0.01, 0.01, 0.3] + centre
    return PartMesh(name="pole", group=Group.FIXED, role=Role.MOUNT, vertices_m=vertices, faces=FACES)


def test_between_the_poses_of_the_grid_the_water_beside_a_near_pole_is_kept():
    """Against a view of that pose alone: all of the pole is hidden, and little more than the margin beside it."""
    q1, q2 = 9.0, 3.0
    near = {"joints__pan__min_deg": q1 - 6, "joints__pan__max_deg": q1 + 6}
    near |= {"joints__tilt__min_deg": q2 - 4, "joints__tilt__max_deg": q2 + 4}
    there = {"joints__pan__min_deg": q1 - 0.01, "joints__pan__max_deg": q1 + 0.01}
    there |= {"joints__tilt__min_deg": q2 - 0.01, "joints__tilt__max_deg": q2 + 0.01}
    q = np.radians([q1, q2])
    hidden = traced_view(RIG.with_(**near), [pole()]).mask(q, 320, 240) > 0
    exact = traced_view(RIG.with_(**there), [pole()]).mask(q, 320, 240) > 0
    bare = traced_view(RIG.with_(**there), []).mask(q, 320, 240) > 0
    of_pole = exact & ~bare
    assert of_pole.sum() > 5000
    assert (of_pole & ~hidden).sum() < 0.1 * of_pole.sum()
    assert (hidden & ~exact).sum() < 0.1 * of_pole.sum()


def test_a_mirror_that_is_small_in_the_image_takes_no_more_room(monkeypatch):
    """A lens of a third of the focal length: cells as fine as the others' would be nine times as many."""
    columns = []

    def counted(*args, **kwargs):
        columns.append(kwargs["columns"])
        return seen_cells(*args, **kwargs)

    monkeypatch.setattr("dives.views.robot_view.seen_cells", counted)
    wide = traced_view(RIG.with_(camera__fx_px=170.0, camera__fy_px=170.0), [], step_deg=20.0)
    assert columns == [MOST_COLUMNS]
    hidden = wide.mask([0.0, 0.0], 320, 240) > 0
    assert not hidden[60:180, 60:260].any()


def test_the_cells_are_as_many_as_the_usable_field_of_view_says():
    """Two codes that count the same rays: whether a cell looks into the water, and how many do."""
    q = np.radians([[0.0, 0.0], [40.0, 20.0], [-77.5, 122.5]])
    parts = [block_ahead()]
    cells = seen_cells(
        OpticalTrain.from_rig(RIG, q1=0.0, q2=0.0),
        Layout.from_rig(RIG),
        {group: Occluder.of_group(parts, group) for group in Group},
        PoseAxes.of(Layout.from_rig(RIG), q[:, 0], q[:, 1]),
        columns=64,
        rows=48,
    )
    expected = usable_fov(RIG, parts, q1=q[:, 0], q2=q[:, 1], columns=64, rows=48).pixels[:, Outcome.SEEN]
    assert cells.sum(axis=(1, 2)).tolist() == expected.tolist()


def test_recorded(blocked, check_recorded):
    check_recorded("robot view", VIEW_VERSION, rel=1e-3, depth=blocked.depth.astype(np.float64).mean(axis=(2, 3)))
