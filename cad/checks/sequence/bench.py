"""The bench on which a mount is put together: its parts as bodies, what lies there already, and what is still loose.

Everything lies as it does in the finished mount with both joints at 0. A cluster is what is in one piece already.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
from build123d import Plane

from cad.assembly.assembly import Assembly, Part
from cad.assembly.closed_body import closed_body
from cad.checks.sequence.lines import Surface
from optics.kernels.arrays import FloatArray
from optics.mesh import Role

TOUCH_M = 0.00025
"""Pieces this near to each other touch: a designed fit is 0.2 mm."""
NEAR_M = 0.005
"""Parts further apart than this have nothing to do with each other."""
PRESSED = ("insert", "bushing", "foam tape")
"""Words in the catalogue name of what is pressed into a printed part before anything else."""


@dataclass(kw_only=True)
class Bench:
    """What has been put together so far.

    Attributes
    ----------
    assembly : Assembly
    parts : dict of str to Part
    surfaces : dict of str to Surface
        In the body frame, millimetres.
    bodies : dict of str to Manifold
        The same as bodies that can be intersected, metres.
    clusters : list of set of str
        What is in one piece; in the beginning each part but the small ones is alone.
    loose : dict of str to set of str
        Small pieces that are not used yet, and the other parts that each needs.
    """

    assembly: Assembly
    parts: dict[str, Part]
    surfaces: dict[str, Surface]
    bodies: dict[str, manifold3d.Manifold]
    clusters: list[set[str]]
    loose: dict[str, set[str]]

    @classmethod
    def of(cls, assembly: Assembly) -> Bench:
        """Bench on which all parts of a mount lie."""
        parts = {part.name: part for part in assembly.parts}
        poses = {name: assembly.pose(part, 0.0, 0.0) for name, part in parts.items()}
        bodies = {name: closed_body(part.mesh).transform(poses[name].as_matrix()[:3]) for name, part in parts.items()}
        surfaces = {
            name: Surface(
                vertices_mm=1000 * poses[name].apply(part.mesh.vertices_m), faces=part.mesh.faces.astype(np.int64)
            )
            for name, part in parts.items()
        }
        return cls(
            assembly=assembly,
            parts=parts,
            surfaces=surfaces,
            bodies=bodies,
            clusters=[{name} for name, part in parts.items() if not is_small(part)],
            loose=_loose(parts, bodies),
        )

    def cluster_of(self, name: str) -> set[str]:
        """What is in one piece with a part."""
        return next(cluster for cluster in self.clusters if name in cluster)

    def join(self, name: str, host: str) -> set[str]:
        """Put a part, and what is in one piece with it, to another; what is in one piece then."""
        inner, outer = self.cluster_of(name), self.cluster_of(host)
        outer |= inner
        self.clusters.remove(inner)
        return outer

    def surface(self, names: Iterable[str]) -> Surface:
        """Several parts as one surface."""
        return Surface.joined([self.surfaces[name] for name in sorted(names)])

    def ordered(self, names: Iterable[str]) -> tuple[str, ...]:
        """Names in the order of the assembly."""
        wanted = set(names)
        return tuple(name for name in self.parts if name in wanted)

    def held_by(self, cluster: set[str]) -> list[str]:
        """Loose pieces all of whose neighbours are in a cluster, those that go in deepest first."""
        names = [name for name, needs in self.loose.items() if needs and needs <= cluster]
        return sorted(names, key=self._depth_mm)

    def axis_of(self, name: str) -> FloatArray:
        """Direction out of the hole that a small piece sits in: z of its own frame; body frame."""
        part = self.parts[name]
        own = np.array(tuple(Plane(part.solid.location).z_dir))
        return np.asarray(self.assembly.pose(part, 0.0, 0.0).rotation.apply(own))

    def _depth_mm(self, name: str) -> tuple[str, float]:
        """Where a piece ends along its axis, for pieces on one axis."""
        axis = self.axis_of(name)
        return str(np.round(axis, 3)), float((self.surfaces[name].vertices_mm @ axis).max())


def is_small(part: Part) -> bool:
    """Whether a part is a screw, insert, washer or the like."""
    return not part.printed and part.role not in {Role.HULL, Role.SERVO, Role.MIRROR}


def is_pressed(part: Part) -> bool:
    """Whether a part is pressed into a printed one."""
    return is_small(part) and any(word in part.catalogue.lower() for word in PRESSED)


def boxes_overlap(first: manifold3d.Manifold, second: manifold3d.Manifold, margin_m: float = 0.0) -> bool:
    """Whether the boxes around two bodies are nearer than a margin."""
    (low, high), (other_low, other_high) = _box(first), _box(second)
    return bool((low <= other_high + margin_m).all() and (other_low <= high + margin_m).all())


def _box(body: manifold3d.Manifold) -> tuple[FloatArray, FloatArray]:
    bounds = np.array(body.bounding_box())
    return bounds[:3], bounds[3:]


def _loose(parts: dict[str, Part], bodies: dict[str, manifold3d.Manifold]) -> dict[str, set[str]]:
    """Small pieces, each with the parts that must be there before it can go in.

    Those are the parts it touches; where small pieces make a stack (screw, washer, sleeve), those of the whole stack.
    An insert or a bushing counts for the part it is pressed into.
    """
    small = [name for name, part in parts.items() if is_small(part)]
    large = [name for name in parts if name not in small]
    touched = {name: {other for other in large if _touch(bodies[name], bodies[other])} for name in small}
    for name in filter(lambda name: is_pressed(parts[name]), small):
        touched[name] = {_pressed_into(name, parts, bodies)}
    driven = [name for name in small if not is_pressed(parts[name])]
    needed: dict[str, set[str]] = {}
    for stack in _stacks(driven, bodies):
        beside = [
            name for name in small if is_pressed(parts[name]) and any(_touch(bodies[name], bodies[n]) for n in stack)
        ]
        needs = set[str]().union(*(touched[name] for name in [*stack, *beside]))
        needed |= dict.fromkeys(stack, needs)
    return {name: needed.get(name, touched[name]) for name in small}


def _pressed_into(name: str, parts: dict[str, Part], bodies: dict[str, manifold3d.Manifold]) -> str:
    """Printed part of the same group that an insert or bushing is nearest to: some holes are drawn with clearance."""
    hosts = [other for other, part in parts.items() if part.printed and part.group is parts[name].group]
    near = [other for other in hosts if boxes_overlap(bodies[name], bodies[other], NEAR_M)]
    return min(near or hosts, key=lambda other: float(bodies[name].min_gap(bodies[other], NEAR_M)))


def _stacks(names: Sequence[str], bodies: dict[str, manifold3d.Manifold]) -> list[list[str]]:
    """Small pieces that touch each other, directly or through others."""
    stacks: list[list[str]] = []
    for name in names:
        touching = [stack for stack in stacks if any(_touch(bodies[name], bodies[other]) for other in stack)]
        stacks = [stack for stack in stacks if stack not in touching]
        stacks.append([other for stack in touching for other in stack] + [name])
    return stacks


def _touch(first: manifold3d.Manifold, second: manifold3d.Manifold) -> bool:
    return boxes_overlap(first, second, TOUCH_M) and bool(first.min_gap(second, TOUCH_M) < TOUCH_M)
