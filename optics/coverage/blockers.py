"""What stops a segment of a ray: the fixed parts in the body frame, the moving ones each in its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from optics.coverage.field import SKIN_M
from optics.coverage.outcome import Outcome, outcomes_at_parts
from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.mesh import Group
from optics.occlusion import Occluder, first_hit

Occluders = Mapping[Group, Occluder]
"""An occluder for every group, those without parts too."""


@dataclass(frozen=True)
class Segment:
    """Segments of rays in the body frame between two surfaces: Dr.Jit arrays, float64."""

    origin: Any
    direction: Any
    length: Any


@dataclass(frozen=True)
class Stop:
    """What stops a segment first (SEEN: nothing does), and how far from its origin (float32; infinite: nowhere)."""

    distance: Any
    outcome: Any


def blocker_parameters(occluders: Occluders) -> dict[str, Any]:
    """What `first_blocker` takes of the parts; what else it takes is `gimbal`, the origin of the moving frames."""
    return {
        "occluders": {group: occluder.parameters() for group, occluder in occluders.items()},
        "outcomes": {group: UInt32(outcomes_at_parts(occluder.parts)) for group, occluder in occluders.items()},
    }


def first_blocker(
    parameters: dict[str, Any],
    axes_of_group: Mapping[Group, Any],
    segment: Segment,
    active: Any,
    known: Stop | None = None,
) -> Stop:
    """Kernel: the first part of some groups in a segment's way, or what is known to be there when that is nearer.

    A group comes with the axes of its frame in the body frame, or with None when that is the body's.
    """
    stop = known or Stop(Float32(dr.inf), UInt32(Outcome.SEEN))
    end = Float32(segment.length - SKIN_M)
    for group, axes in axes_of_group.items():
        occluder = parameters["occluders"][group]
        if not occluder:
            continue
        origin, direction = segment.origin, segment.direction
        if axes is not None:
            # Rays hit triangles in float32 anyway; turned in it they cost half.
            from_gimbal = Array3f32(origin - parameters["gimbal"])
            along = Array3f32(direction)
            origin, direction = (Array3f32(*(dr.dot(axis, vector) for axis in axes)) for vector in (from_gimbal, along))
        # What is known to be nearer need not be looked for.
        reach = dr.minimum(end, stop.distance) - Float32(SKIN_M)
        hit = first_hit(occluder, dr.fma(direction, SKIN_M, origin), direction, reach, active)
        outcome = dr.gather(UInt32, parameters["outcomes"][group], hit.part)
        found = dr.isfinite(hit.distance)
        stop = Stop(
            dr.select(found, hit.distance + Float32(SKIN_M), stop.distance), dr.select(found, outcome, stop.outcome)
        )
    return stop
