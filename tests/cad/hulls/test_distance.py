"""Distances to a hull's surface, with their side: closed forms of a box and a ball, and surfaces with holes."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh

from cad.hulls.distance import nearest_points

HALF_MM = np.array([300.0, 120.0, 60.0])
ROUNDING_MM = 1e-9


@pytest.fixture(scope="module")
def points_mm() -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.5, 1.5, (400, 3)) * HALF_MM


@pytest.fixture(scope="module")
def box() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=2 * HALF_MM)


def box_distance_mm(points_mm: np.ndarray) -> np.ndarray:
    """Signed distance to a box (I. Quilez, "Distance functions"): outside to the corner, inside to the nearest side."""
    beyond = np.abs(points_mm) - HALF_MM
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0)


def test_distances_to_a_box_are_those_of_the_formula(box, points_mm):
    found = nearest_points(box, points_mm)
    assert found.distance_mm == pytest.approx(box_distance_mm(points_mm), abs=ROUNDING_MM)
    apart = np.linalg.norm(found.point_mm - points_mm, axis=1)
    assert apart == pytest.approx(np.abs(found.distance_mm), abs=ROUNDING_MM)
    in_plane = np.einsum("ij,ij->i", found.point_mm - box.triangles[found.face][:, 0], box.face_normals[found.face])
    assert in_plane == pytest.approx(0, abs=ROUNDING_MM)


def test_the_side_does_not_depend_on_which_way_all_triangles_face(box, points_mm):
    inside_out = trimesh.Trimesh(box.vertices, box.faces[:, ::-1], process=False)
    assert nearest_points(inside_out, points_mm).distance_mm == pytest.approx(box_distance_mm(points_mm))


def test_a_hole_moves_the_side_of_what_is_near_it_only():
    """A ball of 100 mm whose cap of 20 degrees is missing: the sum of exact solid angles decides as the tree does."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=100)
    ball.update_faces(ball.triangles_center[:, 2] < 100 * np.cos(np.radians(20)))
    points = np.random.default_rng(1).uniform(-120, 120, (300, 3))
    exact = igl.winding_number(np.array(ball.vertices), np.array(ball.faces), points)
    clear = np.abs(exact - 0.5) > 0.01
    inside = nearest_points(ball, points).distance_mm < 0
    assert (inside == (exact > 0.5))[clear].all()
    assert inside[np.linalg.norm(points, axis=1) < 60].all()
    assert not inside[np.linalg.norm(points, axis=1) > 101].any()


def test_sheets_that_cross_leave_no_hollow():
    """Where two boxes overlap the winding number is two: that is inside, as in one of them."""
    one, other = (trimesh.creation.box(extents=(100, 100, 100)).apply_translation((x, 0, 0)) for x in (0, 60))
    both = trimesh.util.concatenate([one, other])
    found = nearest_points(both, [[30, 0, 0], [-30, 0, 0], [90, 0, 0], [140, 0, 0]])
    assert found.distance_mm == pytest.approx([-20, -20, -20, 30], abs=ROUNDING_MM)


@pytest.mark.parametrize("points", [np.zeros(3), np.zeros((4, 2))])
def test_points_of_another_shape_are_refused(box, points):
    with pytest.raises(ValueError, match=r"points of shape \(n, 3\), got"):
        nearest_points(box, points)


def test_a_surface_without_triangles_is_refused():
    with pytest.raises(ValueError, match="triangles, got none"):
        nearest_points(trimesh.Trimesh(), np.zeros((1, 3)))
