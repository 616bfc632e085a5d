"""What a kernel of paths computes from, and the state of a path from segment to segment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from optics.kernels.backend import Array3f32, Bool, Float32, UInt32, dr
from optics.status import Region
from scenes.kernels.geometry import Geometry
from scenes.kernels.shading import Spectrum
from scenes.kernels.tracing import Rays
from scenes.light.uniforms import LightTables, LightUniforms
from scenes.stage.records import StateRecord


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """What a kernel computes from: rays, geometry and tables as they are handed over, uniforms unpacked."""

    rays: Rays
    geometry: Geometry
    tables: LightTables
    light: LightUniforms
    state: StateRecord
    wavelengths: int
    eyes: int
    coherent: bool


@dataclass(kw_only=True)
class Path:
    """State of the loop over segments: Dr.Jit arrays. Not frozen, as Dr.Jit writes into it.

    Attributes
    ----------
    bounce : UInt32
        Mirrors and sea surfaces passed.
    origin, direction : Array3f32
        Of the segment that comes next, body frame; of a path that has ended, its end and how it got there.
    active : Bool
        Whether it goes on.
    distance : Float32
        From the port to what is seen.
    length : Float32
        Of the last segment.
    throughput, rgb : list of Float32
        By wavelength, what of the light from here on arrives; by channel, the light found so far.
    region : UInt32
    unseen, surface_seen : Bool
        Whether nothing has sent light of its own into the view yet; whether it was the sea surface that did.
    seen_point : Array3f32
        Where the first did, body frame; behind the sea surface, which lets some light through and reflects the rest,
        the path goes on for its radiance alone.
    primitive, face, u, v
        Of the last hit (`scenes.kernels.tracing.Hit`).
    """

    bounce: Any
    origin: Any
    direction: Any
    active: Any
    distance: Any
    length: Any
    throughput: Spectrum
    rgb: list[Any]
    region: Any
    unseen: Any
    surface_seen: Any
    seen_point: Any
    primitive: Any
    face: Any
    u: Any
    v: Any

    @classmethod
    def along(cls, rays: Rays, wavelengths: int) -> Path:
        """Paths that begin as rays."""
        alive, count = rays.gain > 0, dr.width(rays.gain)
        return cls(
            bounce=dr.zeros(UInt32, count),
            origin=Array3f32(rays.origin),
            direction=Array3f32(rays.direction),
            active=Bool(alive),
            distance=dr.zeros(Float32, count),
            length=dr.zeros(Float32, count),
            throughput=[dr.ones(Float32, count) for _ in range(wavelengths)],
            rgb=[dr.zeros(Float32, count) for _ in range(3)],
            region=dr.select(alive, UInt32(int(Region.DIRECT)), UInt32(int(Region.HOUSING))),
            unseen=Bool(alive),
            surface_seen=dr.zeros(Bool, count),
            seen_point=dr.zeros(Array3f32, count),
            primitive=dr.zeros(UInt32, count),
            face=dr.zeros(UInt32, count),
            u=dr.zeros(Float32, count),
            v=dr.zeros(Float32, count),
        )
