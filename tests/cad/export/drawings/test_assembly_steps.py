"""Assembly steps put every part in its place once, on what is there already, along a way that is free."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cad.assembly.assembly import build_assembly
from cad.export.drawings.assembly_steps import assembly_steps
from optics.mesh import Role
from rigs.mounting import StowJoint


@pytest.fixture(scope="module")
def steps(built):
    return built, assembly_steps(built)


def test_every_part_finds_its_place_in_the_hull_s_frame(steps):
    """Small pieces come in once; subassemblies come in again as they are joined, and all end at the hull."""
    assembly, found = steps
    small = [part.name for part in assembly.parts if part.role is Role.HARDWARE]
    driven = [move.names[0] for step in found for move in step.moves if len(move.names) == 1]
    assert sorted(name for name in driven if name in small) == sorted(small)
    mount = {part.name for part in assembly.parts if part.role is not Role.HULL}
    hull = next(part.name for part in assembly.parts if part.role is Role.HULL)
    last = [step for step in found if hull in step.present]
    assert {name for step in last for name in (*step.present, *step.added)} == mount | {hull}


def test_a_step_builds_on_what_was_done(steps):
    """What is present is printed, the hull, or was added before."""
    assembly, found = steps
    ready = {part.name for part in assembly.parts if part.printed or part.role is Role.HULL}
    for step in found:
        assert set(step.present) <= ready, step.title
        ready |= set(step.added)


def test_servos_mirrors_and_inserts_come_before_the_hull(steps):
    _, found = steps
    titles = [step.title for step in found]
    assert sum(title.startswith("Fasten") for title in titles) == 2
    assert all(title.startswith("Fasten") for title in titles[-2:])
    assert next(title for title in titles if "pan servo" in title).startswith("Fit the pan servo to the gimbal base")
    assert next(title for title in titles if "tilt servo" in title).startswith("Fit the tilt servo to the yoke")
    presses = [number for number, title in enumerate(titles) if title.startswith("Press")]
    assert presses == list(range(len(presses)))
    assert presses


def test_a_hinge_is_put_together_before_it_goes_to_the_hull(aqua2):
    """With `joints.stow` an arm holds M1 and hangs in the bracket."""
    rig = aqua2.rig
    joints = rig.gaze.joints.model_copy(update={"stow": StowJoint(max_deg=90.0)})
    assembly = build_assembly(rig.with_gaze(joints=joints))
    titles = [step.title for step in assembly_steps(assembly)]
    numbers = [
        next(number for number, title in enumerate(titles) if title.startswith(start))
        for start in (
            "Fit the fold mirror to the fold arm",
            "Join the fold arm to the fold bracket",
            "Fasten the fold bracket to the hull",
        )
    ]
    assert numbers == sorted(numbers)


def test_pieces_are_drawn_out_of_their_places(steps):
    assembly, found = steps
    for step in found:
        for move in step.moves:
            assert np.linalg.norm(move.shift_m) > 0.005, (step.title, move.names)
    # M2 cannot leave through its tray's floor: it moves along its face or out of it.
    gaze = next(move for step in found for move in step.moves if move.names == ("gaze_mirror",))
    normal = assembly.layout.body_from_m2(0.0, 0.0).rotation.as_matrix()[:, 2]
    assert gaze.shift_m @ normal > -1e-9


def test_each_step_has_its_image(exported):
    folder = exported.folder / "assembly"
    text = (folder / "steps.md").read_text(encoding="utf-8")
    images = re.findall(r"\]\((step_\d\d\.png)\)", text)
    assert images == sorted(path.name for path in folder.glob("*.png"))
    assert len(images) == len(re.findall(r"^\d+\. ", text, flags=re.MULTILINE))
