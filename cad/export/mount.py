"""The whole export of a rig's mount, in one folder that appears at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from cad.assembly.assembly import Assembly
from cad.checks.printing.slicer import profile_ini
from cad.checks.sequence.steps import Step, assembly_steps
from cad.export.drawings.bill_of_materials import bill_of_materials, write_bill_of_materials
from cad.export.drawings.drawings import write_drawings
from cad.export.drawings.drill_template import write_drill_template
from cad.export.drawings.exploded import write_steps
from cad.export.drawings.manifest import rig_text, write_manifest
from cad.export.printing.plates import write_plates, write_upright
from cad.export.printing.prints import Prints, prints
from cad.export.printing.three_mf import PlacedMesh, write_3mf
from cad.export.robot.robot_files import write_robot
from cad.export.step import write_step
from cad.export.triangles import write_glb, write_stl
from rigs.atomic_files import atomic_files

FOLDERS = ("parts", "print", "drawings", "assembly", "robot")


AddFiles = Callable[[Path], object]
"""Writes further files into the folder it is given."""


def export_mount(
    assembly: Assembly,
    folder: Path,
    *,
    log: Callable[[str], None],
    steps: Sequence[Step] | None = None,
    printed: Prints | None = None,
    add_files: AddFiles = lambda folder: None,
) -> list[Path]:
    """Write everything that is needed to make, fit and simulate a rig's mount.

    Parameters
    ----------
    assembly : Assembly
        The rig's parts (`cad.assembly.assembly.build_assembly`).
    folder : Path
        Where to write; made when it is missing. Files of the same names are replaced, all at the end.
    log : callable
        Takes lines of progress.
    steps : sequence of Step, optional
        How it is put together, where the checks have found that (`cad.checks.assembly_checks.MountChecks.steps`); it
        takes seconds.
    printed : Prints, optional
        How parts are printed, for the bill of materials; estimated when it is not given.
    add_files : callable
        Writes what else belongs into the folder, such as reports, which this package knows nothing of.

    Returns
    -------
    list of Path
        The files, sorted, the manifest among them; `docs/reference/export.md` says what each is.
    """
    log("export: solids and meshes ...")
    rig = assembly.rig
    with atomic_files(folder) as partial:
        for part_of_it in FOLDERS:
            (partial / part_of_it).mkdir()
        (partial / "rig.toml").write_text(rig_text(rig), encoding="utf-8")
        for mesh in assembly.meshes:
            write_stl(mesh, partial / "parts")
        log("export: STEP, GLB, 3MF ...")
        write_step(assembly, partial / f"{rig.name}.step")
        write_glb(assembly, partial / f"{rig.name}.glb")
        write_3mf(_placed(assembly), partial / f"{rig.name}.3mf", title=rig.name)
        log("export: bill of materials, print plates ...")
        items = bill_of_materials(assembly, printed or prints(rig, assembly.printed, slicing=False))
        write_bill_of_materials(items, partial / "bom.csv")
        write_upright(rig, assembly.printed, partial / "print")
        write_plates(rig, assembly.printed, partial / "print")
        (partial / "print/prusaslicer.ini").write_text(profile_ini(rig.require_gaze().mount), encoding="utf-8")
        log("export: robot descriptions ...")
        write_robot(assembly, partial / "robot")
        log("export: drawings ...")
        write_drawings(assembly, items, partial / "drawings")
        write_drill_template(rig, partial / "drawings/drill_template.pdf")
        log("export: assembly steps ...")
        write_steps(assembly, assembly_steps(assembly) if steps is None else steps, partial / "assembly")
        add_files(partial)
        written = sorted(path for path in partial.rglob("*") if path.is_file())
        written = [*written, write_manifest(rig, partial, written)]
    return sorted(folder / path.relative_to(partial) for path in written)


def _placed(assembly: Assembly) -> list[PlacedMesh]:
    return [PlacedMesh(mesh=part.mesh, pose=assembly.pose(part, 0.0, 0.0)) for part in assembly.parts]
