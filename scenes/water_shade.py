"""What the robot keeps from the water around it: its shadow in the light that is scattered into a line of sight.

Open water shines by light from everywhere. Near the robot some of that light is kept by hull and mount, which send less
of their own. The difference is scattered once: from points along lines of sight the robot is looked at, and what it
shows there instead of open water, and instead of the sun, is scattered into the view,

    D(w, r) = int_0^r exp(-c s) b int p(w, w') (L(w') - F(w')) dw' ds.

Found once, for the robot as it hangs with its joints at zero, from three places: port, fold mirror and gaze mirror. It
is kept as a share of the radiance of open water, by direction in the body frame and length.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.backend import Array3f32, Float32, UInt32, dr, mi
from scenes.ambient import Surroundings, cached
from scenes.field_table import azimuth_from, field_table, looked_up
from scenes.geometry import GroupMesh
from scenes.light import Light
from scenes.packing import pairs_of
from scenes.shading import channels, molecular_phase, phase
from scenes.water_shade_table import AZIMUTHS, ELEVATIONS, LENGTH_SCALE_M, LENGTHS, ROW

FloatArray = NDArray[np.float64]

FARTHEST_M = 8.0
"""Beyond, the robot fills too little of the view to matter."""

POINTS = 2
"""On a line of sight from one node to the next."""

LOOKS = 128
"""Directions in which a point looks at the robot."""


def lengths_m() -> FloatArray:
    """Lengths of the nodes."""
    reached = np.linspace(0, 1, LENGTHS)
    return np.append(-LENGTH_SCALE_M * np.log1p(-reached[:-1]), FARTHEST_M)


def water_shade(robot: GroupMesh, world_from_body: RigidTransform, eyes_m: FloatArray, light: Light) -> Any:
    """Table of what the robot keeps, as `scenes.water_shade_table.kept_from_water` takes it.

    Parameters
    ----------
    robot : GroupMesh
        All parts in the world frame, lit (`scenes.ambient`).
    world_from_body : RigidTransform
        Where it hangs.
    eyes_m : array, shape (e, 3)
        Where lines of sight begin, body frame.
    light : Light
    """
    places = (world_from_body.as_matrix(), eyes_m)
    shares = cached(robot, light, "water", lambda: _shares(robot, world_from_body, eyes_m, light), places=places)
    return pairs_of(shares, ROW)


def _shares(robot: GroupMesh, world_from_body: RigidTransform, eyes_m: FloatArray, light: Light) -> FloatArray:
    """Shares at all nodes, shape (eyes, elevations, azimuths, lengths, 3)."""
    azimuth = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
    elevation = np.linspace(-np.pi / 2, np.pi / 2, ELEVATIONS)
    level = np.cos(elevation)[:, np.newaxis]
    ways = np.stack(
        np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)[:, np.newaxis]), axis=-1
    )
    directions = world_from_body.rotation.apply(ways.reshape(-1, 3))
    robots_light = _RobotsLight(robot, light)
    nodes = lengths_m()
    result = []
    for eye in world_from_body.apply(eyes_m):
        missing = [np.zeros((len(directions), 3))]
        for near, far in pairwise(nodes):
            edges = np.linspace(near, far, POINTS + 1)
            pieces = [robots_light.missing(eye, directions, float(a + b) / 2) * (b - a) for a, b in pairwise(edges)]
            missing.append(missing[-1] + np.sum(pieces, axis=0))
        open_water = robots_light.open_water(eye, directions)
        result.append(np.stack(missing, axis=1) / open_water[:, np.newaxis])
    return np.stack(result).reshape(len(eyes_m), ELEVATIONS, AZIMUTHS, LENGTHS, 3)


class _RobotsLight:
    """What a robot changes of the light at points of the water."""

    def __init__(self, robot: GroupMesh, light: Light):
        corners = robot.vertices_m[np.unique(robot.faces)]
        self._middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        self._radius = float(np.linalg.norm(corners - self._middle, axis=1).max())
        depth = -float(self._middle[2])
        self._with, self._without = (Surroundings(mesh, light, depth_m=depth) for mesh in (robot, None))
        self._scene, self._tables, self._numbers = self._with.scene, self._with.tables, self._with.numbers
        numbers = light.numbers(depth)
        self._field = field_table(light.field_nodes)
        # Of the light around a channel's wavelengths are taken together, each as much as there is of it at this depth.
        around = light.bands.weight.sum(axis=0) * [
            np.interp(depth, light.field.depth_m, row) for row in light.field.scalar
        ]
        self._mean = [
            {
                name: float(np.average(np.asarray(numbers[name])[part], weights=around[part]))
                for name in ("b", "c", "molecular")
            }
            for part in _thirds(len(light.bands.wavelength_nm))
        ]

    def open_water(self, eye: FloatArray, directions: FloatArray) -> FloatArray:
        """Radiance of open water as the field's table holds it, shape (n, 3)."""
        way = _vectors(directions)
        azimuth = azimuth_from(self._numbers["sun_azimuth"], way)
        found = looked_up(self._numbers, self._field, Float32(-float(eye[2])), way.z, azimuth)
        return np.stack([channel.numpy() for channel in found], axis=-1)

    def missing(self, eye: FloatArray, directions: FloatArray, distance: float) -> FloatArray:
        """Light per metre, shape (n, 3), that a point at a distance does not scatter towards the eye.

        Whether the robot itself stands before the point does not count: what is looked up there belongs to lines
        between the nodes, which may pass beside it.
        """
        way = _vectors(directions)
        begin = Array3f32(*(float(x) for x in eye))
        point = begin + way * distance
        sun = Array3f32(*self._numbers["refracted_sun"])
        in_shadow = self._scene.ray_test(mi.Ray3f(point, sun), coherent=True)
        from_sun = self._scattered_sun(way, -point.z, distance)
        from_around = self._from_robot(point, way)
        result = []
        for mean, s, a in zip(self._mean, from_sun, from_around, strict=True):
            total = dr.select(in_shadow, s, 0) + a * (mean["b"] * float(np.exp(-mean["c"] * distance)))
            result.append(total.numpy())
        return np.stack(result, axis=-1)

    def _scattered_sun(self, way: Any, depth: Any, distance: float) -> list[Any]:
        """The sun's light by channel that points scatter against the way, as it arrives from a distance."""
        numbers = self._numbers
        cosine = dr.dot(Array3f32(*numbers["refracted_sun"]), way)
        particles, molecules = phase(self._tables["phase"], cosine), molecular_phase(numbers, cosine)
        once = [
            b * dr.lerp(particles, molecules, m) * dr.exp(-k * depth - c * distance)
            for b, m, k, c in zip(*(numbers[name] for name in ("b_sun", "molecular", "k_sun", "c")), strict=True)
        ]
        return channels(numbers, once)

    def _from_robot(self, point: Any, way: Any) -> list[Any]:
        """Phase function times the light that the robot keeps, by channel, integrated over directions."""
        count = dr.width(point)
        lane = dr.arange(UInt32, count * LOOKS)
        place, look = lane // LOOKS, lane % LOOKS
        origin, back = dr.gather(Array3f32, point, place), dr.gather(Array3f32, way, place)
        towards = Array3f32(*(float(x) for x in self._middle)) - origin
        distance = dr.norm(towards)
        # The cone about the ball around the robot; from within it all directions.
        narrowest = dr.safe_sqrt(1 - dr.square(self._radius / distance))
        lowest = dr.select(distance > self._radius, narrowest, -1)
        cosine = 1 - (1 - lowest) * ((Float32(look) + 0.5) / LOOKS)
        sine = dr.safe_sqrt(1 - dr.square(cosine))
        turns = Float32(place % 4096) * 0.618033988749895
        s, c = dr.sincos(Float32(look) * 2.399963229728653 + 2 * np.pi * (turns - dr.floor(turns)))
        axis = towards / distance
        frame = mi.Frame3f(mi.Normal3f(axis))
        looking = Array3f32(frame.to_world(mi.Vector3f(sine * c, sine * s, cosine)))
        hit = self._scene.ray_test(mi.Ray3f(origin, looking), coherent=True)
        found = dr.compress(hit)
        if not dr.width(found):
            return [dr.zeros(Float32, count)] * 3
        o, d = dr.gather(Array3f32, origin, found), dr.gather(Array3f32, looking, found)
        shown, instead = self._with.radiance(o, d), self._without.radiance(o, d)
        angle = dr.dot(d, dr.gather(Array3f32, back, found))
        particles, molecules = phase(self._tables["phase"], angle), molecular_phase(self._numbers, angle)
        owner = dr.gather(UInt32, place, found)
        solid = dr.gather(Float32, 2 * np.pi * (1 - lowest) / LOOKS, found)
        result = []
        for mean, is_there, was_there in zip(self._mean, shown, instead, strict=True):
            p = dr.lerp(particles, molecules, mean["molecular"])
            total = dr.zeros(Float32, count)
            dr.scatter_reduce(dr.ReduceOp.Add, total, p * solid * (was_there - is_there), owner)
            result.append(total)
        dr.eval(result)
        return result


def _thirds(count: int) -> list[slice]:
    nodes = count // 3
    return [slice(first, first + nodes) for first in range(0, count, nodes)]


def _vectors(rows: FloatArray) -> Any:
    return Array3f32(*(Float32(np.ascontiguousarray(column, dtype=np.float32)) for column in rows.T))
