"""Mirrors: reflections as matrices, outlines against another point-in-polygon rule, wrong outlines refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.path import Path
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import to_columns, to_rows
from optics.kernels.backend import Array3f64
from optics.mirror import PlaneMirror, Reflection, intersect, unfold
from optics.mirror_outline import Polygon, Rectangle

ROUNDING = 4e-15
"""A dozen float64 operations on numbers of order one."""

coordinates = st.floats(-1, 1).map(lambda x: round(x, 6))
vectors = st.tuples(coordinates, coordinates, coordinates).filter(lambda v: np.linalg.norm(v) > 0.1)
points = st.tuples(coordinates, coordinates, coordinates)


def reflection(normal, offset):
    return Reflection(normal=np.array(normal) / np.linalg.norm(normal), offset_m=offset)


@given(normal=vectors, offset=coordinates, point=points)
def test_reflecting_twice_changes_nothing(normal, offset, point):
    once = reflection(normal, offset)
    np.testing.assert_allclose(once.apply(once.apply(point)), point, rtol=0, atol=ROUNDING)


@given(normal=vectors, offset=coordinates, point=points)
def test_the_plane_halves_the_way_to_the_image(normal, offset, point):
    """Figure 4 of Cortes-Perez & Torres-Mendez 2021: the image lies as deep behind the mirror as the object before."""
    mirror = reflection(normal, offset)
    image = mirror.apply(point)
    assert mirror.normal @ (image + point) / 2 == pytest.approx(offset, abs=ROUNDING)
    np.testing.assert_allclose(np.cross(image - point, mirror.normal), 0, rtol=0, atol=ROUNDING)


@given(normal=vectors, offset=coordinates, point=points)
def test_the_matrix_does_the_same_and_is_improper(normal, offset, point):
    mirror = reflection(normal, offset)
    np.testing.assert_allclose((mirror.as_matrix() @ [*point, 1])[:3], mirror.apply(point), rtol=0, atol=ROUNDING)
    assert np.linalg.det(mirror.as_matrix()) == pytest.approx(-1, abs=ROUNDING)


@given(first=vectors, second=vectors, offset=coordinates, point=points)
def test_two_reflections_turn_by_twice_the_angle_between_the_mirrors(first, second, offset, point):
    """Closed form: the product of two reflections is proper and turns about the line in which the planes meet."""
    m1, m2 = reflection(first, offset), reflection(second, -offset)
    both = m2.after(m1)
    np.testing.assert_allclose(both.apply(np.array(point)), m2.apply(m1.apply(point)), rtol=0, atol=ROUNDING)
    assert np.linalg.det(both.as_matrix()) == pytest.approx(1, abs=ROUNDING)
    cosine = m1.normal @ m2.normal
    # Trace of a turn by a: 1 + 2 cos a, with a twice the angle between the normals.
    assert np.trace(both.rotation.as_matrix()) == pytest.approx(1 + 2 * (2 * cosine**2 - 1), abs=ROUNDING)


@given(normal=vectors, point=points, centre=points)
def test_the_kernel_reflects_points_as_the_transform(normal, point, centre):
    up = np.eye(3)[np.argmin(np.abs(normal))]
    mirror = PlaneMirror(point_m=centre, normal=normal, up=up)
    found = to_rows(unfold(mirror.parameters(), Array3f64(*point)))[0]
    np.testing.assert_allclose(found, mirror.reflection.apply(point), rtol=0, atol=ROUNDING)


def test_axes_are_right_handed_and_up_is_made_perpendicular():
    mirror = PlaneMirror(point_m=(0, 0, 1), normal=(0, 0, -2), up=(0, 3, 5))
    np.testing.assert_allclose(mirror.axes, np.column_stack([[-1, 0, 0], [0, 1, 0], [0, 0, -1]]), atol=ROUNDING)


def test_a_mirror_at_a_pose_has_its_corners_there():
    """Width along the pose's x, height along its y; the face is at z = 0."""
    pose = RigidTransform.from_components([0.1, -0.2, 0.3], Rotation.from_euler("xyz", [0.3, -0.4, 1.2]))
    mirror = PlaneMirror.from_pose(pose, Rectangle(half_width=0.04, half_height=0.05))
    expected = pose.apply([[-0.04, -0.05, 0], [0.04, -0.05, 0], [0.04, 0.05, 0], [-0.04, 0.05, 0]])
    np.testing.assert_allclose(mirror.corners_m, expected, rtol=0, atol=ROUNDING)
    with pytest.raises(ValueError, match="expected a mirror with an outline, got an unbounded one"):
        _ = PlaneMirror.from_pose(pose).corners_m


def test_a_ray_intersects_the_front_the_back_or_nothing():
    """A mirror at z = 1 that faces the origin: closed form for rays along z from both sides, away, and beside it."""
    square = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
    mirror = PlaneMirror(point_m=(0, 0, 1), normal=(0, 0, -1), up=(0, 1, 0), outline=Polygon.of(square))
    origins = np.array([[0, 0, 0], [0.05, 0, 3], [0, 0, 0], [0.2, 0, 0], [0, 0, 0], [0, 0, 1]], dtype=float)
    directions = np.array([[0, 0, 1], [0, 0, -1], [0, 0, -1], [0, 0, 1], [1, 0, 0], [0, 0, 1]], dtype=float)
    hit = intersect(mirror.parameters(), Array3f64(*to_columns(origins)), Array3f64(*to_columns(directions)))
    assert np.array(hit.front).tolist() == [True, False, False, False, False, False]
    assert np.array(hit.back).tolist() == [False, True, False, False, False, False]
    np.testing.assert_allclose(np.array(hit.distance)[:4], [1, 2, -1, 1], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(to_rows(hit.point)[0], [0, 0, 1], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(to_rows(hit.direction)[:2], [[0, 0, -1], [0, 0, 1]], rtol=0, atol=ROUNDING)


OUTLINES = {
    "triangle": [[-0.9, -0.8], [0.9, -0.5], [0.1, 0.9]],
    "clockwise": [[0.1, 0.9], [0.9, -0.5], [-0.9, -0.8]],
    "off centre": [[0.2, 0.1], [0.9, 0.2], [0.8, 0.9], [0.3, 0.7]],
    "octagon": [[np.cos(a), np.sin(a)] for a in np.arange(8) * np.pi / 4],
}


@pytest.mark.parametrize("name", OUTLINES)
def test_an_outline_lets_in_what_another_rule_does(name):
    """Half-planes against matplotlib's winding rule, on points that are not on an edge."""
    mirror = PlaneMirror(point_m=(0, 0, 1), normal=(0, 0, -1), up=(0, 1, 0), outline=Polygon.of(OUTLINES[name]))
    local = np.random.default_rng(4).uniform(-1.2, 1.2, (2000, 2))
    origins = np.column_stack([local @ mirror.axes[:2, :2].T, np.zeros(2000)])
    hit = intersect(mirror.parameters(), Array3f64(*to_columns(origins)), Array3f64(0, 0, 1))
    expected = Path(OUTLINES[name]).contains_points(local)
    assert 0 < expected.sum() < 2000
    assert (np.array(hit.front) == expected).all()


PENTAGRAM = [[np.cos(a), np.sin(a)] for a in np.arange(5) * 4 * np.pi / 5]


@pytest.mark.parametrize(
    ("outline", "message"),
    [
        ([[0, 0], [1, 0]], "expected outline with at least three finite corners"),
        (np.empty((0, 2)), "expected outline with at least three finite corners"),
        ([[0, 0], [1, 0], [np.nan, 1]], "expected outline with at least three finite corners"),
        ([[0, 0], [1, 0], [0.5, 0.1], [0.5, 1]], "expected outline to be convex"),
        ([[0, 0], [1, 0], [2, 0]], "expected outline to be convex"),
        ([[0, 0], [1, 0], [1, 0], [1, 1]], "expected outline to be convex"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "expected outline to be convex"),
        (PENTAGRAM, "expected outline to be convex"),
        ([0, 1, 2], r"expected outline of shape \(n, 2\)"),
    ],
    ids=["two", "none", "nan", "dent", "line", "double", "bow tie", "pentagram", "shape"],
)
def test_what_is_no_convex_outline_is_refused(outline, message):
    with pytest.raises(ValueError, match=message):
        Polygon.of(outline)


def test_up_along_the_normal_is_refused():
    with pytest.raises(ValueError, match="expected up to differ from the normal"):
        PlaneMirror(point_m=(0, 0, 1), normal=(0, 0, -1), up=(0, 0, 2))
