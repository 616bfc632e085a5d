"""How the flanges of a rig lie on a hull from a file, and whether its camera has room."""

from __future__ import annotations

from pathlib import Path

import manifold3d
import numpy as np
import pytest
import trimesh

from cad.checks.attachment import BEDDING_CHECK, attachment_findings, housing_findings
from cad.hulls.camera_housing import port_ahead_mm
from cad.hulls.hull import closed_surface, file_hull_solid
from optics.layout import Layout, camera_pose
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


def cube(side_mm: float, middle_m: np.ndarray, group: Group) -> PartMesh:
    """A screw, as far as the check knows."""
    mesh = trimesh.creation.box(extents=[side_mm / 1000] * 3).apply_translation(middle_m)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32)
    return PartMesh(name="base_flange_screw_1", group=group, role=Role.HARDWARE, vertices_m=vertices, faces=faces)


@pytest.mark.parametrize(
    ("beside_mm", "group", "shared"), [(0, Group.FIXED, 216), (0, Group.TILT, None), (40, Group.FIXED, 0)]
)
def test_a_fixed_part_in_the_camera_is_found(
    tmp_path: Path, beside_mm: float, group: Group, shared: float | None
) -> None:
    """A cube of 6 mm, 30 mm behind the port's face on the camera's view, or beside it; what turns is left out."""
    hull = FileHull(shape="file", file=tmp_path / "none.stl", unit="mm", window="cut")
    rig = Rig.load("aqua2").with_gaze(hull=hull)
    ahead = (port_ahead_mm(rig) - 30.0) / 1000
    screw = cube(6.0, camera_pose(rig.camera).apply([beside_mm / 1000, 0.0, ahead]), group)
    harmless = cube(6.0, np.array([0.0, 0.0, -5.0]), Group.FIXED)
    (finding,) = housing_findings(rig, [harmless, screw])
    assert finding.figure == pytest.approx(shared or 0, abs=1e-6)
    assert (finding.problem is not None) == bool(shared)
    if finding.problem is not None:
        assert str(finding.problem).startswith("mount.base_anchor_mm = '216 mm³ of base_flange_screw_1 in the camera'")
    assert housing_findings(Rig.load("aqua2"), [screw]) == []
