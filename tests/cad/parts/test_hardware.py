"""Bought pieces: shapes against closed forms, screws in what they go into, and the plastic around the inserts."""

from __future__ import annotations

import re
from math import pi, sqrt

import numpy as np
import pytest
from build123d import Plane

from cad.parts.gimbal_base import base_hardware, base_placement, flange_seat
from cad.parts.gimbal_dimensions import GimbalDimensions
from cad.parts.hardware import (
    Bushing,
    cap_screw,
    clearance_diameter_mm,
    flanged_bushing,
    head_diameter_mm,
    head_height_mm,
    heat_set_insert,
    insert,
    nominal_diameter_mm,
    screw_length_mm,
)
from cad.parts.mirror_holder import holder_hardware
from cad.parts.servo import ear_hole_positions
from cad.parts.yoke import yoke_hardware
from cad.shapes import cylinder
from optics.mesh import Group, Role

RELATIVE_ROUNDING = 1e-9
END_MM = 0.01
"""Faces that coincide are left out of an intersection."""
LEAST_ENGAGEMENT = 1.0
"""Thread engaged in brass or in a horn, in diameters: the usual rule for metal in metal."""
HOST = {"pan_ear": "gimbal_base", "tilt_ear": "yoke", "pivot": "mirror_holder"}
"""Part that an insert is melted into, by the beginning of its name."""


@pytest.mark.parametrize(
    ("thread", "hole", "length", "wall"), [("M2", 3.2, 4.0, 1.3), ("M3", 4.0, 4.0, 1.6), ("M4", 5.6, 4.0, 2.1)]
)
def test_inserts_have_their_makers_holes_and_walls(thread, hole, length, wall):
    """Ruthex's data sheets: GE-M2x04-001, GE-M3Sx40-002, GE-M4Sx04-1."""
    size = insert(thread)
    assert (size.hole_diameter_mm, size.length_mm, size.wall_mm) == (hole, length, wall)
    assert heat_set_insert(thread).catalogue.startswith(f"Heat-set insert {thread} x 4, brass (ruthex GE-{thread}")


@pytest.mark.parametrize(
    ("thread", "head", "height", "socket"),
    [("M2", 3.98, 2, (1.5, 1.0)), ("M3", 5.68, 3, (2.5, 1.3)), ("M4", 7.22, 4, (3, 2))],
)
def test_a_cap_screw_has_the_standards_dimensions(thread, head, height, socket):
    """ISO 4762 (largest, knurled head): volume as head, shank and hexagonal socket of a width and a depth."""
    assert (head_diameter_mm(thread), head_height_mm(thread)) == (head, height)
    diameter, length = nominal_diameter_mm(thread), 12
    expected = pi / 4 * (head**2 * height + diameter**2 * length) - sqrt(3) / 2 * socket[0] ** 2 * socket[1]
    screw = cap_screw(thread, length)
    assert screw.shape.volume == pytest.approx(expected, rel=RELATIVE_ROUNDING)
    lowest = screw.shape.bounding_box().min.Z
    assert lowest == pytest.approx(-length, abs=1e-6)
    assert screw.catalogue == f"Socket head cap screw ISO 4762 {thread}x12 A4-70"


def test_clearance_holes_are_of_the_medium_fit():
    """ISO 273."""
    assert [clearance_diameter_mm(thread) for thread in ("M2", "M3", "M4")] == [2.4, 3.4, 4.5]


def test_a_bushing_is_a_tube_with_a_flange():
    bushing = Bushing(bore_mm=6.0, outer_mm=8.0, flange_mm=12.0, flange_thickness_mm=1.0, length_mm=6.0)
    expected = pi / 4 * ((12**2 - 6**2) * 1 + (8**2 - 6**2) * 5)
    assert flanged_bushing(bushing).shape.volume == pytest.approx(expected, rel=RELATIVE_ROUNDING)


def test_the_longest_standard_screw_that_fits_is_taken():
    assert [screw_length_mm(room) for room in (3.0, 7.9, 8.0, 14.5, 100.0)] == [3, 6, 8, 12, 40]
    with pytest.raises(ValueError, match=r"room for a screw of 3 mm or longer, got 2\.9 mm"):
        screw_length_mm(2.9)


def vectors(piece):
    """Seat of a piece and the direction in which it goes in, in the frame of its group, millimetres."""
    plane = Plane(piece.pose)
    return np.array(tuple(plane.origin)), -np.array(tuple(plane.z_dir))


def gimbal_hardware(built):
    """Everything that the gimbal is bolted with, by name."""
    d = GimbalDimensions.from_rig(built.rig)
    placement = base_placement(d, built.layout)
    base = base_hardware(d, placement, flange_seat(built.rig, placement))
    return {piece.name: piece for piece in base + yoke_hardware(d) + holder_hardware(d)}


def test_each_piece_is_a_part_of_the_assembly(built):
    parts = {part.name: part for part in built.parts}
    for name, piece in gimbal_hardware(built).items():
        assert (parts[name].role, parts[name].group) == (Role.HARDWARE, piece.group)
        assert parts[name].catalogue == piece.piece.catalogue


def test_screws_hold_in_their_inserts_and_end_within_the_plastic(built):
    pieces, meshes = gimbal_hardware(built), {mesh.name: mesh for mesh in built.meshes}
    inserts = [name for name in pieces if name.endswith("_insert")]
    ears = sum(len(ear_hole_positions(servo)) for servo in (built.rig.gaze.servos.pan, built.rig.gaze.servos.tilt))
    assert len(inserts) == ears + 1
    for name in inserts:
        screw = pieces[name.replace("_insert", "_screw")]
        (seat, inwards), (mouth, _) = vectors(screw), vectors(pieces[name])
        thread, length = re.search(r"M(\d)x(\d+)", screw.piece.catalogue).groups()
        reach = (seat + float(length) * inwards - mouth) @ inwards
        assert LEAST_ENGAGEMENT * float(thread) <= reach, name
        local = 1000 * meshes[host_of(name)].vertices_m
        if screw.group is Group.FIXED:
            # Tips in the foot end under the bushing; nothing is in their way but the plastic itself.
            local = local[np.linalg.norm((local - mouth) - ((local - mouth) @ inwards)[:, None] * inwards, axis=1) < 5]
        assert reach <= ((local - mouth) @ inwards).max() + 1e-6, name


def host_of(insert_name):
    return next(part for start, part in HOST.items() if insert_name.startswith(start))


@pytest.mark.parametrize("name", ["pan_ear_1", "pan_ear_2", "tilt_ear_1", "tilt_ear_2", "pivot"])
def test_the_wall_around_an_insert_is_what_its_maker_asks_for(built, name):
    """A tube of plastic around each insert, as long as the insert and as thick as the maker says, is all there."""
    piece = gimbal_hardware(built)[f"{name}_insert"]
    mouth, inwards = vectors(piece)
    size = insert("M3" if name == "pivot" else built.rig.gaze.servos.pan.ear_screw)
    end = mouth + (size.length_mm - END_MM) * inwards
    start = mouth + END_MM * inwards
    wall = cylinder(start, end, size.boss_radius_mm) - cylinder(start, end, size.hole_diameter_mm / 2)
    solid = next(part.solid for part in built.parts if part.name == host_of(name))
    assert (wall & solid).volume == pytest.approx(wall.volume, rel=1e-6)
