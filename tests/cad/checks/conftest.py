from __future__ import annotations

import pytest

from cad.checks import kept_checks as module
from cad.checks.assembly_checks import MountChecks, assembly_checks


@pytest.fixture(scope="session")
def checked(built) -> MountChecks:
    """All checks of a preset but the slicer's, made once, and kept: tests of what is made of them need not wait."""
    checks = assembly_checks(built)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "assembly_checks", lambda *_, **__: checks)
        module.kept_checks(built)
    return checks
