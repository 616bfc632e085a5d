"""Kernel of a frame: rays followed over mirrors and sea surface to what they show, and what they show.

Every ray is followed exactly: port once (its exit rays do not depend on the joints), then plane by plane over the
mirrors and the sea surface, Fresnel's factors as weights. The first Lambertian surface ends it. Nothing is random, so
one sample per pixel has no noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from optics.kernels.backend import Float32, UInt32, dr
from optics.kernels.freezing import frozen
from optics.kernels.packing import Packing
from optics.kernels.refraction import reflect
from optics.mesh import Group
from scenes.kernels.geometry import Geometry
from scenes.kernels.path_state import Inputs
from scenes.kernels.paths import follow
from scenes.kernels.surface_shading import shade
from scenes.kernels.tracing import FAR_M, START_OFFSET_M, FixedHit, GroupScene, Primitive, Rays, nearest, nothing_known
from scenes.kernels.veiling_light import veiling_light_table
from scenes.light.field_table import layer
from scenes.light.uniforms import LightTables
from scenes.stage.frame import FrameArrays, TruthArrays
from scenes.stage.records import WORLD, BallRecord, Pose, StateRecord

RENDERERS = 1000
"""Number of recordings of a kernel that is no sign of a mistake."""


@dataclass(frozen=True)
class Shape:
    """What a kernel is compiled for.

    Attributes
    ----------
    light, state : Packing
        Order of the numbers of their records.
    wavelengths : int
    lanes : int
        Rays, where results are put into their places: a recording on a graphics card serves other renderers too, and
        keeps the sizes of what it was made with. Zero where results stay in the order of the rays, of any number.
    states : int
        Frames, each of one instant.
    eyes : int
        Places where lines of sight of a camera begin; zero for rays that begin anywhere.
    truth : bool
        Whether more than radiance and label is asked for.
    coherent : bool
        Whether neighbouring rays have about the same direction: how they are best traced together.
    rows, knots : int
        Of a single frame whose rows are exposed one after the other: how many there are, and how many states at even
        times from the first to the last are given. Zero for frames of one instant.
    """

    light: Packing
    state: Packing
    wavelengths: int
    lanes: int
    states: int
    eyes: int
    truth: bool
    coherent: bool = True
    rows: int = 0
    knots: int = 0


@cache
def compiled_frame(shape: Shape) -> Callable[..., Any]:
    """Frozen kernel of one or several frames."""

    # Every renderer has scenes of its own, for which the recording is made again.
    @frozen(recordings=RENDERERS, fast=True)
    def frame(  # noqa: PLR0917
        rays: Rays, geometry: Geometry, tables: LightTables, light_record: Any, state_records: Any, chosen: Any = None
    ) -> FrameArrays:
        if chosen is not None:
            rays = rays.taken(chosen)
        light = shape.light.unpack(light_record, UInt32(0))
        one_instant = shape.states == 1 and not shape.rows
        if shape.rows:
            state_records = _records_between(state_records, shape)
            dr.eval(state_records)
        state = shape.state.unpack(state_records, UInt32(0) if one_instant else rays.row if shape.rows else rays.state)
        # Numbers that all lanes share are unpacked by a small kernel of their own: the large one reads each once.
        tables = replace(tables, field_layer=layer(light, tables.field, light.reference_depth_m))
        dr.eval(light, tables.field_layer, *([state] if one_instant else []))
        if shape.eyes and not (geometry.source is None and geometry.shadow_in_water is None):
            veiling_light = veiling_light_table(
                light,
                # The robot hardly turns while a frame is read out: its veiling light is that of the middle row.
                lambda number: shape.state.unpack(state_records, number + shape.rows // 2).world,
                geometry,
                tables.field_layer,
                eyes=shape.eyes,
                states=shape.states,
            )
            dr.eval(veiling_light)
            tables = replace(tables, veiling_light=veiling_light)
        inputs = Inputs(
            rays=rays,
            geometry=geometry,
            tables=tables,
            light=light,
            state=state,
            wavelengths=shape.wavelengths,
            eyes=shape.eyes,
            coherent=shape.coherent,
        )
        found = shade(follow(inputs), inputs)
        if not shape.truth:
            found = replace(found, truth=None)
        return _in_place(found, rays.place, shape.lanes) if shape.lanes else found

    return frame


def _records_between(knots: Any, shape: Shape) -> Any:
    """Kernel: records of every row of a frame, linear between those of the knots."""
    width = shape.state.width
    lane = dr.arange(UInt32, shape.rows * width)
    position = Float32(lane // width) * ((shape.knots - 1) / max(shape.rows - 1, 1))
    knot = dr.minimum(UInt32(position), shape.knots - 2)
    near = knot * width + lane % width
    first, second = dr.gather(Float32, knots, near), dr.gather(Float32, knots, near + width)
    return dr.lerp(first, second, position - Float32(knot))


def _in_place(found: FrameArrays, place: Any, lanes: int) -> FrameArrays:
    """Kernel: results where their rays belong."""

    def placed(values: Any) -> Any:
        result = dr.empty(type(values), lanes)
        dr.scatter(result, values, place)
        return result

    return FrameArrays(
        rgb=[placed(channel) for channel in found.rgb],
        label=placed(found.label),
        truth=found.truth and TruthArrays(**{name: placed(values) for name, values in vars(found.truth).items()}),
    )


@cache
def compiled_prefix(state: Packing) -> Callable[..., Any]:
    """Frozen kernel of what no joint moves: where rays of the port, and of M1 behind it, hit the fixed group."""

    @frozen(recordings=RENDERERS, fast=True)
    def prefix(rays: Rays, groups: dict[str, GroupScene], state_records: Any) -> tuple[FixedHit, ...]:
        record: StateRecord = state.unpack(state_records, UInt32(0))
        mirrors = {name: mirror for name, mirror in record.mirrors.items() if name == Primitive.M1.name}
        # The sea is out of the way: its pose is replaced by one far below.
        far_below = Pose(rotation=np.eye(3).tolist(), translation=[0.0, 0.0, -FAR_M])
        ball = BallRecord(centre=[Float32(0)] * 3, radius=Float32(0), material=Float32(0), instance=Float32(0))
        static = replace(record, poses={WORLD: far_below}, mirrors=mirrors, ball=ball, clearance_m=Float32(0))
        fixed = {name: group for name, group in groups.items() if name == str(Group.FIXED)}
        found = []
        origin, direction, active = rays.origin, rays.direction, rays.gain > 0
        for _ in range(2):
            hit = nearest(fixed, static, origin, direction, active=active, known=nothing_known(), coherent=True)
            on_fixed = hit.primitive >= int(Primitive.FIRST_GROUP)
            found.append(FixedHit(distance=dr.select(on_fixed, hit.distance, FAR_M), face=hit.face))
            if not mirrors:
                break
            folded = hit.primitive == int(Primitive.M1)
            reflected = reflect(direction, mirrors[Primitive.M1.name].normal)
            origin = dr.select(folded, origin + direction * hit.distance + reflected * START_OFFSET_M, origin)
            direction = dr.select(folded, reflected, direction)
        return tuple(found)

    return prefix
