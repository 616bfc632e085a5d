"""Plates: every printed part once, on the bed, upright as it is printed, apart from the others."""

from __future__ import annotations

import subprocess
import zipfile
from itertools import combinations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cad.checks.printing.slicer import FILAMENTS, NO_SLICER, PROFILE, named_profile, slicer_path
from cad.export.printing.plates import GAP_MM, Laid, print_plates, shelves
from optics.mesh import Group, PartMesh, Role
from rigs import Rig

ROUNDING_MM = 1e-6
BED_MM = (250.0, 210.0)
SIDES = st.floats(1, 200)


def cuboid(name: str, width_mm: float, depth_mm: float) -> Laid:
    box = trimesh.creation.box(extents=np.array([width_mm, depth_mm, 10.0]) / 1000)
    mesh = PartMesh(
        name=name, group=Group.FIXED, role=Role.MOUNT, vertices_m=np.array(box.vertices), faces=np.array(box.faces)
    )
    return Laid(mesh=mesh, size_mm=(width_mm, depth_mm))


@settings(max_examples=60)
@given(sizes=st.lists(st.tuples(SIDES, SIDES), min_size=1, max_size=12))
def test_boxes_lie_on_the_bed_and_apart(sizes):
    boxes = [cuboid(f"part{number}", *size) for number, size in enumerate(sizes)]
    plates = shelves(boxes, BED_MM)
    assert sorted(box.mesh.name for plate in plates for box in plate) == sorted(box.mesh.name for box in boxes)
    for plate in plates:
        for box in plate:
            assert min(box.corner_mm) >= 0
            assert box.corner_mm[0] + box.size_mm[0] <= BED_MM[0] + ROUNDING_MM
            assert box.corner_mm[1] + box.size_mm[1] <= BED_MM[1] + ROUNDING_MM
        for first, second in combinations(plate, 2):
            gaps = [
                max(a.corner_mm[k] - b.corner_mm[k] - b.size_mm[k] for a, b in ((first, second), (second, first)))
                for k in (0, 1)
            ]
            assert max(gaps) >= GAP_MM - ROUNDING_MM


def test_four_quarters_fill_one_plate():
    """Four boxes of 116 x 96 mm with 8 mm between them and 5 mm around them take 250 x 210 mm."""
    assert len(shelves([cuboid(f"part{number}", 116.0, 96.0) for number in range(4)], BED_MM)) == 1
    assert len(shelves([cuboid(f"part{number}", 117.0, 96.0) for number in range(4)], BED_MM)) == 2


def test_a_part_larger_than_the_bed_is_named():
    with pytest.raises(ValueError, match="expected room for part, which takes 251 x 10 mm"):
        shelves([cuboid("part", 251.0, 10.0)], BED_MM)


def test_a_preset_s_plates_hold_its_printed_parts_on_the_bed(built):
    rig, assembly, meshes = built.rig, built, built.meshes
    printed = [mesh for mesh in meshes if assembly.part(mesh.name).printed]
    plates = print_plates(rig, printed)
    assert sorted(mesh.name for plate in plates for mesh in plate) == sorted(mesh.name for mesh in printed)
    volumes = {mesh.name: trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False).volume for mesh in printed}
    for plate in plates:
        for mesh in plate:
            low, high = 1000 * mesh.vertices_m.min(axis=0), 1000 * mesh.vertices_m.max(axis=0)
            assert low[2] == pytest.approx(0, abs=ROUNDING_MM)
            assert (low >= -ROUNDING_MM).all()
            assert (high <= np.array(rig.gaze.mount.printer_bed_mm) + ROUNDING_MM).all()
            # Turned, not mirrored.
            surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
            assert surface.volume == pytest.approx(volumes[mesh.name])


def test_stl_and_3mf_of_a_plate_hold_the_same(exported):
    stl = trimesh.load_mesh(exported.folder / "print" / "plate_1.stl")
    scene = trimesh.load_scene(exported.folder / "print" / "plate_1.3mf")
    # Six decimals of a millimetre in one, single precision in the other.
    assert stl.bounds == pytest.approx(scene.bounds, abs=1e-4)
    assert stl.volume == pytest.approx(sum(mesh.volume for mesh in scene.geometry.values()), rel=1e-5)


def test_prusaslicer_takes_its_settings_from_a_plate(exported, tmp_path):
    """Whichever version reads it; without the program at least the file says what the profile beside it says."""
    plate, profile = (exported.folder / "print" / name for name in ("plate_1.3mf", "prusaslicer.ini"))
    with zipfile.ZipFile(plate) as archive:
        inside = archive.read("Metadata/Slic3r_PE.config").decode()
    assert [line.removeprefix("; ") for line in inside.splitlines()[2:]] == profile.read_text().splitlines()
    program = slicer_path()
    if program is None:
        pytest.skip(NO_SLICER)
    taken = tmp_path / "taken.ini"
    subprocess.run([program, "--save", taken, plate], check=True, capture_output=True, timeout=60)
    settings = dict(line.split(" = ", 1) for line in taken.read_text().splitlines() if " = " in line)
    mount = Rig.load("aqua2").gaze.mount
    assert settings["temperature"] == FILAMENTS[mount.material]["temperature"]
    assert settings["bed_shape"] == named_profile(mount)["bed_shape"]
    assert settings["fill_density"] == PROFILE["fill_density"]
