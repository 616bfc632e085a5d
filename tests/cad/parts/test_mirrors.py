"""Mirror cells: what the lips hold and leave free, clips, vents, and the plates that fit no cell."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from build123d import Part, Pos

from cad.parts.mirror_sides import BOND_HOLE_DIAMETER_MM
from cad.parts.mirrors import (
    BED_MM,
    FIT_MM,
    FRAME_MM,
    LIP_OVERLAP_MM,
    VENT_DIAMETER_MM,
    cell_radius_mm,
    clip_hardware,
    mirror_clip,
    mirror_plate,
    mirror_tray,
)
from cad.shapes import box, cylinder
from optics.mesh import Group
from rigs import FoldMirror, GazeMirror

TOUCHING_MM3 = 1e-6
"""Volume shared by solids that touch: rounding of the kernel (1e-7 mm) on areas of some 1000 mm2 is less."""


def mirror(thickness_mm: float = 3.0) -> GazeMirror:
    return GazeMirror(width_mm=80.0, height_mm=100.0, thickness_mm=thickness_mm, distance_mm=125.0)


def shared_mm3(first, second) -> float:
    common = Part() + first & Part() + second
    return 0.0 if common is None else sum(solid.volume for solid in common.solids())


@pytest.mark.parametrize(
    ("fixing", "wall_mm", "thickness_mm"), list(product(["glue", "screws"], [1.2, 12.0], [1.5, 6.0]))
)
def test_a_cell_is_one_solid_that_leaves_plate_and_clip_their_room(fixing, wall_mm, thickness_mm):
    plate, tray = mirror_plate(mirror(thickness_mm)), mirror_tray(mirror(thickness_mm), wall_mm, fixing)
    assert tray.is_valid
    assert len(tray.solids()) == 1
    assert shared_mm3(tray, plate) < TOUCHING_MM3
    if fixing == "screws":
        clip = mirror_clip(mirror(thickness_mm), wall_mm)
        assert clip.is_valid
        assert shared_mm3(clip, plate) < TOUCHING_MM3
        assert shared_mm3(clip, tray) < TOUCHING_MM3
        for piece in clip_hardware(mirror(thickness_mm), wall_mm, "gaze_mirror", Group.TILT):
            assert shared_mm3(piece.solid, clip) < TOUCHING_MM3, piece.name
            assert shared_mm3(piece.solid, tray) < TOUCHING_MM3, piece.name


@pytest.mark.parametrize("fixing", ["glue", "screws"])
def test_lips_lie_on_the_face_and_leave_the_rest_of_it_free(fixing):
    """Statics of the cell: the face cannot come forward of z = 0, and light reaches all that no lip covers."""
    plate = mirror_plate(mirror())
    held = mirror_tray(mirror(), 4.0, fixing)
    if fixing == "screws":
        held = held + mirror_clip(mirror(), 4.0)
    forward = Pos(0, 0, 0.1) * plate
    # Two lips of 1.5 mm along the sides; the clip's lies between them, less its fit.
    area = 2 * LIP_OVERLAP_MM * 100.0
    if fixing == "screws":
        area += LIP_OVERLAP_MM * (80.0 - 2 * LIP_OVERLAP_MM - 2 * FIT_MM)
    assert shared_mm3(held, forward) == pytest.approx(0.1 * area, rel=1e-6)
    top = 50.0 - (LIP_OVERLAP_MM if fixing == "screws" else 0.0)
    free = box((-38.5, 38.5), (-50.0, top), (0.0, 20.0))
    assert shared_mm3(held, free) < TOUCHING_MM3


def test_only_a_clip_keeps_the_mirror_from_sliding_out():
    slid = Pos(0, 1, 0) * mirror_plate(mirror())
    assert shared_mm3(mirror_tray(mirror(), 4.0, "screws"), slid) < TOUCHING_MM3
    # 1 mm of slide less the fit, over the whole section of the plate.
    assert shared_mm3(mirror_clip(mirror(), 4.0), slid) == pytest.approx((1 - FIT_MM) * 80 * 3, rel=1e-6)


@pytest.mark.parametrize("fixing", ["glue", "screws"])
def test_air_gets_out_at_every_corner_behind_the_plate(fixing):
    """A straight rod through each corner's vent, from the bed behind the plate into the open water."""
    tray = mirror_tray(mirror(), 4.0, fixing)
    for x, y in product((-35.0, 35.0), (-45.0, 45.0)):
        rod = cylinder((x, y, -3.0 - BED_MM / 2), (x, y, -30.0), VENT_DIAMETER_MM / 2 - 0.1)
        assert shared_mm3(tray, rod) < TOUCHING_MM3


def test_a_framed_cell_lacks_its_floor_but_for_a_frame():
    """Window to the open edge instead of the bonding holes in it and of the vents beside that edge: closed form."""
    whole, framed = (mirror_tray(mirror(), 2.5, framed=framed) for framed in (False, True))
    window = (80.0 - 2 * FRAME_MM) * (100.0 - FRAME_MM)
    holes = np.pi / 4 * (4 * BOND_HOLE_DIAMETER_MM**2 + 2 * VENT_DIAMETER_MM**2)
    assert len(framed.solids()) == 1
    assert whole.volume - framed.volume == pytest.approx(2.5 * (window - holes), rel=1e-9)
    # What defines the mirror's plane is as before.
    forward = Pos(0, 0, 0.1) * mirror_plate(mirror())
    assert shared_mm3(framed, forward) == pytest.approx(0.1 * 2 * LIP_OVERLAP_MM * 100.0, rel=1e-6)


@pytest.mark.parametrize("outline", ["rectangle", "octagon"])
def test_a_framed_cell_under_a_clip_or_of_cut_corners_is_closed_and_a_small_one_whole(outline):
    plate = GazeMirror(width_mm=80.0, height_mm=100.0, thickness_mm=3.0, distance_mm=125.0, outline=outline)
    tray = mirror_tray(plate, 2.5, "screws", framed=True)
    assert tray.is_valid
    assert len(tray.solids()) == 1
    middle = box((-20, 20), (-20, 20), (-50, 0))
    assert shared_mm3(tray, middle) < TOUCHING_MM3
    assert shared_mm3(tray, box((-1, 1), (45, 50), (-50, 0))) > 0
    small = GazeMirror(width_mm=40.0, height_mm=100.0, thickness_mm=3.0, distance_mm=125.0, outline=outline)
    assert mirror_tray(small, 2.5, framed=True).volume == pytest.approx(mirror_tray(small, 2.5).volume, rel=1e-12)


@pytest.mark.parametrize("fixing", ["glue", "screws"])
def test_a_turning_cell_stays_within_its_radius(fixing):
    for wall_mm in (1.2, 8.0):
        shapes = [
            mirror_tray(mirror(), wall_mm, fixing),
            *([mirror_clip(mirror(), wall_mm)] if fixing == "screws" else []),
        ]
        reach = max((v.Y**2 + v.Z**2) ** 0.5 for shape in shapes for v in shape.vertices())
        radius = cell_radius_mm(mirror(), wall_mm, fixing)
        # Rounded corners take a millimetre or two off the outermost ones.
        assert radius - 2.5 <= reach <= radius + 1e-6


@pytest.mark.parametrize(("kind", "key"), [(FoldMirror, "fold_mirror"), (GazeMirror, "gaze_mirror")])
@pytest.mark.parametrize("thickness_mm", [1.0, 8.0])
def test_a_plate_that_fits_no_cell_is_named(kind, key, thickness_mm):
    plate = kind(width_mm=80.0, height_mm=90.0, thickness_mm=thickness_mm, distance_mm=95.0)
    with pytest.raises(ValueError, match=rf"{key}\.thickness_mm = {thickness_mm:g}: expected 1\.5 to 6"):
        mirror_tray(plate, 4.0)
