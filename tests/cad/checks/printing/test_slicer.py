"""What the slicer says, read from words it has printed; the slicer itself is asked where there is one."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad.checks.printing.slicer import (
    NO_SLICER,
    PROGRAM,
    SLICE_VERSION,
    read_slice,
    slice_finding,
    slice_stl,
    slicer_path,
)
from cad.finding import Verdict
from rigs import Mount

MOUNT = Mount(fold_anchor_mm=(0, 0, 0), base_anchor_mm=(0, 0, 0))
SAID = """[2026-01-01 12:00:00.000000] [0x00007f4f2fd7ad80] [trace]   Initializing StaticPrintConfigs
10 => Processing triangulated mesh
print warning: Empty layer between 30.05 and 37.85.

Object name: float.stl

Make sure the object is printable. This is usually caused by negligibly small extrusions or by a faulty model.
90 => Exporting G-code to float.gcode
Slicing result exported to float.gcode
"""
"""Printed by PrusaSlicer 2.5.0 for a table with a cube that floats above it."""
GCODE = """;TYPE:Support material
G1 X1
;TYPE:External perimeter
;TYPE:Support material
; filament used [mm] = 47007.93
; filament used [g] = 117.59
; total filament used [g] = 117.59
; estimated printing time (normal mode) = 1d 11h 13m 30s
"""


def test_time_plastic_supports_and_warnings_are_read():
    found = read_slice(SAID, GCODE)
    assert found.time_s == 86400 + 11 * 3600 + 13 * 60 + 30
    assert found.mass_g == 117.59
    assert found.support_layers == 2
    (warning,) = found.warnings
    assert warning.startswith("Empty layer between 30.05 and 37.85. Object name: float.stl Make sure")
    assert "Exporting" not in warning


def test_kept_slices_are_what_would_be_read_today(check_recorded):
    found = read_slice(SAID, GCODE)
    numbers = np.array([found.time_s, found.mass_g, found.support_layers])
    check_recorded("slice", SLICE_VERSION, rel=1e-9, numbers=numbers, warnings=np.array(found.warnings))


def test_a_file_without_figures_is_refused():
    with pytest.raises(OSError, match="expected printing time and plastic"):
        read_slice(SAID, "G1 X1")


def test_without_a_slicer_the_check_says_so(monkeypatch, aqua2):
    monkeypatch.setenv("PATH", "")
    mesh = next(mesh for mesh in aqua2.meshes if mesh.name == "yoke")
    finding = slice_finding(mesh, MOUNT)
    assert finding.verdict is Verdict.NOT_RUN
    assert finding.note == NO_SLICER


def test_a_slice_comes_from_the_cache_the_next_time(monkeypatch, tmp_path):
    """A stand-in for the slicer that writes a stored file and counts its calls; then the real one, if any."""
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "cache"))
    program, calls = tmp_path / PROGRAM, tmp_path / "calls"
    stored = tmp_path / "stored.gcode"
    stored.write_text(GCODE)
    program.write_text(
        f'#!/bin/sh\ncase "$1" in --help) echo "PrusaSlicer-0"; exit;; esac\necho x >> {calls}\n'
        f'while [ "$1" != "--output" ]; do shift; done\ncp {stored} "$2"\n'
    )
    program.chmod(0o755)
    cube = trimesh.creation.box(bounds=[(0, 0, 0), (20, 20, 20)]).export(file_type="stl")
    first = slice_stl(str(program), cube, MOUNT)
    assert slice_stl(str(program), cube, MOUNT) == first
    assert calls.read_text() == "x\n"
    other = slice_stl(str(program), cube, MOUNT.model_copy(update={"nozzle_mm": 0.6}))
    assert (other, calls.read_text()) == (first, "x\nx\n")
    real = slicer_path()
    if real is not None:
        found = slice_stl(real, cube, MOUNT)
        # 8 cm³ at 1.04 g/cm³, of which a shell of about 1 mm and 30 % of the rest are printed.
        assert 2 < found.mass_g < 8.3
        assert found.support_layers == 0
        assert found.warnings == ()


def test_a_slicer_that_gives_up_says_why(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "cache"))
    program = tmp_path / PROGRAM
    program.write_text("#!/bin/sh\necho 'Outside of the print volume' >&2\nexit 1\n")
    program.chmod(0o755)
    with pytest.raises(OSError, match="prusa-slicer gave up: Outside of the print volume"):
        slice_stl(str(program), b"", MOUNT)
