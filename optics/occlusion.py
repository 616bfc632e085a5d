"""What blocks rays: the parts of one group as triangles that rays can hit.

Rays are given in the frame of the group's vertices. A group that moves is not moved: its rays are brought into its
frame instead, so that many joint values run in one kernel and no search tree is ever rebuilt.

Everything here is float32 (Embree's and OptiX's precision): 0.1 micrometre at a distance of 1 m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import aligned
from optics.kernels.backend import Float32, UInt32, dr, mi
from optics.kernels.ray_scene import mesh_scene
from optics.mesh import Group, PartMesh, Role, merge

ROLES = tuple(Role)
"""Order of the roles in `FirstHit.role`."""


@dataclass(frozen=True, kw_only=True)
class FirstHit:
    """First hits: Dr.Jit arrays. `distance` is infinite, and `part` and `role` have no meaning, where nothing is hit.

    `part` counts the occluder's parts, `role` is a position in `ROLES`.
    """

    distance: Any
    part: Any
    role: Any


@dataclass(frozen=True)
class Occluder:
    """Parts of one group; without parts it blocks nothing.

    Parameters
    ----------
    parts : sequence of PartMesh
        All of the same group; their vertices are in its frame.
    """

    parts: Sequence[PartMesh]
    _scene: Any = field(init=False, repr=False)
    _part_of_face: NDArray[np.int32] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        groups = sorted({part.group for part in self.parts})
        if len(groups) > 1:
            raise ValueError(f"expected parts of one group, got {' and '.join(groups)}")
        vertices, faces, part_of_face = merge(self.parts)
        object.__setattr__(self, "_scene", mesh_scene(vertices, faces) if len(faces) else None)
        object.__setattr__(self, "_part_of_face", part_of_face)

    @classmethod
    def of_group(cls, parts: Sequence[PartMesh], group: Group) -> Occluder:
        """Occluder of those parts that belong to a group."""
        return cls([part for part in parts if part.group is group])

    def parameters(self) -> dict[str, Any]:
        """What the kernels `blocks` and `first_hit` take; empty when there is nothing to hit."""
        if self._scene is None:
            return {}
        roles = np.array([ROLES.index(part.role) for part in self.parts], dtype=np.uint32)
        return {
            "scene": self._scene,
            "part_of_face": UInt32(aligned(self._part_of_face, np.uint32)),
            "role_of_face": UInt32(roles[self._part_of_face]),
        }


def blocks(parameters: dict[str, Any], origin: Any, direction: Any, maximum_distance: Any, active: Any) -> Any:
    """Kernel: whether anything is hit within the distance; False for inactive lanes."""
    if not parameters:
        return dr.zeros(dr.mask_t(Float32), dr.width(direction))
    return parameters["scene"].ray_test(_ray(origin, direction, maximum_distance), active=active)


def first_hit(parameters: dict[str, Any], origin: Any, direction: Any, maximum_distance: Any, active: Any) -> FirstHit:
    """Kernel: what is hit first within the distance."""
    if not parameters:
        return FirstHit(distance=Float32(dr.inf), part=UInt32(0), role=UInt32(0))
    ray = _ray(origin, direction, maximum_distance)
    found = parameters["scene"].ray_intersect_preliminary(ray, coherent=True, active=active)
    hit = found.is_valid()
    return FirstHit(
        distance=dr.select(hit, found.t, dr.inf),
        part=dr.gather(UInt32, parameters["part_of_face"], found.prim_index, hit),
        role=dr.gather(UInt32, parameters["role_of_face"], found.prim_index, hit),
    )


def _ray(origin: Any, direction: Any, maximum_distance: Any) -> Any:
    # An infinite end would make Embree's intervals NaN; nothing on a rig is that far away.
    end = dr.minimum(mi.Float(maximum_distance), dr.largest(mi.Float))
    return mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction), end, 0.0, [])
