from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import pytest

from cad.assembly.assembly import Assembly, build_assembly
from cad.assembly.tessellation import tessellate
from optics.mesh import PartMesh
from rigs import Rig

PRESETS = ("aqua2", "bluerov2")


@dataclass(frozen=True, kw_only=True)
class Built:
    """A rig with its solids and its meshes."""

    rig: Rig
    assembly: Assembly
    meshes: list[PartMesh]


@cache
def built_once(name: str) -> Built:
    rig = Rig.load(name)
    assembly = build_assembly(rig)
    return Built(rig=rig, assembly=assembly, meshes=tessellate(assembly))


@pytest.fixture(scope="session", params=PRESETS)
def built(request: pytest.FixtureRequest) -> Built:
    return built_once(request.param)


@pytest.fixture(scope="session")
def aqua2() -> Built:
    return built_once("aqua2")


@pytest.fixture(scope="session")
def built_preset() -> Callable[[str], Built]:
    """Any preset by name, built once."""
    return built_once
