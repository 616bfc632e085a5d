"""The export of a mount that was checked: its files, and with them what the checks and the study of loads found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cad.assembly.assembly import Assembly, build_assembly
from cad.checks.assembly_checks import MountChecks
from cad.checks.kept_checks import kept_checks
from cad.export.mount import export_mount
from cad.export.printing.plate_slices import plate_findings
from cad.export.printing.prints import prints
from cad.loads.study import load_study
from reports.figures.check import write_checks
from reports.figures.load import write_loads
from reports.pages.mount import CHECKS_FOLDER, LOADS_FOLDER, CheckedMount
from reports.progress import Log
from rigs import Rig, RigError


def mount_checks(assembly: Assembly, *, log: Log, slicing: bool = True) -> MountChecks:
    """Make every check of a mount, and slice its print plates when all else is in order."""
    checks = kept_checks(assembly, log=lambda line: log(f"checks: {line}"))
    if checks.problems or not slicing:
        return checks
    log("checks: slicer ...")
    return replace(checks, findings=(*checks.findings, *plate_findings(assembly.rig, assembly.printed)))


def checked_mount(rig: Rig, *, log: Log, slicing: bool = True) -> CheckedMount:
    """Build a mount, check it, and study its loads.

    Parameters
    ----------
    rig : Rig
        A rig with mirrors.
    log : callable
        Takes lines of progress.
    slicing : bool
        Whether what a slicer says of the print plates is a check; it is asked for their times anyway, where there is
        one.

    Raises
    ------
    RigError
        When a check fails or a servo is too weak, with every problem.
    """
    log("export: building the mount ...")
    assembly = build_assembly(rig)
    checks = mount_checks(assembly, log=log, slicing=slicing)
    if checks.problems:
        raise RigError(rig.name, checks.problems)
    log("export: loads ...")
    loads = load_study(rig, assembly.meshes)
    if loads.problems:
        raise RigError(rig.name, loads.problems)
    log("export: print times ...")
    return CheckedMount(assembly=assembly, checks=checks, loads=loads, prints=prints(rig, assembly.printed))


def export_checked_mount(mount: CheckedMount, folder: Path, *, log: Log) -> list[Path]:
    """Export a mount with what checks and loads say of it: all files, sorted, the manifest included.

    Parameters
    ----------
    mount : CheckedMount
    folder : Path
        As for `cad.export.export_mount`; `checks` and `loads` are folders in it.
    log : callable
        Takes lines of progress.
    """

    def add_reports(partial: Path) -> None:
        log("export: figures of checks and loads ...")
        write_checks(mount.checks, mount.assembly.rig, partial / CHECKS_FOLDER)
        write_loads(mount.loads, partial / LOADS_FOLDER)

    return export_mount(
        mount.assembly, folder, log=log, steps=mount.checks.steps, printed=mount.prints, add_files=add_reports
    )
