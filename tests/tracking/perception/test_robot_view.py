"""Which pixels of the crop are the robot's own, between and beyond the joint values at which it is known."""

from __future__ import annotations

import numpy as np

from tracking.perception import detect
from tracking.perception.robot_view import DEEPEST_PX, MARGIN_PX, RobotView

RED, WATER = (200, 30, 30), (20, 90, 120)


COLUMNS, ROWS, CELL_PX = 20, 10, 8


def edge_at(*columns: float) -> RobotView:
    """On pan angles of -1, 0 and 1 the robot reaches from the left to a column of the crop; tilt does not matter."""
    cells = np.arange(COLUMNS) + 0.5
    depth_px = CELL_PX * np.array([[np.tile(column - cells, (ROWS, 1))] * 2 for column in columns])
    depth = np.clip(depth_px, -DEEPEST_PX, DEEPEST_PX).astype(np.int8)
    return RobotView(q1=np.array([-1.0, 0.0, 1.0]), q2=np.array([0.0, 1.0]), depth=depth)


def reach_px(view: RobotView, pan: float) -> list[int]:
    """To which pixels the robot reaches in the crop's rows."""
    mask = view.mask([pan, 0.3], CELL_PX * COLUMNS, CELL_PX * ROWS)
    return sorted(set((mask == 255).sum(axis=1).tolist()))


def test_at_a_known_pose_its_edge_is_grown_by_the_margin():
    assert reach_px(edge_at(4.0, 6.0, 12.0), 0.0) == [CELL_PX * 6 + MARGIN_PX]


def test_between_poses_the_edge_moves_evenly():
    view = edge_at(4.0, 6.0, 12.0)
    assert reach_px(view, -0.5) == [CELL_PX * 5 + MARGIN_PX]
    assert reach_px(view, 0.75) == [CELL_PX * 10.5 + MARGIN_PX]


def test_beyond_the_grid_its_edge_holds():
    view = edge_at(4.0, 6.0, 12.0)
    assert reach_px(view, 3.0) == [CELL_PX * 12 + MARGIN_PX]
    assert reach_px(view, -3.0) == [CELL_PX * 4 + MARGIN_PX]


def test_the_depth_of_a_cell_is_that_of_the_nearest_known_pose():
    view = edge_at(4.0, 6.0, 12.0)
    q = np.array([[-0.6, 0.3], [0.4, 0.9], [3.0, 0.3]])
    depth = view.depth_in(q, across=np.array([0.0, 0.52, 0.99]), down=np.array([0.0, 0.5, 0.99]))
    np.testing.assert_allclose(depth, CELL_PX * np.array([4 - 0.5, 6 - 10.5, 12 - 19.5]))


def test_what_is_ignored_is_not_detected_and_what_lies_beside_is():
    crop = np.full((240, 320, 3), WATER, dtype=np.uint8)
    crop[50:110, 40:100] = crop[50:110, 200:260] = RED
    ignored = np.zeros((240, 320), dtype=np.uint8)
    ignored[:, :160] = 255
    assert len(detect(crop).blobs) == 2
    (blob,) = detect(crop, ignored=ignored).blobs
    assert blob.centroid_px[0] > 160
