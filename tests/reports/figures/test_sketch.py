"""Four views: what a view projects is where its rays go, and what is hidden is behind a surface."""

from __future__ import annotations

import numpy as np
import pytest

from cad.checks.standing import rig_standing
from cad.export.sketch import rig_sketch
from reports.figures.sketch import _hidden, _shaded, _views
from rigs import Rig


@pytest.fixture(scope="module")
def standing():
    return rig_standing(Rig.load("aqua2"))


@pytest.fixture(scope="module")
def sketch(standing):
    return rig_sketch(standing)


@pytest.fixture(scope="module")
def views(standing, sketch):
    return _views(standing, sketch)


def test_points_on_rays_are_projected_to_their_pixels(views):
    columns, rows = 8, 6
    for view in views:
        origins, directions = view.rays(columns, rows)
        places, depths = view.project(np.float64(origins) + 700 * np.float64(directions))
        expected = np.stack(np.meshgrid((np.arange(columns) + 0.5) / 4 - 1, 1 - (np.arange(rows) + 0.5) / 3), axis=-1)
        assert places == pytest.approx(expected.reshape(-1, 2), abs=1e-4)
        assert depths == pytest.approx(700, abs=0.01)


def test_the_front_view_has_the_left_of_the_robot_on_the_right_and_its_nose_before_its_tail(views):
    front, side, top, _ = views
    left, up, nose = np.eye(3)[[1, 2, 0]] * 100
    origin = np.zeros((1, 3))
    for view, right_of_picture, top_of_picture in ((front, left, up), (side, nose, up), (top, nose, left)):
        moved = [
            view.project(np.array([way]))[0] - view.project(origin)[0] for way in (right_of_picture, top_of_picture)
        ]
        assert moved[0][0, 0] > 0
        assert moved[1][0, 1] > 0
    assert front.project(np.array([nose]))[1] < front.project(-np.array([nose]))[1]


def test_the_hull_hides_what_is_in_it_and_nothing_in_front_of_it(views, sketch):
    """The pinhole is in the housing; M1 stands in front of the nose and is seen from the side."""
    side = views[1]
    _, depth = _shaded(side, sketch)
    points = np.array([[302.0, 60.0, 0.0], [302.0 + 95.0, 0.0, 0.0]])
    places, distances = side.project(points)
    assert _hidden(places, distances, depth, 1.0).tolist() == [True, False]


def test_the_whole_hull_is_in_the_picture(views, sketch):
    for surface in sketch.surfaces:
        places, _ = views[-1].project(np.asarray(surface.mesh.vertices))
        assert np.abs(places).max() < 1
