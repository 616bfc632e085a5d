from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

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


@cache
def built_once(name: str) -> tuple[Rig, Assembly, list[PartMesh]]:
    rig = Rig.load(name)
    assembly = build_assembly(rig)
    return rig, assembly, tessellate(assembly)


@pytest.fixture(scope="session")
def exported():
    """Export of aqua2 into a folder whose parent is new too."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "new" / "mount"
        rig, assembly, meshes = built_once("aqua2")
        progress: list[str] = []
        files = export_mount(rig, folder, announce=progress.append)
        yield Exported(rig=rig, assembly=assembly, meshes=meshes, folder=folder, files=files, progress=progress)


@pytest.fixture(scope="session", params=["aqua2", "bluerov2"])
def built(request):
    """Rig, assembly and meshes of a preset."""
    return built_once(request.param)


@pytest.fixture(scope="session")
def aqua2():
    """Rig, assembly and meshes of aqua2."""
    return built_once("aqua2")
