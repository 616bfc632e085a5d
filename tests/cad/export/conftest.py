from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from cad.assembly.assembly import Assembly
from cad.export.mount import export_mount


@dataclass(frozen=True, kw_only=True)
class Exported:
    """What was built from a rig, and its export."""

    assembly: Assembly
    folder: Path
    files: list[Path]
    progress: list[str]


@pytest.fixture(scope="session")
def exported(aqua2):
    """Export of aqua2 into a folder whose parent is new too."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "new" / "mount"
        progress: list[str] = []
        files = export_mount(aqua2, folder, log=progress.append)
        yield Exported(assembly=aqua2, folder=folder, files=files, progress=progress)
