"""Assembly steps put every part in its place once, on what is there already, along a path that is free.

What is wrong with an order or a part is named with its step: the orders in which the gimbal cannot be put together are
tried, and a plate before screws.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from build123d import Pos

from cad.assembly.assembly import build_assembly
from cad.checks.sequence import steps as order
from cad.checks.sequence.findings import check_steps, sequence_findings
from cad.checks.sequence.screw_keys import is_screw, screw_of
from cad.checks.sequence.steps import assembly_steps
from cad.shapes import box
from optics.mesh import Role
from rigs.mounting import StowJoint


def test_every_piece_has_a_way_in_and_every_screw_a_key(built_steps):
    assembly, found = built_steps
    assert [str(problem) for step in found for problem in step.problems] == []
    screws = sorted(part.name for part in assembly.parts if is_screw(part))
    assert sorted(drive.screw.name for step in found for drive in step.driven) == screws
    check_steps(found)


def test_every_part_finds_its_place_in_the_hull_s_frame(built_steps):
    """Small pieces come in once; subassemblies come in again as they are joined, and all end at the hull."""
    assembly, found = built_steps
    small = [part.name for part in assembly.parts if part.role is Role.HARDWARE]
    driven = [move.names[0] for step in found for move in step.moves if len(move.names) == 1]
    assert sorted(name for name in driven if name in small) == sorted(small)
    mount = {part.name for part in assembly.parts if part.role is not Role.HULL}
    last = [step for step in found if "hull" in step.present]
    assert {name for step in last for name in (*step.present, *step.added)} == mount | {"hull"}


def test_a_step_builds_on_what_was_done(built_steps):
    """What is present is printed, the hull, or was added before."""
    assembly, found = built_steps
    ready = {part.name for part in assembly.parts if part.printed or part.role is Role.HULL}
    for step in found:
        assert set(step.present) <= ready, step.title
        ready |= set(step.added)


def test_the_order_is_that_of_the_manual(built_steps):
    """Inserts and bushings first; tilt servo from outside after the holder, M2 last of the gimbal, then the hull."""
    assembly, found = built_steps
    brought = [step.part for step in found if not step.title.startswith("Press")]
    assert [step.title.startswith("Press") for step in found] == sorted(
        (step.title.startswith("Press") for step in found), reverse=True
    )
    gimbal = ["pan_horn", "yoke", "pan_servo", "tilt_horn", "mirror_holder", "tilt_servo", "gaze_mirror"]
    assert brought == ["fold_mirror", *gimbal, "fold_bracket", "gimbal_base"]
    by_part = {step.part: step for step in found}
    assert {"tilt_shaft_screw", "tilt_ear_1_screw"} <= set(by_part["tilt_servo"].added)
    assert "pan_shaft_screw" in by_part["pan_servo"].added
    assert {"pivot_sleeve", "pivot_washer", "pivot_screw"} <= set(by_part["mirror_holder"].added)
    if any(part.wraps for part in assembly.parts):
        # Bands go around both ends: nothing fastens the first one before the second is there.
        assert by_part["fold_bracket"].title == "Hold the fold bracket to the hull, for the bands of a later step"
        assert by_part["gimbal_base"].title.startswith(
            "Fasten the gimbal base and the fold bracket to the hull, with 2 x "
        )
    else:
        assert by_part["fold_bracket"].title.startswith("Fasten the fold bracket to the hull, with 4 x ")
    shift = by_part["tilt_servo"].moves[0].shift_m
    assert shift @ [0, 1, 0] == pytest.approx(np.linalg.norm(shift)), "the tilt servo comes from outside"


def reordered(monkeypatch, name, after):
    """The order of the gimbal with one part put in after another one."""
    pairs = [pair for pair in order.GIMBAL if pair[0] != name]
    at = 1 + next(number for number, pair in enumerate(pairs) if pair[0] == after)
    moved = next(pair for pair in order.GIMBAL if pair[0] == name)
    monkeypatch.setattr(order, "GIMBAL", (*pairs[:at], moved, *pairs[at:]))


def test_a_holder_does_not_go_over_the_shaft_of_a_servo_that_is_there(aqua2, monkeypatch):
    reordered(monkeypatch, "mirror_holder", "tilt_servo")
    wrong = {problem.place: str(problem) for step in assembly_steps(aqua2) for problem in step.problems}
    assert "mirror_holder" in wrong
    assert "tilt_servo" in wrong["mirror_holder"]


def test_the_shaft_s_screw_is_not_driven_through_m2(aqua2, monkeypatch):
    reordered(monkeypatch, "gaze_mirror", "tilt_horn")
    found = assembly_steps(aqua2)
    wrong = {problem.place: str(problem) for step in found for problem in step.problems}
    assert "gaze_mirror" in wrong["tilt_shaft_screw"]
    with pytest.raises(ValueError, match=r"step \d+, tilt_servo: tilt_shaft_screw"):
        check_steps(found)
    failed = [finding for finding in sequence_findings(found) if finding.problem]
    assert {finding.subject for finding in failed if finding.check == "screw access"} == {"tilt_shaft_screw"}


def test_a_screw_behind_a_plate_is_named_with_the_plate(aqua2):
    """A plate on the base itself, 8 mm under the screws of the pan servo's ears."""
    part = aqua2.part("gimbal_base")
    top = screw_of(aqua2.part("pan_ear_1_screw")).top_mm
    plate = Pos(0, 0, float(top[2])) * box((top[0] - 60, top[0] + 60), (top[1] - 60, top[1] + 60), (-10, -8))
    blocked = replace(part, make=lambda: part.solid + plate)
    parts = tuple(blocked if other is part else other for other in aqua2.parts)
    wrong = {p.place: str(p) for step in assembly_steps(replace(aqua2, parts=parts)) for p in step.problems}
    assert {"pan_ear_1_screw", "pan_ear_2_screw", "pan_servo"} <= wrong.keys()
    assert "key hits gimbal_base" in wrong["pan_ear_1_screw"]


@pytest.mark.parametrize("servo", [False, True])
def test_a_hinge_is_put_together_before_it_goes_to_the_hull(aqua2, servo):
    """With `joints.stow` an arm holds M1 and hangs in the bracket."""
    gaze = aqua2.rig.gaze
    joints = gaze.joints.model_copy(update={"stow": StowJoint(max_deg=90.0)})
    servos = gaze.servos.model_copy(update={"stow": gaze.servos.pan if servo else None})
    found = assembly_steps(build_assembly(aqua2.rig.with_gaze(joints=joints, servos=servos)))
    assert [str(problem) for step in found for problem in step.problems] == []
    brought = [step.part for step in found]
    assert brought.index("fold_mirror") < brought.index("fold_arm") < brought.index("fold_bracket", 5)


def test_pieces_are_drawn_out_of_their_places(built_steps):
    """All but bands, which are closed around the hull where they are."""
    assembly, found = built_steps
    for step in found:
        for move in step.moves:
            wrapped = all(assembly.part(name).wraps for name in move.names)
            assert wrapped or np.linalg.norm(move.shift_m) > 0.005, (step.title, move.names)
    # M2 cannot leave through its tray's floor: it moves along its face or out of it.
    gaze = next(move for step in found for move in step.moves if move.names == ("gaze_mirror",))
    normal = assembly.layout.body_from_m2(0.0, 0.0).rotation.as_matrix()[:, 2]
    assert gaze.shift_m @ normal > -1e-9
