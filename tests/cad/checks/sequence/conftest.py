from __future__ import annotations

import pytest

from cad.checks.sequence.steps import assembly_steps


@pytest.fixture(scope="session")
def built_steps(built):
    """A preset and the steps that put it together."""
    return built, assembly_steps(built)
