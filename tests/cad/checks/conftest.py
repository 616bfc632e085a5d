from __future__ import annotations

import pytest

from cad.checks.assembly_checks import MountChecks, assembly_checks


@pytest.fixture(scope="session")
def checked(built) -> MountChecks:
    """All checks of a preset but the slicer's, made once."""
    return assembly_checks(built)
