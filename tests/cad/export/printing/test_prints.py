"""Hours and plastic of prints: from the slicer where it is, from shapes where not; the profile that both are for."""

from __future__ import annotations

import subprocess

import pytest

from cad.assembly.print_pose import print_pose
from cad.checks.printing import slicer
from cad.checks.printing.print_estimate import HOURS_WITHIN, PLASTIC_WITHIN, estimated_slice
from cad.checks.printing.slicer import PROGRAM, Slice, profile, profile_ini, slice_stl, slicer_path
from cad.export.printing import prints as module
from cad.export.printing.plates import plate_stl, print_plates
from cad.export.printing.prints import prints
from rigs import Rig

ROUNDING_S = 2.0
"""It tells whole seconds, of sums in another order where settings come in another."""

PRUSASLICER_OF_AQUA2 = {
    "fold_bracket": (5.79, 59.8),
    "gimbal_base": (12.55, 149.9),
    "yoke": (5.63, 60.7),
    "mirror_holder": (4.57, 41.4),
}
"""Hours and grams that PrusaSlicer 2.5.0 says of each part alone."""


def test_estimates_are_as_good_as_they_say(aqua2):
    mount = aqua2.rig.gaze.mount
    for mesh in aqua2.printed:
        found = estimated_slice(mesh, print_pose(mesh, mount), mount)
        hours, plastic_g = PRUSASLICER_OF_AQUA2[mesh.name]
        assert found.time_s / 3600 == pytest.approx(hours, rel=HOURS_WITHIN)
        assert found.mass_g == pytest.approx(plastic_g, rel=PLASTIC_WITHIN)


def test_parts_share_what_the_slicer_says_of_their_plate(aqua2, monkeypatch):
    monkeypatch.setattr(module, "slicer_path", lambda: PROGRAM)
    said = Slice(time_s=36_000.0, mass_g=100.0, support_layers=0, warnings=("Empty layer.",))
    monkeypatch.setattr(module, "slice_stl", lambda *_: said)
    found = prints(aqua2.rig, aqua2.printed)
    assert found.sliced
    assert found.time_s == pytest.approx(36_000.0 * len(found.plates))
    assert found.plastic_g == pytest.approx(100.0 * len(found.plates))
    assert sum(part.time_s for part in found.parts) == pytest.approx(found.time_s)
    assert sum(part.plastic_g for part in found.parts) == pytest.approx(found.plastic_g)
    assert {part.name: part.plate for part in found.parts} == {
        name: number for number, plate in enumerate(found.plates, 1) for name in plate.parts
    }
    assert all(plate.warnings == ("Empty layer.",) for plate in found.plates)
    assert not prints(aqua2.rig, aqua2.printed, slicing=False).sliced


def test_the_profile_has_printer_and_material_of_the_rig():
    mount = (
        Rig.load("aqua2").with_gaze(mount={"printer": "My printer", "nozzle_mm": 0.6, "material": "petg"}).gaze.mount
    )
    lines = profile_ini(mount).splitlines()
    assert "printer_settings_id = My printer" in lines
    assert "nozzle_diameter = 0.6" in lines
    assert "bed_shape = 0x0,250x0,250x210,0x210" in lines
    assert "filament_type = PETG" in lines
    assert "temperature = 240" in lines
    assert "perimeters = 3" in lines
    assert [line for line in lines if line.count(" = ") != 1] == []


@pytest.mark.skipif(slicer_path() is None, reason=f"no {PROGRAM} on the PATH")
def test_the_slicer_takes_the_profile_and_says_what_it_says_of_our_settings(aqua2, tmp_path, monkeypatch):
    """The smallest part: its time from the exported file is that of our own slices, and every key is known."""
    monkeypatch.setattr(slicer, "load_or_make", lambda kind, key, make, pack, unpack: make())
    mount = aqua2.rig.gaze.mount
    (plate,) = print_plates(aqua2.rig, [mesh for mesh in aqua2.printed if mesh.name == "mirror_holder"])
    (tmp_path / "part.stl").write_bytes(plate_stl(plate))
    (tmp_path / "prusaslicer.ini").write_text(profile_ini(mount), encoding="utf-8")
    size = ",".join(f"{side / 2:g}" for side in mount.printer_bed_mm[:2])
    arguments = [slicer_path(), "--export-gcode", "--load", "prusaslicer.ini", "--center", size, "part.stl"]
    done = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True, check=True)
    gcode = (tmp_path / "part.gcode").read_text(errors="replace")
    found, ours = slicer.read_slice(done.stdout + done.stderr, gcode), slice_stl(arguments[0], plate_stl(plate), mount)
    assert found.mass_g == ours.mass_g
    assert found.time_s == pytest.approx(ours.time_s, abs=ROUNDING_S)
    used = dict(line[2:].split(" = ", 1) for line in gcode.splitlines() if line.startswith("; ") and " = " in line)
    assert {key: used[key] for key in profile(mount)} == profile(mount)
