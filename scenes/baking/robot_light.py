"""What a robot changes of the light around it: looked at from around, it hides open water, and shines less."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Array3f32, Float32, UInt32, dr, mi
from optics.kernels.packing import on_host, opaque_numbers, vectors
from scenes.baking.ambient import RAYS_AT_ONCE, Surroundings
from scenes.baking.light_quality import LightQuality
from scenes.baking.sample_directions import Cone, SampleDirections, scattered_density, scattered_directions
from scenes.kernels.shading import channels, molecular_phase, phase
from scenes.kernels.tracing import Primitive
from scenes.light.field_table import azimuth_from, field_table, looked_up
from scenes.light.forward_cone import lengths_over_radius
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh

LEAST_RADIUS_M = 1e-3


@dataclass(frozen=True)
class Extent:
    """How large a robot is, world frame.

    Attributes
    ----------
    middle : array, shape (3,)
    radius : float
        Of a ball about the middle that holds it.
    shadow_radius : float
        Of a disc as large as the ellipse in its outline seen from above: so wide is its shadow.
    """

    middle: FloatArray
    radius: float
    shadow_radius: float


def extent_of(robot: GroupMesh) -> Extent:
    """Extent of a robot's mesh."""
    corners = robot.vertices_m[np.unique(robot.faces)]
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return Extent(
        middle=middle,
        radius=float(np.linalg.norm(corners - middle, axis=1).max()),
        shadow_radius=max(float(np.sqrt(np.prod(np.ptp(corners[:, :2], axis=0)))) / 2, LEAST_RADIUS_M),
    )


class RobotLight:
    """What a robot changes of the light at points of the water.

    Parameters
    ----------
    robot : GroupMesh
        All parts in the world frame, lit (`scenes.baking.ambient`).
    light : Light
    quality : LightQuality
    dark : callable
        Makes the surroundings that the robot is, however it is lit.
    """

    def __init__(self, robot: GroupMesh, light: Light, quality: LightQuality, dark: Callable[[], Surroundings]):
        self.robot, self.light, self.quality = robot, light, quality
        self._dark = dark
        self.extent = extent_of(robot)
        self._count = quality.sample_directions
        self._depth_m = -float(self.extent.middle[2])
        self._gaze_mirror = (robot.mirrors or {}).get(Primitive.M2.name)
        self._middle = Array3f32(*opaque_numbers(self.extent.middle))
        self._radius = dr.opaque(Float32, self.extent.radius)

    # What is looked at takes a while, and is not needed where all that is found of it is kept.

    @cached_property
    def _with(self) -> Surroundings:
        assert self.robot.ambient is not None
        return self._dark().lit(self.robot.ambient, None, depth_m=self._depth_m)

    @cached_property
    def _without(self) -> Surroundings:
        return Surroundings.of(None, self.light, depth_m=self._depth_m)

    @cached_property
    def _mean(self) -> list[dict[str, Any]]:
        """Mean coefficients of each channel."""
        means = self.light.channel_means(self._depth_m)
        return [{name: dr.opaque(Float32, values[k]) for name, values in means.items()} for k in range(3)]

    def open_water(self, eyes: FloatArray, directions: FloatArray) -> FloatArray:
        """Radiance of open water as the field's table holds it, shape (n, 3), as each eye sees it."""
        direction = vectors(directions)
        uniforms, field = self._with.uniforms, field_table(self.light.field_nodes)
        azimuth = azimuth_from(uniforms.sun_azimuth, direction)
        found = looked_up(uniforms, field, -vectors(eyes).z, direction.z, azimuth)
        return on_host(found)

    def missing_from_lines(self, eyes: FloatArray, directions: FloatArray, distance_m: FloatArray) -> FloatArray:
        """Light per metre, shape (n, 3), that a point at a distance from each eye does not scatter towards it.

        Whether the robot itself stands before the point does not count: what is looked up there belongs to lines
        between the nodes, which may pass beside it.
        """
        batches = np.array_split(np.arange(len(eyes)), -(-len(eyes) * self._count // RAYS_AT_ONCE))
        return np.concatenate([self._missing_from(eyes[k], directions[k], distance_m[k]) for k in batches])

    def _missing_from(self, eyes: FloatArray, directions: FloatArray, distance_m: FloatArray) -> FloatArray:
        """`missing_from_lines` of as many points as fit into the memory."""
        direction, distance = vectors(directions), Float32(aligned(distance_m, np.float32))
        point = vectors(eyes) + direction * distance
        sun = Array3f32(*self._with.uniforms.refracted_sun)
        in_shadow = self._with.scene.ray_test(mi.Ray3f(point, sun), coherent=False)
        from_sun = self._scattered_sun(direction, -point.z, distance)
        from_around = self._missing_around(point, direction)
        result = []
        # Dark water is seen through dark water: what is scattered on the path comes from the shadow as well.
        share = Float32(aligned(self._share_scattered_within(distance_m), np.float32))
        for mean, s, a in zip(self._mean, from_sun, from_around, strict=True):
            reaching = mean["scattering"] * dr.exp(-mean["attenuation"] * distance)
            gain = dr.exp(mean["scattering_without_peak"] * share * distance)
            result.append((dr.select(in_shadow, s, 0) + a * reaching) * gain)
        return on_host(result)

    def _scattered_sun(self, direction: Any, depth: Any, distance: Any) -> list[Any]:
        """The sun's light by channel that points scatter against a direction, as it arrives from a distance."""
        light = self._with.uniforms
        cosine = dr.dot(Array3f32(*light.refracted_sun), direction)
        particles, molecules = phase(self._with.tables.phase, cosine), molecular_phase(light, cosine)
        spectra = (light.sun_scattering, light.molecular_fraction, light.sun_attenuation, light.beam_attenuation)
        once = [
            b * dr.lerp(particles, molecules, m) * dr.exp(-k * depth - c * distance)
            for b, m, k, c in zip(*spectra, strict=True)
        ]
        return channels(light, once)

    def missing_from_plane(self, points: FloatArray) -> FloatArray:
        """Irradiance, shape (n, 3), that the robot occludes for planes at points that face its middle.

        What the water scatters on the path to a plane comes mostly from the robot's side of it, and is missing as well.
        """
        point = vectors(points)
        cone, samples = self._cone(point), SampleDirections.of(dr.width(point), self._count)

        def weights(owner: Any, looking: Any) -> list[Any]:
            its = cone.of(owner)
            return [dr.dot(looking, its.axis) / (self._count * its.density(looking))] * 3

        missing = self._missing(point, samples, cone.of(samples.place).directions(samples), weights)
        distance = np.linalg.norm(points - self.extent.middle, axis=1)
        length = self._share_scattered_within(distance) * distance
        within = Float32(aligned(length, np.float32))
        gained = [
            channel * dr.exp(mean["scattering_without_peak"] * within)
            for channel, mean in zip(missing, self._mean, strict=True)
        ]
        return on_host(gained)

    def _phases(self, looking: Any, direction: Any) -> list[Any]:
        """Phase function by channel of light that comes along the one direction and is seen along the other."""
        cosine = dr.dot(looking, direction)
        particles, molecules = phase(self._with.tables.phase, cosine), molecular_phase(self._with.uniforms, cosine)
        return [dr.lerp(particles, molecules, mean["molecular"]) for mean in self._mean]

    def _missing_around(self, point: Any, direction: Any) -> list[Any]:
        """Light per metre and scattering coefficient, by channel, that points do not send against a direction.

        They look over the cone that holds the robot, and about that direction: most of what water sends along a line
        comes from there. A direction that either might have taken counts by both densities (Veach & Guibas 1995,
        SIGGRAPH).
        """
        cone, samples = self._cone(point), SampleDirections.of(dr.width(point), self._count)

        def weights(owner: Any, looking: Any) -> list[Any]:
            ahead = dr.gather(Array3f32, direction, owner)
            density = self._count * (cone.of(owner).density(looking) + scattered_density(dr.dot(looking, ahead)))
            return [p / density for p in self._phases(looking, ahead)]

        over_cone = self._missing(point, samples, cone.of(samples.place).directions(samples), weights)
        ahead = scattered_directions(dr.gather(Array3f32, direction, samples.place), samples)
        about_direction = self._missing(point, samples, ahead, weights)
        return [a + b for a, b in zip(over_cone, about_direction, strict=True)]

    def _cone(self, origin: Any) -> Cone:
        """The cone about the ball around the robot, as points see it; from within it all directions."""
        towards = self._middle - origin
        distance = dr.norm(towards)
        narrowest = dr.safe_sqrt(1 - dr.square(self._radius / distance))
        cone = Cone(axis=towards / distance, lowest=dr.select(distance > self._radius, narrowest, -1))
        dr.eval(origin, cone.axis, cone.lowest)
        return cone

    def _missing(
        self, point: Any, samples: SampleDirections, looking: Any, weights: Callable[[Any, Any], list[Any]]
    ) -> list[Any]:
        """Light that the robot occludes for points, by channel: a weighted sum over their samples.

        `weights` is given the points that the samples belong to which hit the robot, and their directions. What the
        gaze mirror shows is left out: it depends on the joints.
        """
        count = dr.width(point)
        origin = dr.gather(Array3f32, point, samples.place)
        # What is gathered from is evaluated: together, not number by number, each by a kernel of its own.
        dr.eval(origin, looking)
        hit = self._with.scene.ray_intersect_preliminary(mi.Ray3f(origin, looking), coherent=False)
        found = dr.compress(hit.is_valid() & ~self._at_gaze_mirror(origin, looking, hit.t))
        if not dr.width(found):
            return [dr.zeros(Float32, count)] * 3
        o, d = dr.gather(Array3f32, origin, found), dr.gather(Array3f32, looking, found)
        shown, instead = self._with.radiance(o, d), self._without.radiance(o, d)
        owner = dr.gather(UInt32, samples.place, found)
        result = []
        for each, is_there, was_there in zip(weights(owner, d), shown, instead, strict=True):
            total = dr.zeros(Float32, count)
            dr.scatter_reduce(dr.ReduceOp.Add, total, each * (was_there - is_there), owner)
            result.append(total)
        dr.eval(result)
        return result

    def _at_gaze_mirror(self, origin: Any, looking: Any, distance: Any) -> Any:
        """Whether rays that hit the robot at a distance hit the gaze mirror's face before it."""
        if self._gaze_mirror is None:
            return mi.Bool(False)
        mirror = self._gaze_mirror
        centre, across, along = (Array3f32(*opaque_numbers(each)) for each in (mirror.centre, mirror.x, mirror.y))
        normal = dr.cross(across, along)
        facing = dr.dot(looking, normal)
        to_plane = dr.dot(centre - origin, normal) / facing
        local = origin + looking * to_plane - centre
        inside = mirror.outline.contains(dr.dot(local, across), dr.dot(local, along))
        return (facing < 0) & inside & (to_plane > 0) & (to_plane <= distance)

    def _share_scattered_within(self, distance: FloatArray) -> FloatArray:
        """Share of the light scattered on lines of these lengths that comes from within the robot's shadow."""
        nodes = lengths_over_radius()
        return np.asarray(np.interp(distance / self.extent.shadow_radius, nodes, self.light.hidden_shares))
