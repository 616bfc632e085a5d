"""The checks find nothing wrong with the presets, and find what is put wrong on purpose."""

from __future__ import annotations

from dataclasses import replace

import pytest
from build123d import Pos

from cad.assembly.assembly import Part, build_assembly
from cad.checks import assembly_checks as checks
from cad.checks.assembly_checks import assembly_checks, assembly_problems
from cad.checks.attachment import attachment_findings
from cad.checks.clearance import admissible
from cad.hulls.hull import hull_shape
from optics.layout import Layout
from optics.mesh import Group, Role
from rigs import NoPortSpec


def with_camera(rig, **changes):
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=changes)})


def replaced(rig, section, **changes):
    return rig.with_gaze(**{section: changes})


def with_part(assembly, name, solid):
    parts = tuple(replace(part, make=lambda: solid) if part.name == name else part for part in assembly.parts)
    return replace(assembly, parts=parts)


def test_the_presets_are_feasible(aqua2):
    assert assembly_problems(aqua2) == []


def test_a_part_in_two_pieces_is_found(aqua2):
    solid = aqua2.part("yoke").solid
    problems = assembly_problems(with_part(aqua2, "yoke", solid + Pos(0, 0, 300) * solid))
    assert [(p.place, p.expected) for p in problems] == [("yoke", "exactly one valid solid")]


def test_a_printer_that_is_too_small_is_found(aqua2):
    rig = replaced(aqua2.rig, "mount", printer_bed_mm=(155.0, 155.0, 155.0))
    problems = assembly_problems(replace(aqua2, rig=rig), grid_steps=2)
    assert [p.place for p in problems] == ["mount.printer_bed_mm"]
    assert problems[0].value.startswith("fold_bracket of 187 x 84 x 119 mm")


@pytest.mark.parametrize("key", ["fold_anchor_mm", "base_anchor_mm"])
def test_an_anchor_off_the_hull_is_found_with_the_nearest_point(aqua2, key):
    x, y, z = getattr(aqua2.rig.gaze.mount, key)
    rig = replaced(aqua2.rig, "mount", **{key: (x, y, z * 1.1)})
    (problem,) = assembly_problems(replace(aqua2, rig=rig), grid_steps=2)
    assert problem.place == f"mount.{key}"
    assert f"({x:.1f}, {y:.1f}, {z:.1f}), 6.5 mm away" in problem.expected


@pytest.fixture(scope="module")
def too_near(aqua2):
    """M2 strikes M1's bracket when it looks up and back."""
    return build_assembly(replaced(aqua2.rig, "gaze_mirror", distance_mm=80.0))


def test_a_gaze_mirror_that_strikes_the_fold_bracket_is_found(too_near):
    problems = assembly_problems(too_near)
    assert "fold_mirror and mirror_holder clear of each other" in [p.expected for p in problems]


def test_a_collision_within_the_joint_range_only_is_found(aqua2):
    """At rest the yoke is clear of a servo that has slid sideways; when it turns they intersect."""
    servo = aqua2.part("pan_servo").solid
    moved = with_part(aqua2, "pan_servo", Pos(65, 0, 60) * servo)
    poses = [p.value for p in assembly_problems(moved) if p.expected.startswith("pan_servo and tilt_servo")]
    assert len(poses) == 1
    assert "q1 = 0.0" not in poses[0]


def places_of_attachment(rig):
    """Keys that are wrong about where a rig's mount sits on its hull; the mount is not built."""
    gaze, layout = rig.require_gaze(), Layout.from_rig(rig)
    solid = hull_shape(gaze.hull, gaze.mount, rig.port, layout)
    hull = Part(name="hull", group=Group.FIXED, role=Role.HULL, make=lambda: solid).mesh
    return [found.problem.place for found in attachment_findings(rig, hull, layout) if found.problem]


def test_a_camera_behind_the_hulls_front_is_found(aqua2):
    rig = with_camera(aqua2.rig, position_mm=(280.0, 60.0, 0.0))
    rig = replaced(rig, "fold_mirror", distance_mm=117.0)
    assert places_of_attachment(rig) == ["camera.position_mm"]


def test_a_gap_smaller_than_the_clearance_is_found(aqua2):
    """M2 rises until its upper edge passes the lower edge of M1's cell by about a millimetre."""
    rig = replaced(aqua2.rig, "gaze_mirror", distance_mm=84.0)
    problems = assembly_problems(build_assembly(rig))
    assert {p.place for p in problems} == {"mount.clearance_mm"}
    assert any("between mirror_holder and fold_mirror" in p.expected for p in problems)


def test_a_bare_camera_inside_the_hull_is_found_and_one_in_front_of_it_is_not(aqua2):
    inside = aqua2.rig.model_copy(update={"port": NoPortSpec(shape="none")})
    assert places_of_attachment(inside) == ["camera.position_mm"]
    assert places_of_attachment(with_camera(inside, position_mm=(326.0, 60.0, 0.0))) == []


def test_every_check_of_the_presets_is_good(checked):
    assert [str(problem) for problem in checked.problems] == []
    assert checked.admissible is None
    assert {finding.check for finding in checked.findings} == {
        "one closed solid",
        "wall thickness",
        "fits the printer",
        "overhang as printed",
        "anchor on the hull",
        "view of the port",
        "axes through the centre of M2",
        "parts out of each other",
        "clearance over the joint range",
        "attachment holds",
        "screw access",
        "removal path",
    }


def test_every_check_says_which_joint_values_are_left(too_near, monkeypatch):
    """Tilts around rest stay free; paths to put it together are not looked for."""
    monkeypatch.setattr(admissible, "GRID_CELLS", 16)
    monkeypatch.setattr(checks, "assembly_steps", lambda assembly: [])
    checked = assembly_checks(too_near)
    assert any("fold_bracket intersect at" in str(problem) for problem in checked.problems)
    assert 0.3 < checked.admissible.fraction < 1
    low, high = checked.admissible.largest.q2_deg
    assert low <= 0 < high < too_near.rig.gaze.joints.tilt.max_deg


def test_without_closed_solids_nothing_else_is_looked_at(aqua2):
    solid = aqua2.part("yoke").solid
    checked = assembly_checks(with_part(aqua2, "yoke", solid + Pos(0, 0, 300) * solid))
    assert [problem.place for problem in checked.problems] == ["yoke"]
    assert {finding.check for finding in checked.findings} == {"one closed solid"}
