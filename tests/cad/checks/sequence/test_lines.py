"""How far a body can go: boxes whose gap is known, and random boxes against a search by intersections."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from cad.checks.sequence.lines import CONTACT_LINES, LINE_MM, SEAT_MM, Surface, free_travel_mm
from cad.checks.sequence.removal_paths import removal_path

UP = np.array([0.0, 0.0, 1.0])
AXES = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]


def surface_of(mesh: trimesh.Trimesh, turn: Rotation | None = None) -> Surface:
    vertices = np.asarray(mesh.vertices, dtype=float)
    return Surface(
        vertices_mm=vertices if turn is None else turn.apply(vertices), faces=np.asarray(mesh.faces, dtype=np.int64)
    )


def box(low, high, turn=None) -> Surface:
    return surface_of(trimesh.creation.box(bounds=[low, high]), turn)


@pytest.mark.parametrize("turn", [None, Rotation.from_rotvec([0.4, -1.1, 0.7])])
def test_a_box_goes_as_far_as_the_gap_over_it(turn):
    """Closed form: a plate 7 mm over a box, whichever way the two are turned."""
    moving, plate = box((0, 0, 0), (10, 10, 5), turn), box((-20, -20, 12), (20, 20, 14), turn)
    up = UP if turn is None else turn.apply(UP)
    assert free_travel_mm(moving, plate, up) == pytest.approx(7.0, abs=1e-9)
    assert free_travel_mm(moving, plate, -up) == np.inf
    assert free_travel_mm(moving.moved(30 * up), plate, -up) == pytest.approx(16.0, abs=1e-9)


def test_what_lies_on_a_face_is_hit_at_once_and_what_slides_along_it_is_not():
    moving, floor = box((0, 0, 0), (10, 10, 5)), box((-20, -20, -3), (20, 20, SEAT_MM / 2))
    assert free_travel_mm(moving, floor, -UP) == 0.0
    assert free_travel_mm(moving, floor, UP) == np.inf
    assert free_travel_mm(moving, floor, np.array([1.0, 0.0, 0.0])) == np.inf


def test_a_peg_leaves_its_hole_and_is_kept_by_a_lip():
    """A hole as a tube whose 48 sides cross the peg's 40 sides by up to 0.02 mm: a fit, not a contact."""
    peg = surface_of(trimesh.creation.cylinder(5.0, 20.0, sections=40))
    tube = surface_of(trimesh.creation.annulus(5.01, 9.0, 20.0, sections=48))
    assert free_travel_mm(peg, tube, UP) == np.inf
    lip = trimesh.creation.annulus(5.0 - 5 * LINE_MM, 9.0, 1.0, sections=48)
    lip.apply_translation((0, 0, 12.5))
    assert free_travel_mm(peg, surface_of(lip), UP) == pytest.approx(2.0, abs=1e-9)


def test_contacts_narrower_than_stated_do_not_count():
    moving = box((0, 0, 0), (10, 10, 5))
    for overlap, expected in ((CONTACT_LINES - 1, np.inf), (CONTACT_LINES + 1, 3.0)):
        beam = box((10 - overlap * LINE_MM, -5, 8), (20, 15, 9))
        assert free_travel_mm(moving, beam, UP) == pytest.approx(expected), overlap


@pytest.mark.parametrize("seed", range(4))
def test_random_boxes_meet_where_a_search_by_intersections_finds_it(seed):
    """Another way of computing it: bisection on whether the bodies, moved by a length, share volume."""
    rng = np.random.default_rng(seed)
    moving = surface_of(trimesh.creation.box((12, 9, 7)), Rotation.random(rng=rng))
    still = surface_of(trimesh.creation.box((11, 14, 6)), Rotation.random(rng=rng)).moved(np.array([3.0, -2.0, 40.0]))
    first, second = (
        manifold3d.Manifold(manifold3d.Mesh64(s.vertices_mm, s.faces.astype(np.uint64))) for s in (moving, still)
    )
    low, high = 0.0, 40.0
    while high - low > 1e-3:
        middle = (low + high) / 2
        low, high = (low, middle) if (first.translate((0, 0, middle)) ^ second).volume() > 0 else (middle, high)
    # Between the lines a corner may stand out: at most by the pitch times the steepest of its slopes.
    assert low <= free_travel_mm(moving, still, UP) + 1e-3
    assert free_travel_mm(moving, still, UP) == pytest.approx(low, abs=10 * LINE_MM)


def test_a_box_under_a_roof_comes_out_sideways_and_one_in_a_hook_in_two_moves():
    moving = box((0, 0, 0), (10, 10, 5))
    floor, roof = box((-20, -20, -2), (20, 20, 0)), box((-20, -20, 8), (20, 20, 10))
    walls = [box((-20, -20, 0), (20, -0.5, 8)), box((-20, 10.5, 0), (20, 20, 8))]
    slot = Surface.joined([floor, roof, *walls])
    path = removal_path(moving, slot, AXES)
    assert len(path) == 1
    assert abs(path[0][0]) > 29
    # A step keeps it from leaving: up first, then over it.
    steps = [box((-20, -20, 0), (-0.5, 20, 2)), box((10.5, -20, 0), (20, 20, 2))]
    over = removal_path(moving, Surface.joined([slot, *steps]), AXES)
    assert len(over) == 2
    assert 2.0 < over[0][2] < 3.0
    assert abs(over[1][0]) > 20
    high = [box((-20, -20, 0), (-0.5, 20, 4)), box((10.5, -20, 0), (20, 20, 4))]
    assert removal_path(moving, Surface.joined([slot, *high]), AXES) is None
