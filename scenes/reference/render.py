"""Reference frames: the camera's rays into the scene, one estimate for every three wavelengths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.camera import Camera, camera_from_spec
from optics.kernels.backend import Array3f32, Float32, Float64, dr, mi
from optics.mesh import PartMesh
from rigs import Rig
from scenes.reference.estimate import RayMaker, estimate, launches
from scenes.reference.scene import reference_scene
from scenes.stage.scene import Scene

Progress = Callable[[int, int], None]
"""Called with the launches done and to do."""

NODES = 3
"""Wavelengths that Mitsuba carries at a time."""


@dataclass(frozen=True, kw_only=True)
class ReferenceFrame:
    """One image by path tracing; arrays of shape (height, width, 3).

    Attributes
    ----------
    radiance : float64
        In front of the lens, W / (m^2 sr nm), averaged over each channel's band, as in `scenes.stage.frame.Frame`.
    standard_error : float64
        Of the radiance, from the spread of the pixel's own samples; errors of different pixels are independent.
    """

    radiance: NDArray[np.float64]
    standard_error: NDArray[np.float64]


def render_reference(
    rig: Rig,
    parts: Sequence[PartMesh],
    scene: Scene,
    *,
    q1: float = 0.0,
    q2: float = 0.0,
    width_px: int | None = None,
    height_px: int | None = None,
    samples: int = 64,
    seed: int = 0,
    world_from_body: RigidTransform | None = None,
    world_from_target: RigidTransform | None = None,
    progress: Progress | None = None,
) -> ReferenceFrame:
    """Render one frame with stock Mitsuba `volpathmis`; the arguments are those of the fast renderer.

    Parameters
    ----------
    samples : int
        Independent paths per pixel and group of three wavelengths, at least 2.
    seed : int
        The same seed gives the same numbers on the same kind of machine.
    progress : callable, optional
        Called with the number of launches done and in all.

    Raises
    ------
    ValueError
        Outside the joint limits, or for a size or a number of samples that is too small.
    """
    camera = camera_from_spec(rig.camera)
    rows, columns = height_px or camera.height_px, width_px or camera.width_px
    pixels = rows * columns
    bands = scene.light.bands
    groups = [slice(first, first + NODES) for first in range(0, len(bands.wavelength_nm), NODES)]
    done = _Counter(len(groups) * len(launches(pixels, samples)), progress)
    radiance, variance = np.zeros((2, pixels, 3))
    for position, group in enumerate(groups):
        staged = reference_scene(
            rig,
            parts,
            scene,
            q1=q1,
            q2=q2,
            columns=group,
            world_from_body=scene.world_from_body if world_from_body is None else world_from_body,
            world_from_target=world_from_target,
        )
        part = estimate(
            staged.scene,
            camera_rays(camera, staged.scene_from_camera, columns, rows),
            medium=staged.start_medium,
            weight=bands.weight[:, group],
            pixels=pixels,
            samples=samples,
            seed=(seed, position),
            after_launch=done.step,
        )
        radiance = radiance + part.mean
        variance = variance + part.variance
    shape = (rows, columns, 3)
    return ReferenceFrame(radiance=radiance.reshape(shape), standard_error=np.sqrt(variance).reshape(shape))


def camera_rays(camera: Camera, scene_from_camera: RigidTransform, columns: int, rows: int) -> RayMaker:
    """Rays from the pinhole through random points of pixels, row by row; any camera model, distortion included."""
    kind, distorted = camera.kind
    parameters = camera.parameters()
    pose = scene_from_camera.as_matrix()
    axes = [Array3f32(*(dr.opaque(Float32, float(value)) for value in row[:3])) for row in pose[:3]]
    eye = mi.Point3f(*(dr.opaque(Float32, float(value)) for value in pose[:3, 3]))
    step_u, step_v = (
        dr.opaque(Float64, full / count) for full, count in ((camera.width_px, columns), (camera.height_px, rows))
    )

    def rays(pixel: Any, sampler: Any) -> Any:
        row = pixel // columns
        column = pixel - row * columns
        offset = sampler.next_2d()
        u = (Float64(column) + Float64(offset.x)) * step_u - 0.5
        v = (Float64(row) + Float64(offset.y)) * step_v - 0.5
        direction, _ = kind.direction(parameters, distorted, u, v)
        looking = Array3f32(direction)
        return mi.RayDifferential3f(eye, mi.Vector3f(*(dr.dot(axis, looking) for axis in axes)))

    return rays


class _Counter:
    """Reports how many of all launches are done."""

    def __init__(self, total: int, progress: Progress | None):
        self.done, self.total, self.progress = 0, total, progress

    def step(self) -> None:
        self.done += 1
        if self.progress is not None:
            self.progress(self.done, self.total)
