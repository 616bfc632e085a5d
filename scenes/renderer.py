"""The fast renderer: what the camera sees through port and mirrors, deterministic, one frozen kernel per frame.

Every ray is followed exactly: port once (its exit rays do not depend on the joints), then plane by plane over the
mirrors and the sea surface, Fresnel's factors as weights. The first Lambertian surface ends it. Nothing is random, so
one sample per pixel has no noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.arrays import check_vector
from optics.backend import Array3f32, Bool, Float32, UInt32, dr
from optics.layout import Layout, camera_pose
from optics.materials import aluminium_index
from optics.mesh import Group, PartMesh
from optics.refraction import reflect
from optics.status import Region, Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from rigs.specification import FlatMirror
from scenes.frame import Frame, Label
from scenes.geometry import Geometry, rig_and_world
from scenes.shading import light_parameters, lit_surface, mirror_throughput, scattered_in, surface_light
from scenes.spectrum import camera_bands
from scenes.stage import Stage, Target
from scenes.tracing import (
    FIRST_MIRROR,
    START_OFFSET_M,
    move,
    nearest,
    opaque32,
    pose_parameters,
    sunlit,
    turn,
    vector32,
)

LARGEST_BOUNCE_COUNT = 6
"""Mirrors and total reflections a ray may pass: two for the gaze, two more when the camera sees itself, the rest for
the sea surface."""

SHADOW_OFFSET_M = 1e-4
"""How far a shadow ray starts off its surface: hits at tank scale are placed to about 1e-6 m in single precision."""


class FastRenderer:
    """Renders a rig in a world; made once, called for every pose.

    Parameters
    ----------
    rig : Rig
    parts : sequence of PartMesh
        Hull and mount as triangles (`cad.meshes.rig_meshes`); may be empty.
    stage : Stage
        World, light, and where robot and target are unless `render` is told otherwise.
    width_px, height_px : int, optional
        Size of the frame; the camera's own by default. Another size looks at the same field of view.
    samples : int
        Samples per pixel, spread evenly over it.
    """

    def __init__(
        self,
        rig: Rig,
        parts: Sequence[PartMesh],
        stage: Stage,
        *,
        width_px: int | None = None,
        height_px: int | None = None,
        samples: int = 1,
    ):
        self.rig = rig
        self.shape = (height_px or rig.camera.height_px, width_px or rig.camera.width_px)
        self.samples = samples
        if min(*self.shape, samples) < 1:
            raise ValueError(f"expected a positive size and sample count, got {self.shape[::-1]} and {samples}")
        self._layout = Layout.from_rig(rig) if rig.has_mirrors else None
        self.stage = stage
        self._geometry = rig_and_world(parts, stage.world)
        self._light = light_parameters(stage.light, aluminium_index(camera_bands().wavelength_nm))
        self._rays = self._port_rays()
        self._kernel = compiled_frame(len(camera_bands().wavelength_nm), samples)

    def render(
        self,
        *,
        q1: float = 0.0,
        q2: float = 0.0,
        world_from_body: RigidTransform | None = None,
        target: Target | None = None,
    ) -> Frame:
        """Render one frame at joint values in radians; `ValueError` outside the joint limits.

        The robot's pose and the target are the stage's unless given.
        """
        radiance, distance, label, region, target_fraction = self.arrays(
            q1=q1, q2=q2, world_from_body=world_from_body, target=target
        )
        rows, columns = self.shape
        return Frame(
            radiance=np.stack([np.array(channel) for channel in radiance], axis=-1).reshape(rows, columns, 3),
            distance_m=np.array(distance).reshape(rows, columns),
            label=np.array(label).astype(np.uint8).reshape(rows, columns),
            region=np.array(region).astype(np.uint8).reshape(rows, columns),
            target_fraction=np.array(target_fraction).reshape(rows, columns),
        )

    def arrays(
        self,
        *,
        q1: float = 0.0,
        q2: float = 0.0,
        world_from_body: RigidTransform | None = None,
        target: Target | None = None,
    ) -> tuple[Any, Any, Any, Any, Any]:
        """Same as `render`, left on the device: the fields of `Frame`, flat, radiance as a list of channels."""
        world_from_body = self.stage.world_from_body if world_from_body is None else world_from_body
        target = target or self.stage.target
        state = {
            "body": pose_parameters(world_from_body),
            "groups": {},
            "mirrors": [],
            "target": vector32([0, 0, 0] if target is None else check_vector("centre_m", target.centre_m)),
            "target_radius": opaque32(0.0 if target is None else target.radius_m),
        }
        if self._layout is not None:
            self._layout.check_joints(q1, q2)
            body_from = {
                Group.FIXED: RigidTransform.identity(),
                Group.PAN: self._layout.body_from_pan(q1),
                Group.TILT: self._layout.body_from_m2(q1, q2),
            }
            state["groups"] = {str(group): pose_parameters(pose.inv()) for group, pose in body_from.items()}
            state["mirrors"] = [
                _mirror(self._layout.body_from_m1, self.rig.fold_mirror),
                _mirror(body_from[Group.TILT], self.rig.gaze_mirror),
            ]
        elif str(Group.FIXED) in self._geometry:
            state["groups"] = {str(Group.FIXED): pose_parameters(RigidTransform.identity())}
        return self._kernel(self._rays, self._geometry, state, self._light)  # type: ignore[no-any-return]

    def _port_rays(self) -> dict[str, Any]:
        """Rays on the port's outer face in the body frame, sample by sample of each pixel, in single precision."""
        train = OpticalTrain.from_rig(self.rig)
        bare = OpticalTrain(camera=train.camera, port=train.port)
        rows, columns = self.shape
        centres = pixel_grid(train.camera, columns, rows)
        cell = np.array([train.camera.width_px / columns, train.camera.height_px / rows])
        offsets = _spread(self.samples) * cell
        pixels = (centres[:, np.newaxis] + offsets).reshape(-1, 2)
        rays = bare.trace(pixels)
        pose = camera_pose(self.rig.camera)
        # Radiance falls by the square of the index on its way from the water into the air before the lens.
        gain = bare.transmittance(pixels) * (train.port.n_inside / train.port.n_water) ** 2
        return {
            "origin": _columns32(pose.apply(rays.origin_m)),
            "direction": _columns32(pose.rotation.apply(rays.direction)),
            "gain": Float32(np.where(rays.status == Status.OK, gain, 0).astype(np.float32)),
        }


def _spread(count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """`count` points spread evenly over the unit square around zero; one point is its centre.

    The R2 sequence (Roberts 2018, an additive recurrence with the plastic number), shifted so that its mean is zero.
    """
    plastic = 1.32471795724474602596
    steps = np.arange(count)[:, np.newaxis] / np.array([plastic, plastic**2])
    points = (0.5 + steps) % 1 - 0.5
    return np.asarray(points - points.mean(axis=0))


def _columns32(vectors: np.ndarray[Any, np.dtype[np.float64]]) -> Any:
    return Array3f32(*(Float32(np.ascontiguousarray(column, dtype=np.float32)) for column in vectors.T))


def _mirror(pose: RigidTransform, plate: FlatMirror | None) -> dict[str, Any]:
    assert plate is not None  # a rig has both mirrors or none
    axes = pose.rotation.as_matrix()
    half_width, half_height = plate.width_mm / 2000, plate.height_mm / 2000
    edges = [(1, 0, half_width), (-1, 0, half_width), (0, 1, half_height), (0, -1, half_height)]
    return {
        "point": vector32(pose.translation),
        "x": vector32(axes[:, 0]),
        "y": vector32(axes[:, 1]),
        "normal": vector32(axes[:, 2]),
        "edges": [[opaque32(value) for value in edge] for edge in edges],
    }


@cache
def compiled_frame(wavelengths: int, samples: int) -> Callable[..., Any]:
    """Frozen kernel of a frame; compiled for a number of wavelengths and of samples per pixel."""

    @dr.freeze
    def frame(rays: dict[str, Any], geometry: Geometry, state: dict[str, Any], light: dict[str, Any]) -> Any:
        path = _follow(rays, geometry, state, light, wavelengths)
        radiance = _with_lit_surfaces(path, geometry, state, light)
        channels = [
            rays["gain"] * sum((w * r for w, r in zip(row, radiance, strict=True)), Float32(0))
            for row in light["weight"]
        ]
        on_target = dr.select(path["label"] == int(Label.TARGET), Float32(1), Float32(0))
        truth = (path["distance"], path["label"], path["region"])
        if samples > 1:
            first = dr.arange(UInt32, dr.width(rays["gain"]) // samples) * samples
            channels = [dr.block_sum(channel, samples) / samples for channel in channels]
            on_target = dr.block_sum(on_target, samples) / samples
            truth = tuple(dr.gather(type(values), values, first) for values in truth)
        return channels, *truth, on_target

    return frame  # type: ignore[no-any-return]


def _follow(
    rays: dict[str, Any], geometry: Geometry, state: dict[str, Any], light: dict[str, Any], wavelengths: int
) -> dict[str, Any]:
    """Kernel: follow rays over mirrors and sea surface to the first Lambertian surface or into open water.

    The path's `label` and `distance` are those of the first thing that sends light of its own into the view; behind
    the sea surface, which lets some light through and reflects the rest, the ray goes on for its radiance alone.
    """
    alive = rays["gain"] > 0
    count = dr.width(rays["gain"])
    start = {
        "bounce": dr.zeros(UInt32, count),
        "origin": Array3f32(rays["origin"]),
        "direction": Array3f32(rays["direction"]),
        "active": alive,
        "distance": dr.zeros(Float32, count),
        "throughput": [dr.ones(Float32, count) for _ in range(wavelengths)],
        "radiance": [dr.zeros(Float32, count) for _ in range(wavelengths)],
        "region": dr.select(alive, UInt32(int(Region.DIRECT)), UInt32(int(Region.HOUSING))),
        "label": dr.full(UInt32, int(Label.HOUSING), count),
        "lit": dr.zeros(Bool, count),
        "normal": dr.zeros(Array3f32, count),
        "material": dr.zeros(UInt32, count),
    }

    def segment(path: dict[str, Any]) -> tuple[dict[str, Any]]:
        return (_segment(path, geometry, state, light),)

    return dr.while_loop((start,), lambda path: path["active"], segment)[0]  # type: ignore[no-any-return]


def _segment(path: dict[str, Any], geometry: Geometry, state: dict[str, Any], light: dict[str, Any]) -> dict[str, Any]:
    active, origin, direction = path["active"], path["origin"], path["direction"]
    hit = nearest(geometry, state, origin, direction, active)
    world_direction = turn(state["body"], direction)
    depth = -move(state["body"], origin).z
    added, throughput = scattered_in(light, path["throughput"], world_direction, depth, hit.distance)
    radiance = _plus(path["radiance"], added, active)

    at_mirror = active & (hit.label >= FIRST_MIRROR)
    at_surface = active & (hit.label == int(Label.SURFACE))
    sky, below_surface, passes = surface_light(light, throughput, world_direction)
    radiance = _plus(radiance, sky, at_surface)
    behind_mirror = mirror_throughput(light, throughput, -dr.dot(direction, hit.normal))
    throughput = [
        dr.select(at_surface, s, dr.select(at_mirror, m, t))
        for t, s, m in zip(throughput, below_surface, behind_mirror, strict=True)
    ]

    bounce = path["bounce"] + 1
    exhausted = active & (at_mirror | at_surface) & (bounce >= LARGEST_BOUNCE_COUNT)
    goes_on = (at_mirror | at_surface) & ~exhausted
    unseen = active & (path["label"] == int(Label.HOUSING))
    seen = unseen & (~goes_on | (at_surface & passes))
    label = dr.select(at_mirror, UInt32(int(Label.MIRROR)), hit.label)
    lit = active & ~at_mirror & ~at_surface & (hit.label != int(Label.OPEN_WATER))
    point = origin + direction * hit.distance
    reflected = reflect(direction, hit.normal)
    folded = at_mirror & (hit.label == FIRST_MIRROR) & (path["region"] == int(Region.DIRECT))
    gazed = at_mirror & (hit.label == FIRST_MIRROR + 1) & (path["region"] == int(Region.FOLD))
    return {
        "bounce": bounce,
        "origin": dr.select(goes_on, point + reflected * START_OFFSET_M, dr.select(lit, point, origin)),
        "direction": dr.select(goes_on, reflected, direction),
        "active": goes_on,
        "distance": dr.select(unseen, path["distance"] + hit.distance, path["distance"]),
        "throughput": throughput,
        "radiance": radiance,
        "region": dr.select(
            gazed, UInt32(int(Region.GAZE)), dr.select(folded, UInt32(int(Region.FOLD)), path["region"])
        ),
        "label": dr.select(seen, label, path["label"]),
        "lit": path["lit"] | lit,
        "normal": dr.select(lit, hit.normal, path["normal"]),
        "material": dr.select(lit, hit.material, path["material"]),
    }


def _with_lit_surfaces(
    path: dict[str, Any], geometry: Geometry, state: dict[str, Any], light: dict[str, Any]
) -> list[Any]:
    """Kernel: add what the Lambertian surfaces at the end of the paths send back."""
    lit, normal = path["lit"], path["normal"]
    world_normal = turn(state["body"], normal)
    faces_sun = lit & (dr.dot(world_normal, light["towards_sun"]) > 0)
    start = path["origin"] + normal * SHADOW_OFFSET_M
    in_sun = sunlit(geometry, state, start, light["towards_sun"], faces_sun)
    depth = -move(state["body"], path["origin"]).z
    surface = lit_surface(
        light, path["throughput"], normal=world_normal, depth=depth, material=path["material"], in_sun=in_sun
    )
    return _plus(path["radiance"], surface, lit)


def _plus(total: list[Any], added: list[Any], where: Any) -> list[Any]:
    return [t + dr.select(where, a, 0) for t, a in zip(total, added, strict=True)]
