"""A fold bracket in halves: the whole but for the joint, whose volume and clearance have closed forms."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, pi

import numpy as np
import pytest
from build123d import Solid
from manifold3d import Manifold, Mesh64

from cad.assembly.print_pose import print_pose
from cad.assembly.tessellation import LINEAR_TOLERANCE_MM, tessellated
from cad.checks.sequence.steps import assembly_steps
from cad.overlaps import manifold_mm
from cad.parts.bracket.bracket_joint import (
    FIT_MM,
    FRONT,
    FRONT_PLATE_MM,
    KEY_MM,
    KEY_WIDTHS_MM,
    REAR,
    REAR_PLATE_MM,
    BracketJoint,
    bracket_joint,
    girder_sides_mm,
    halves,
)
from cad.parts.bracket.bracket_placement import bracket_placement
from cad.parts.bracket.fold_bracket import fold_bracket_solid
from cad.parts.hardware import INSERT_RELIEF_MM, clearance_diameter_mm, insert
from optics.layout import Layout
from rigs import Rig

MESHED_MM3 = 1.0
"""Volume shared by triangles that touch."""


def meshed(solid: Solid) -> Manifold:
    surface = tessellated(solid, LINEAR_TOLERANCE_MM)
    return Manifold(Mesh64(np.asarray(surface.vertices), np.asarray(surface.faces, np.uint64)))


@pytest.fixture(scope="module")
def joint(split) -> BracketJoint:
    return bracket_joint(bracket_placement(split.rig, split.layout))


@pytest.fixture(scope="module")
def bodies(split) -> tuple[Manifold, Manifold]:
    return manifold_mm(split.part(REAR).mesh), manifold_mm(split.part(FRONT).mesh)


def test_the_halves_fit_a_bed_that_the_whole_does_not(split):
    mount = split.rig.gaze.mount
    assert [print_pose(split.part(name).mesh, mount).fits for name in (REAR, FRONT)] == [True, True]
    assert "fold_bracket" not in [part.name for part in split.parts]


def test_a_bracket_that_fits_stays_whole(built):
    names = [part.name for part in built.parts]
    assert "fold_bracket" in names
    assert not [name for name in names if name in (REAR, FRONT) or name.startswith("fold_joint")]


def test_outside_the_plates_the_halves_are_the_whole_and_the_plates_have_a_closed_form(joint, bodies):
    """Trapezoids less holes; key and groove of width w(u) = foot - lean u and length L - u at the depth u."""
    whole = meshed(fold_bracket_solid(joint.placement))
    (low, high), ends = joint.levels_mm, (joint.x_mm - REAR_PLATE_MM, joint.x_mm, joint.x_mm + FRONT_PLATE_MM)
    beside = whole.trim_by_plane((1, 0, 0), ends[0]).trim_by_plane((-1, 0, 0), -ends[2])
    # Between the plates' ends, the whole has M1's cell below them.
    rest = whole.volume() - beside.trim_by_plane((0, 0, 1), low).volume()
    widths = [np.diff(girder_sides_mm(joint.placement, end))[0] for end in ends]
    plates = (REAR_PLATE_MM * (widths[0] + widths[1]) + FRONT_PLATE_MM * (widths[1] + widths[2])) / 2 * (high - low)
    # Chords around a hole leave out up to 1 % of it.
    wide, narrow = insert("M4").hole_diameter_mm, clearance_diameter_mm("M4")
    deep = insert("M4").length_mm + INSERT_RELIEF_MM
    holes = pi / 4 * (wide**2 * deep + narrow**2 * (REAR_PLATE_MM - deep + FRONT_PLATE_MM))
    foot, lean = KEY_WIDTHS_MM[0], (KEY_WIDTHS_MM[0] - KEY_WIDTHS_MM[1]) / KEY_MM
    length = joint.placement.roof_low_mm - low
    key = taper(foot, lean, length, KEY_MM)
    groove = taper(foot + 2 * FIT_MM * hypot(1, lean / 2), lean, length + FIT_MM * 2**0.5, KEY_MM + FIT_MM)
    expected = rest + plates - 4 * holes + key - groove
    assert sum(body.volume() for body in bodies) == pytest.approx(expected, abs=0.01 * 4 * holes)


def taper(foot: float, lean: float, length: float, depth: float) -> float:
    """Integral of (foot - lean u) (length - u) from 0 to depth."""
    return foot * length * depth - (foot + lean * length) * depth**2 / 2 + lean * depth**3 / 3


@pytest.mark.parametrize(
    ("shift_mm", "intersects"),
    [
        ((0, 0, 0), False),
        ((0, 0.9 * FIT_MM, 0), False),
        ((0, -0.9 * FIT_MM, 0), False),
        ((0, 0, 0.9 * FIT_MM), False),
        ((0, 2 * FIT_MM, 0), True),
        ((0, -2 * FIT_MM, 0), True),
        ((0, 0, 2 * FIT_MM), True),
        ((-FIT_MM, 0, 0), True),
    ],
)
def test_the_key_leaves_the_halves_their_fit_and_no_more(bodies, shift_mm, intersects):
    rear, front = bodies
    shared = (rear ^ front.translate(shift_mm)).volume()
    assert (shared > MESHED_MM3) == intersects


@pytest.mark.parametrize("name", ["aqua2", "torpedo"])
def test_other_brackets_make_two_valid_solids_too(name):
    """aqua2's girders lead from one side of the hull, torpedo's are as wide as its saddle."""
    rig = Rig.load(name)
    placement = bracket_placement(rig, Layout.from_rig(rig))
    joint = bracket_joint(placement)
    assert joint is not None
    assert all(half.is_valid for half in halves(joint, fold_bracket_solid(placement)))


def test_a_bracket_without_room_between_pedestal_and_cell_has_no_joint(joint):
    assert bracket_joint(replace(joint.placement, girder_mm=10.0)) is None


def test_the_halves_are_screwed_together_before_they_go_onto_the_hull(split):
    """Inserts before, M1 in the front half; every piece has its removal path and every screw its key."""
    bracket = replace(split, parts=tuple(part for part in split.parts if part.name.startswith(("hull", "fold_"))))
    steps = assembly_steps(bracket)
    assert [step.problems for step in steps] == [[]] * len(steps)
    assert [step.part for step in steps] == [REAR, "fold_mirror", FRONT, REAR]
    assert len(steps[0].added) == 4
    assert sum("screw" in name for name in steps[2].added) == 4
