"""How the flanges of a rig lie on a hull from a file."""

from __future__ import annotations

from pathlib import Path

import manifold3d
import numpy as np
import trimesh

from cad.checks.attachment import BEDDING_CHECK, attachment_findings
from cad.hulls.hull import closed_surface, file_hull_solid
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import FileHull, Rig


def grooved(file: Path, depth_mm: float) -> Path:
    """aqua2's body with grooves across its top, 10 mm wide, of a given depth."""
    body = manifold3d.Manifold.cube((650.0, 261.0, 130.0), True)
    groove = manifold3d.Manifold.cube((10.0, 400.0, 2 * depth_mm), True)
    for x in np.arange(-300.0, 320.0, 20.0):
        body -= groove.translate((float(x), 0.0, 65.0))
    mesh = body.to_mesh64()
    trimesh.Trimesh(mesh.vert_properties, mesh.tri_verts, process=False).export(file)
    return file


def test_steps_under_a_flange_need_a_bed(tmp_path: Path) -> None:
    hull = FileHull(shape="file", file=grooved(tmp_path / "hull.stl", 1.0), unit="mm", window="cut")
    rig = Rig.load("aqua2").with_gaze(hull=hull)
    solid = closed_surface(file_hull_solid(hull))
    mesh = PartMesh(
        name="hull",
        group=Group.FIXED,
        role=Role.HULL,
        vertices_m=np.asarray(solid.vertices) / 1000,
        faces=np.asarray(solid.faces, dtype=np.int32),
    )
    findings = attachment_findings(rig, mesh, Layout.from_rig(rig))
    fold, base = [finding for finding in findings if finding.check == BEDDING_CHECK]
    # A smooth patch through the middle of the steps leaves half of them on either side; towards its ends it bends.
    assert 1.0 < fold.figure < 1.5
    assert "epoxy" in fold.note
    assert base.figure == 0.0
    assert fold.problem is None
