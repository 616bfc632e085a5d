"""A new rig with random numbers: it builds, or a sentence names the key to change."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
import tomlkit
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from cad.assembly.assembly import Assembly, build_assembly
from cad.checks.assembly_checks import assembly_problems
from cad.checks.printing.walls import wall_finding
from cad.overlaps import manifold_mm
from cad.parts.clearance_envelope import with_standing_base
from optics.mesh import Role
from rigs import Rig
from rigs.new_rig import create_rig_file

GRID_STEPS = 2
"""The ends of both joint ranges, where things come nearest; the check of clearance has tests of its own."""
SERVOS = st.sampled_from(["hs5086wp", "hs646wp"])
SMALL_SERVO = {
    "name": "9 g",
    "travel_deg": 120.0,
    "speed_deg_per_s": 400.0,
    "torque_n_m": 0.15,
    "size_mm": [22.8, 12.2, 22.5],
    "shaft_offset_mm": 5.5,
    "mass_g": 9.0,
    "deadband_us": 5.0,
    "pulse_us": [1000.0, 2000.0],
}
"""Commonly quoted numbers of the class; nominal."""


def millimetres(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: round(value, 1))


def mirror(nearest: float, furthest: float) -> st.SearchStrategy[dict]:
    return st.fixed_dictionaries(
        {
            "distance_mm": millimetres(nearest, furthest),
            "width_mm": millimetres(50, 130),
            "height_mm": millimetres(60, 140),
            "thickness_mm": st.sampled_from([1.5, 2.0, 3.0, 6.0]),
        }
    )


DRAWS = st.fixed_dictionaries(
    {
        "hull": st.sampled_from(["box", "open-frame", "torpedo"]),
        "fold_mirror": mirror(80, 160),
        "gaze_mirror": mirror(115, 220),
        "mount": st.fixed_dictionaries(
            {
                "wall_mm": millimetres(1.2, 12),
                "clearance_mm": millimetres(0.5, 6),
                "mirror_fixing": st.sampled_from(["glue", "screws"]),
            }
        ),
        "servos": st.fixed_dictionaries(
            {"pan": SERVOS | st.just(SMALL_SERVO), "tilt": SERVOS | st.just(SMALL_SERVO)}, optional={"stow": SERVOS}
        ),
        "stow": st.none() | millimetres(60, 120),
        "folds_up": st.booleans(),
    }
)


def begun(folder: Path, hull: str) -> tomlkit.TOMLDocument:
    """What `mirrorgaze new` writes for the shape of a hull."""
    file = folder / f"{hull}.toml"
    if not file.exists():
        create_rig_file("random", file, shape=hull)
    return tomlkit.parse(file.read_text(encoding="utf-8"))


def drawn_rig(folder: Path, draw: dict) -> Rig:
    """The new rig with the drawn numbers in its file."""
    document = begun(folder, draw["hull"])
    for section in ("fold_mirror", "gaze_mirror", "mount", "servos"):
        document[section].update(draw[section])
    if draw["stow"] is not None:
        document["joints"]["stow"] = {"max_deg": draw["stow"]}
    else:
        document["servos"].pop("stow", None)
    if draw["folds_up"] and draw["hull"] == "box":
        # A box is as high as it is low: the same mount over it instead of under it.
        document["fold_mirror"]["direction"] = "up"
        for anchor in ("fold_anchor_mm", "base_anchor_mm"):
            document["mount"][anchor][2] = -document["mount"][anchor][2]
        for joint in ("pan", "tilt"):
            limits = document["joints"][joint]
            limits["min_deg"], limits["max_deg"] = -limits["max_deg"], -limits["min_deg"]
    return Rig.parse(tomlkit.dumps(document), source="random rig", folder=folder)


def is_rig_key(place: str) -> bool:
    """Whether a place is a key or a section of the rig file."""
    here = tomllib.loads(tomlkit.dumps(tomlkit.item(Rig.load("aqua2").model_dump(mode="json", exclude_none=True))))
    name, *rest = place.partition("[")[0].split(".")
    if name not in here:
        return False
    optional = {"joints.stow", "servos.stow"}
    return not rest or rest[0] in here[name] or ".".join([name, rest[0]]) in optional


def key_of(message: str) -> str:
    """What a message begins with, up to the value or the colon."""
    return message.split(":", maxsplit=1)[0].split(" = ", maxsplit=1)[0].split(",", maxsplit=1)[0]


def check_solids(assembly: Assembly) -> None:
    for part in assembly.parts:
        assert part.solid.is_valid, part.name
        assert len(part.solid.solids()) == 1, part.name
        # Empty when the surface is not closed.
        assert manifold_mm(part.mesh).volume() == pytest.approx(part.solid.volume, rel=0.02), part.name


@pytest.mark.slow
@settings(
    max_examples=3,
    phases=[Phase.explicit, Phase.reuse, Phase.generate],  # an example takes seconds: too long to shrink it
)
@given(draw=DRAWS)
def test_a_new_rig_with_random_numbers_is_made_or_its_key_is_named(tmp_path_factory, draw):
    """Rationale: a user changes numbers of the file that `mirrorgaze new` wrote.

    Expectation: one valid solid with a closed surface for each part, and problems that name keys; or a ValueError that
    begins with a key. Volumes of the triangles agree to 2 %, the chords
    of the smallest screws' cylinders.
    """
    rig = drawn_rig(tmp_path_factory.getbasetemp(), draw)
    try:
        rig = with_standing_base(rig)
        assembly = build_assembly(rig)
    except ValueError as error:
        assert is_rig_key(key_of(str(error))), error
        return
    check_solids(assembly)
    problems = assembly_problems(assembly, grid_steps=GRID_STEPS)
    assert [str(problem) for problem in problems if not is_rig_key(problem.place)] == []


def changed(camera: dict | None = None, **tables: dict) -> Rig:
    rig = Rig.load("aqua2")
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=camera)}).with_gaze(**tables)


def servo(**numbers: object):
    return Rig.load("aqua2").gaze.servos.pan.model_copy(update=numbers)


@pytest.mark.parametrize(
    ("rig", "key"),
    [
        (changed(mount={"base_anchor_mm": (270.0, 60.0, -400.0)}), "mount.base_anchor_mm"),
        (changed(gaze_mirror={"thickness_mm": 10.0}), "gaze_mirror.thickness_mm"),
        (changed(gaze_mirror={"height_mm": 12.0}), "gaze_mirror.height_mm"),
        (changed(fold_mirror={"width_mm": 15.0}), "fold_mirror.width_mm"),
        (changed(fold_mirror={"height_mm": 600.0}), "mount.fold_anchor_mm"),
        (changed(servos={"tilt": servo(shaft_offset_mm=14.0)}), "servos.tilt.shaft_offset_mm"),
        (changed(servos={"pan": servo(size_mm=(31.0, 15.0, 8.0))}), "servos.pan.size_mm"),
        (changed(servos={"pan": servo(size_mm=(31.0, 4.0, 20.0))}), "servos.pan.size_mm"),
    ],
)
def test_numbers_that_make_no_mount_are_refused_by_their_key(rig, key):
    with pytest.raises(ValueError, match=rf"^{key}.*expected"):
        build_assembly(rig)


@pytest.mark.parametrize(
    ("rig", "key"),
    [
        (changed(gaze_mirror={"width_mm": 400.0, "distance_mm": 200.0}), "mount.printer_bed_mm"),
        (changed(mount={"base_anchor_mm": (270.0, 60.0, -85.0)}), "mount.base_anchor_mm"),
        (changed(mount={"fold_anchor_mm": (270.0, 60.0, 85.0)}), "mount.fold_anchor_mm"),
        (changed(fold_mirror={"distance_mm": 45.0}), "fold_mirror.distance_mm"),  # its bracket in the hull
    ],
)
def test_a_mount_that_cannot_be_used_is_reported_by_its_key(rig, key):
    rig = with_standing_base(rig)
    problems = assembly_problems(build_assembly(rig), grid_steps=3)
    assert key in {problem.place for problem in problems}


def test_a_wall_too_thin_for_the_nozzle_is_reported_by_its_key():
    rig = changed(mount={"wall_mm": 1.2, "nozzle_mm": 1.0})
    meshes = [mesh for mesh in build_assembly(rig).meshes if mesh.role is Role.MOUNT]
    problems = [wall_finding(mesh, rig.gaze.mount).problem for mesh in meshes]
    assert "mount.nozzle_mm" in {problem.place for problem in problems if problem is not None}
