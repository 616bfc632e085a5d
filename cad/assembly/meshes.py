"""Meshes of a rig from a cache addressed by content, so that building solids is paid for once.

The modelling kernel takes seconds to import; it is imported only when the cache has no answer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic.main import IncEx

from cad.assembly.building_process import building, built
from cad.assembly.part_meshes import MESH_VERSION
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.cache_contents import entry_path
from optics.layout import check_stows
from optics.mesh import Group, PartMesh, Role
from rigs import Rig

KIND = "rig meshes"

SERVO_WITHOUT_SHAPE: IncEx = {
    "name",
    "speed_deg_per_s",
    "torque_n_m",
    "mass_g",
    "travel_deg",
    "deadband_us",
    "pulse_us",
    "pulse_period_ms",
    "latency_ms",
    "backlash_deg",
    "jitter_us",
    "depth_rating_m",
}
WITHOUT_SHAPE: Mapping[str, IncEx | bool] = {
    "name": True,
    "description": True,
    "revision": True,
    "water": True,
    "vehicle": True,
    "requirements": True,
    "gaze": {
        "servos": dict.fromkeys(("pan", "tilt", "stow"), SERVO_WITHOUT_SHAPE),
        "hull": {"file"},
        "mount": {"colour", "mirror_coating", "printer"},
    },
}
"""What of a rig file does not change the shape of any part; a hull's file counts by what is in it."""


def rig_meshes(rig: Rig, *, stowed: bool = False) -> list[PartMesh]:
    """What rays hit of a rig: its parts in metres, each in the frame of its group; from the cache when it can be.

    All are closed surfaces but the hull from a file, which may be open (`cad.assembly.hull_surface` gives its solid).
    With `stowed` the fold mirror and what holds it are where the hinge of `joints.stow` swings them.

    Raises
    ------
    ValueError
        For a rig without mirrors, or one whose numbers make no mount; when a fold mirror that is fixed is to be stowed.
    """
    colour = rig.require_gaze().mount.colour
    if stowed:
        check_stows(rig)
    key = mesh_key(rig, stowed=stowed)
    meshes = load_or_make(KIND, key, lambda: built(key) or _built(rig, stowed=stowed), pack=_packed, unpack=_unpacked)
    return [replace(mesh, colour=colour) if mesh.role is Role.MOUNT else mesh for mesh in meshes]


@contextmanager
def meshes_beside(rig: Rig, *, stowed: bool = False) -> Iterator[None]:
    """Let another process make what `rig_meshes` will be asked for, where it is not in the cache.

    A rig that has no meshes, or whose numbers or hull's file make none, is told when they are asked for.
    """
    key = None if rig.gaze is None else mesh_key(rig, stowed=stowed)
    if key is None or entry_path(KIND, key).exists():
        yield
        return
    # Both processes will need it: before one is copied from the other, it is loaded once.
    import trimesh  # noqa: F401, PLC0415

    with building(key, lambda: _built(rig, stowed=stowed)):
        yield


def mesh_key(rig: Rig, *, stowed: bool = False) -> str:
    """Key of a rig's meshes: the numbers that shape them, the hull's file, and the library that makes solids."""
    numbers = rig.model_dump(mode="json", exclude=WITHOUT_SHAPE)
    return result_key(KIND, MESH_VERSION, numbers, _hull_key(rig), stowed, version("build123d"))


def _packed(meshes: Sequence[PartMesh]) -> dict[str, NDArray[Any]]:
    """Meshes as named arrays."""
    labels = np.array([(mesh.name, mesh.group.value, mesh.role.value) for mesh in meshes])
    arrays: dict[str, NDArray[Any]] = {"labels": labels}
    for position, mesh in enumerate(meshes):
        arrays[f"vertices_m_{position}"] = mesh.vertices_m
        arrays[f"faces_{position}"] = mesh.faces
    return arrays


def _unpacked(stored: Mapping[str, NDArray[Any]]) -> list[PartMesh]:
    """Meshes from what `_packed` gives."""
    return [
        PartMesh(
            name=str(name),
            group=Group(group),
            role=Role(role),
            vertices_m=stored[f"vertices_m_{position}"],
            faces=stored[f"faces_{position}"],
        )
        for position, (name, group, role) in enumerate(stored["labels"])
    ]


def _built(rig: Rig, *, stowed: bool) -> Sequence[PartMesh]:
    from cad.assembly.assembly import kept_assembly  # noqa: PLC0415  (takes seconds to import)

    assembly = kept_assembly(rig)
    return assembly.stowed_meshes if stowed else assembly.seen_meshes


def _hull_key(rig: Rig) -> str | None:
    if rig.file_hull is None:
        return None
    from cad.hulls.hull_mesh_key import hull_mesh_key  # noqa: PLC0415  (only a file's hull needs trimesh for its key)

    return hull_mesh_key(rig.file_hull)
