from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from cad.assembly.assembly import Assembly, build_assembly
from rigs import Rig

PRESETS = ("aqua2", "bluerov2")


@cache
def built_once(name: str) -> Assembly:
    return build_assembly(Rig.load(name))


@pytest.fixture(scope="session", params=PRESETS)
def built(request: pytest.FixtureRequest) -> Assembly:
    return built_once(request.param)


@pytest.fixture(scope="session")
def aqua2() -> Assembly:
    return built_once("aqua2")


@pytest.fixture(scope="session")
def built_preset() -> Callable[[str], Assembly]:
    """Any preset by name, built once."""
    return built_once


@pytest.fixture(scope="session")
def split() -> Assembly:
    """bluerov2 from a printer of 180 mm, which makes its fold bracket of 207 mm in halves."""
    return build_assembly(Rig.load("bluerov2").with_gaze(mount={"printer_bed_mm": (180.0, 180.0, 180.0)}))
