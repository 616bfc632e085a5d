"""Checks of a mount that was in order when it was checked before: `new`, `check` and `design` ask them one by one."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic.main import IncEx

from cad.assembly.assembly import Assembly
from cad.assembly.meshes import mesh_key
from cad.checks.assembly_checks import Log, MountChecks, assembly_checks
from cad.finding import Finding, Sense
from optics.kernels.cache import load_or_make, result_key

KIND = "mount checks"
CHECKS_VERSION = 5
"""Raised when a check finds another figure for the same mount, another limit or other words."""
NOT_CHECKED: Mapping[str, IncEx | bool] = {
    "name": True,
    "requirements": True,
    "revision": True,
    "gaze": {"hull": {"file"}, "mount": {"printer"}},
}
"""What of a rig file is no number of a check; a hull's file counts by its triangles."""


class _NotGoodError(Exception):
    """Checks that are not kept: what is wrong is checked again."""

    def __init__(self, checks: MountChecks) -> None:
        super().__init__()
        self.checks = checks


def kept_checks(assembly: Assembly, *, log: Log = lambda line: None, until_problem: bool = False) -> MountChecks:
    """Checks as `assembly_checks` makes them, from the cache where the same mount passed all of them."""

    def make() -> MountChecks:
        checks = assembly_checks(assembly, log=log, until_problem=until_problem)
        if checks.problems or checks.admissible is not None:
            raise _NotGoodError(checks)
        return checks

    rig = assembly.rig
    numbers = rig.model_dump(mode="json", exclude=NOT_CHECKED)
    key = result_key(KIND, CHECKS_VERSION, mesh_key(rig), numbers)
    try:
        return load_or_make(KIND, key, make, pack=_packed, unpack=_unpacked)
    except _NotGoodError as found:
        return found.checks


def _packed(checks: MountChecks) -> dict[str, NDArray[Any]]:
    return {"findings": np.array([json.dumps(asdict(finding)) for finding in checks.findings])}


def _unpacked(stored: dict[str, NDArray[Any]]) -> MountChecks:
    rows = [json.loads(str(row)) for row in stored["findings"]]
    return MountChecks(findings=tuple(Finding(**{**row, "sense": Sense(row["sense"])}) for row in rows))
