from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from cad.assembly import Assembly, build_assembly
from cad.export import export_mount
from cad.tessellation import tessellate
from optics.mesh import PartMesh
from rigs import Rig


@dataclass(frozen=True, kw_only=True)
class Exported:
    """A rig, what was built from it, and its export."""

    rig: Rig
    assembly: Assembly
    meshes: list[PartMesh]
    folder: Path
    files: list[Path]
    progress: list[str]


@pytest.fixture(scope="session", params=["aqua2", "bluerov2"])
def exported(request, tmp_path_factory) -> Exported:
    """Export of a preset into a folder whose parent is new too."""
    folder = tmp_path_factory.mktemp(request.param) / "new" / "mount"
    return exported_once(request.param, folder)


def exported_once(name: str, folder: Path) -> Exported:
    rig = Rig.load(name)
    progress: list[str] = []
    files = export_mount(rig, folder, announce=progress.append)
    assembly = build_assembly(rig)
    meshes = tessellate(assembly)
    return Exported(rig=rig, assembly=assembly, meshes=meshes, folder=folder, files=files, progress=progress)
