"""Triangles of single parts from the cache, so that of a rig that is a little different only a few parts are made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from pydantic import BaseModel
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.kernels.cache import load_or_make, result_key
from optics.mesh import PartMesh

MESH_VERSION = 9
"""Raised when a part of the same rig gets another shape or name: in `cad`, or by what of `optics` places it."""

KIND = "part mesh"


def part_key(name: str, *inputs: Any) -> str:
    """Key of a part's mesh: its name, all that its shape is made from, and the library that makes solids.

    `inputs` are numbers, words, arrays, poses, sections of a rig, and dataclasses and tuples of these.
    """
    return result_key(KIND, MESH_VERSION, name, _content(inputs), version("build123d"))


def kept_mesh(key: str, make: Callable[[], PartMesh], placed: Callable[[FloatArray, Any], PartMesh]) -> PartMesh:
    """Mesh of a part from the cache, or made and kept; `placed` gives a part's vertices and faces its name."""

    def pack(mesh: PartMesh) -> dict[str, Any]:
        return {"vertices_m": mesh.vertices_m, "faces": mesh.faces}

    def unpack(kept: dict[str, Any]) -> PartMesh:
        return placed(kept["vertices_m"], kept["faces"])

    return load_or_make(KIND, key, make, pack=pack, unpack=unpack, told=False)


def _content(value: Any) -> Any:
    """What a value holds, as `optics.kernels.cache.result_key` takes it."""
    if isinstance(value, BaseModel):
        return [type(value).__name__, value.model_dump(mode="json")]
    if isinstance(value, RigidTransform):
        return np.asarray(value.as_matrix())
    if is_dataclass(value):
        return [type(value).__name__, {each.name: _content(getattr(value, each.name)) for each in fields(value)}]
    if isinstance(value, (list, tuple)):
        return [_content(each) for each in value]
    return value
