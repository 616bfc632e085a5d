"""Checks of single parts: closed solids, wall thickness, axes, screws and keys."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from build123d import Pos, Rot

from cad.assembly.assembly import Part
from cad.checks.clearance.axes import AXIS_TOLERANCE_MM, axis_findings, face_of_mirror
from cad.checks.printing.walls import wall_finding, wall_thickness
from cad.checks.solidity import solidity
from cad.finding import Finding, Verdict
from cad.shapes import box
from optics.mesh import Group, PartMesh, Role
from rigs import Mount

MOUNT = Mount(fold_anchor_mm=(0, 0, 0), base_anchor_mm=(0, 0, 0))


def mesh_of(surface, name="part"):
    return PartMesh(
        name=name,
        group=Group.FIXED,
        role=Role.MOUNT,
        vertices_m=np.asarray(surface.vertices) / 1000,
        faces=np.asarray(surface.faces, dtype=np.int32),
    )


def replaced(built, name, solid):
    parts = tuple(replace(part, make=lambda: solid) if part.name == name else part for part in built.parts)
    return replace(built, parts=parts)


def test_a_box_has_the_same_volume_three_times_and_a_shifted_face_does_not():
    """Flat faces have no chord error: nothing but rounding is left to the mesh."""
    part = Part(
        name="part", group=Group.FIXED, role=Role.MOUNT, make=lambda: box((0, 40), (0, 30), (0, 20)).solids()[0]
    )
    surface = trimesh.creation.box(bounds=[(0, 0, 0), (40, 30, 20)])
    finding = solidity(part, mesh_of(surface))
    assert finding.verdict is Verdict.PASSED
    assert finding.figure < 1e-8
    surface.vertices[:, 2] *= 1 + 1e-6
    assert "to within 0 mm³" in str(solidity(part, mesh_of(surface)).problem)


def test_an_open_surface_is_a_problem(aqua2):
    surface = trimesh.creation.box(extents=(10, 10, 10))
    surface.update_faces(np.arange(12) > 0)
    finding = solidity(aqua2.part("yoke"), mesh_of(surface, "yoke"))
    assert (finding.problem.place, finding.problem.value) == ("yoke", "open surface")


@pytest.mark.parametrize("wall", [0.6, 1.0, 3.0])
def test_the_walls_of_a_tube_are_as_thick_as_its_radii_say(wall):
    """Closed form: 20 mm outside; chords of 256 segments take 20 (1 - cos(pi/256)) = 0.0015 mm at most."""
    tube = trimesh.creation.annulus(r_min=20 - wall, r_max=20, height=80, sections=256)
    thickness, _ = wall_thickness(mesh_of(tube)).thinnest
    assert thickness == pytest.approx(wall, abs=0.002)
    finding = wall_finding(mesh_of(tube), MOUNT)
    assert (finding.problem is not None) == (wall < 2 * MOUNT.nozzle_mm)


def test_the_thinnest_wall_is_named_with_its_place():
    """A block with a fin of 0.5 mm at x = 30."""
    fin = trimesh.creation.box(bounds=[(29.75, 0, 9.9), (30.25, 40, 40)])
    block = trimesh.creation.box(bounds=[(0, 0, 0), (40, 40, 10)])
    finding = wall_finding(mesh_of(trimesh.boolean.union([block, fin])), MOUNT)
    assert finding.figure == pytest.approx(0.5, abs=1e-6)
    assert "at (29." in finding.place or "at (30." in finding.place
    assert finding.problem.place == "mount.nozzle_mm"


def test_the_same_seed_gives_the_same_figures(aqua2):
    mesh = next(mesh for mesh in aqua2.meshes if mesh.name == "yoke")
    assert wall_finding(mesh, MOUNT) == wall_finding(mesh, MOUNT)


def test_both_axes_go_through_the_centre_of_the_mirrors_face(built):
    findings = axis_findings(built)
    assert len(findings) == 6
    assert all(finding.figure < AXIS_TOLERANCE_MM for finding in findings)
    centre, normal = face_of_mirror(built.part("gaze_mirror"))
    assert centre == pytest.approx(np.zeros(3), abs=AXIS_TOLERANCE_MM)
    assert normal == pytest.approx([0, 0, 1], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "pose", "wrong"),
    [
        ("pan_horn", Pos(0, 1e-4, 0), {"pan axis of pan_horn"}),
        ("gaze_mirror", Pos(0, 0, 1e-4), {"tilt axis of tilt_horn", "plane of M2"}),
        ("tilt_horn", Rot(0, 1e-3, 0), {"plane of M2"}),
    ],
)
def test_a_tenth_of_a_micrometre_off_the_axes_is_found(aqua2, name, pose, wrong):
    """A mirror or a horn that is moved by 0.1 micrometre, or turned by a thousandth of a degree."""
    moved = replaced(aqua2, name, pose * aqua2.part(name).solid)
    assert {finding.subject for finding in axis_findings(moved) if finding.problem} >= wrong


def test_a_finding_says_its_verdict_and_reads_as_a_line():
    finding = Finding(check="wall thickness", subject="yoke", figure=1.2, unit="mm", limit=0.8, place="at (0, 0, 0)")
    assert finding.verdict is Verdict.PASSED
    assert str(finding) == "wall thickness: yoke 1.2 mm (at least 0.8); at (0, 0, 0)"
    assert replace(finding, ran=False).verdict is Verdict.NOT_RUN
