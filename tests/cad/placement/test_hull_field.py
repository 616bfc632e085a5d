import manifold3d
import numpy as np
from numpy.testing import assert_allclose

from cad.placement.hull_field import hull_field
from cad.placement.seats import SeatFinder
from tests.cad.placement.conftest import LENGTH_MM, RADIUS_MM


def _capsule_distance(points: np.ndarray) -> np.ndarray:
    half = LENGTH_MM / 2 - RADIUS_MM
    beyond = points - np.clip(points, [-half, 0, 0], [half, 0, 0])
    return np.asarray(np.linalg.norm(beyond, axis=1) - RADIUS_MM)


def test_distances_are_those_of_the_capsule_to_a_step(finder: SeatFinder) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([10, -190, -240], [690, 190, 240], (5000, 3))
    space = finder.space
    assert_allclose(space.distances_mm(points), _capsule_distance(points), atol=space.step_mm)
    assert_allclose(space.nearest_mm(points), _capsule_distance(points), atol=2 * space.step_mm)


def test_a_hole_is_outside() -> None:
    ring = manifold3d.Manifold.cylinder(40, 50, -1, 64, True) - manifold3d.Manifold.cylinder(60, 30, -1, 64, True)
    space = hull_field(ring, np.array([-80.0, -80.0, -40.0]), np.array([80.0, 80.0, 40.0]))
    places = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [60.0, 0.0, 0.0]])
    assert_allclose(space.distances_mm(places), [30, -10, 10], atol=space.step_mm)
    assert space.inside[space.index(0, 40), space.index(1, 0), space.index(2, 0)]
    assert not space.inside[space.index(0, 0), space.index(1, 0), space.index(2, 0)]


def test_a_cavity_is_hull() -> None:
    shell = manifold3d.Manifold.sphere(60, 64) - manifold3d.Manifold.sphere(40, 64)
    space = hull_field(shell, np.full(3, -80.0), np.full(3, 80.0))
    assert_allclose(space.distances_mm(np.zeros(3)), -60, atol=2 * space.step_mm)
