from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from cad.assembly.assembly import Assembly
from cad.export import export_mount
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


@pytest.fixture(scope="session")
def exported(aqua2):
    """Export of aqua2 into a folder whose parent is new too."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "new" / "mount"
        progress: list[str] = []
        files = export_mount(aqua2.rig, folder, log=progress.append)
        yield Exported(
            rig=aqua2.rig,
            assembly=aqua2.assembly,
            meshes=aqua2.meshes,
            folder=folder,
            files=files,
            progress=progress,
        )
