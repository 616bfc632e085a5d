"""The whole export of a rig's mount, in one folder that appears at once."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from cad.assembly import build_assembly
from cad.export.manifest import rig_text, write_manifest
from cad.export.step import write_step
from cad.export.three_mf import PlacedMesh, write_3mf
from cad.export.triangles import write_glb, write_stl
from cad.tessellation import tessellate
from rigs import Rig


def export_mount(rig: Rig, folder: Path, *, announce: Callable[[str], None]) -> list[Path]:
    """Write everything that is needed to make, fit and simulate a rig's mount.

    Parameters
    ----------
    rig : Rig
        A rig with mirrors.
    folder : Path
        Where to write; made when it is missing. Files of the same names are replaced, all at the end.
    announce : callable
        Takes lines of progress.

    Returns
    -------
    list of Path
        The files, sorted, the manifest among them; `docs/export.md` says what each is.
    """
    announce("export: solids and meshes")
    assembly = build_assembly(rig)
    meshes = tessellate(assembly)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as scratch:
        partial = Path(scratch)
        (partial / "rig.toml").write_text(rig_text(rig), encoding="utf-8")
        (partial / "parts").mkdir()
        for mesh in meshes:
            write_stl(mesh, partial / "parts")
        announce("export: STEP, GLB, 3MF")
        write_step(assembly, partial / f"{rig.name}.step")
        write_glb(assembly, meshes, partial / f"{rig.name}.glb")
        placed = [
            PlacedMesh(mesh=mesh, pose=assembly.pose(part, 0.0, 0.0))
            for part, mesh in zip(assembly.parts, meshes, strict=True)
        ]
        write_3mf(placed, partial / f"{rig.name}.3mf", title=rig.name)
        written = sorted(path for path in partial.rglob("*") if path.is_file())
        written = [*written, write_manifest(rig, partial, written)]
        names = sorted(path.relative_to(partial) for path in written)
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (partial / name).replace(folder / name)
    return [folder / name for name in names]
