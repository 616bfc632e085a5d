"""Coarse scores of many designs at once: one lane for each design, pose and ray of the camera.

The mirrors are bare plates, the hull is triangles. Brackets, yoke and servos are left out: their shapes follow the
design and would have to be built for each. The rays behind the port are the same for all designs and traced once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.coverage.sphere import cell_count, cell_of
from optics.kernels.arrays import FloatArray, aligned, opaque, opaque_vector, to_columns
from optics.kernels.backend import Array3f64, Bool, Float64, UInt32, dr
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.mirror import Hit, MirrorPlane, intersect, reflect_over
from optics.mirror_outline import OUTLINES
from optics.occlusion import Occluder, blocks
from optics.search.objectives import (
    D1,
    D2,
    SIDES,
    Objective,
    area_cm2,
    swept_volume_l,
)
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

INTERLEAVED = 7
"""Neighbouring poses take other rays: the image is divided this many times as finely, and a pose takes every seventh
column and row, beginning with its own number. What one pose skips its neighbours see: fewer false holes, and M1's
edges, which stand still in the image, are known to a seventh of the distance between a pose's rays."""


@dataclass(frozen=True, kw_only=True)
class Grid:
    """How coarse a score is.

    Parameters
    ----------
    pan_steps, tilt_steps : int
        Values of each joint over its range; the gaze moves twice as far as the tilt.
    columns, rows : int
        Rays of a pose over the image.
    nside : int
        Of the sphere into whose cells directions are sorted (`optics.coverage.sphere`); 16: 13 square degrees each.
    """

    pan_steps: int = 17
    tilt_steps: int = 33
    columns: int = 32
    rows: int = 24
    nside: int = 16

    @property
    def poses(self) -> int:
        """Number of poses."""
        return self.pan_steps * self.tilt_steps

    @property
    def rays(self) -> int:
        """Number of rays of a pose."""
        return self.columns * self.rows


LANES_PER_LAUNCH = 1 << 24

SOFTNESS_M = 0.003
"""Width over which a soft mirror's edge fades: about the distance between rays on M2."""

SKIN_M = 1e-4
"""Occlusion rays start this far from a mirror, as in `optics.coverage.field`."""


class CoarseScorer:
    """Scores designs of one rig.

    Parameters
    ----------
    rig : Rig
        With mirrors; its free numbers do not matter.
    parts : sequence of PartMesh
        The hull is taken from them.
    grid : Grid, optional
    """

    def __init__(self, rig: Rig, parts: Sequence[PartMesh], grid: Grid | None = None):
        self.grid = grid = grid or Grid()
        gaze = rig.require_gaze()
        layout = Layout.from_rig(rig)
        self.rig = rig
        self.outlines = tuple(OUTLINES[each.outline] for each in (gaze.fold_mirror, gaze.gaze_mirror))
        self.layout = layout
        self.occluder = Occluder([part for part in parts if part.role is Role.HULL and part.group is Group.FIXED])
        train = OpticalTrain.bare(rig)
        pixels = pixel_grid(train.camera, grid.columns * INTERLEAVED, grid.rows * INTERLEAVED)
        rays = train.trace(pixels).moved(layout.body_from_camera)
        self.seen = rays.passed
        if not self.seen.any():
            raise ValueError(f"expected a port through which the camera of {rig.name!r} sees the water")
        self.origin_m, self.direction = rays.origin_m, rays.direction
        self.pixels_per_ray = train.camera.width_px * train.camera.height_px / grid.rays
        q1, q2 = layout.pan.values(grid.pan_steps), layout.tilt.values(grid.tilt_steps)
        _, body_from_m2 = layout.moving_frames(np.tile(q1, len(q2)), np.repeat(q2, len(q1)))
        self.m2_axes = body_from_m2[:, :3, :3]
        # Trapezoidal rule: the ends of a joint's range stand for half a step. Whole numbers, so that sums are exact
        # and a design scores the same among others as alone.
        tilt, pan = (np.where(np.arange(count) % (count - 1), 2, 1) for count in (grid.tilt_steps, grid.pan_steps))
        self.pose_weight = np.outer(tilt, pan).ravel()

    def scores(self, designs: FloatArray, objectives: Sequence[Objective]) -> FloatArray:
        """Scores of designs, shape (n, 6), by objective: shape (n, k); NaN for designs that show nothing."""
        coverage, resolution = self._views(designs)
        columns = {
            "coverage": coverage,
            "area": area_cm2(self.rig, designs),
            "swept-volume": swept_volume_l(self.rig, designs),
            "resolution": resolution,
        }
        scores = np.stack([columns[objective.name] for objective in objectives], axis=1)
        # Mirrors that show nothing would be the smallest.
        scores[resolution == 0] = np.nan
        return scores

    def _views(self, designs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Covered share of the sphere and mean number of gaze pixels, each of shape (n,)."""
        lanes = self.grid.poses * self.grid.rays
        step = max(1, LANES_PER_LAUNCH // lanes)
        coverage, resolution = np.zeros(len(designs)), np.zeros(len(designs))
        for first in range(0, len(designs), step):
            some = designs[first : first + step]
            lane = dr.arange(UInt32, len(some) * lanes)
            _, (m1, m2) = self._over_mirrors(some, lane)
            passed = dr.compress(dr.gather(Bool, Bool(self.seen), self._lanes(lane)[2]) & m1.front & m2.front)
            # Dr.Jit has no arrays of width 0.
            if len(passed):
                coverage[first : first + step], resolution[first : first + step] = self._seen(some, passed)
        return coverage, resolution

    def _seen(self, designs: FloatArray, lane: Any) -> tuple[FloatArray, FloatArray]:
        """`_views` of some designs, from those of their lanes that pass both mirrors: a sixth of all."""
        cells = cell_count(self.grid.nside)
        design, pose, _ = self._lanes(lane)
        mirrors, (m1, m2) = self._over_mirrors(designs, lane)
        # M1's plate may stand in the way behind M2, whichever of its faces is hit.
        again = intersect(mirrors[0], m2.point, m2.direction)
        free = ~(again.front | again.back)
        free = free & ~self._hidden(m1, m2, free)
        touched = dr.zeros(UInt32, len(designs) * cells)
        counts = dr.zeros(UInt32, len(designs) * self.grid.poses)
        dr.scatter(touched, UInt32(1), design * cells + cell_of(m2.direction, opaque(self.grid.nside)), free)
        dr.scatter_add(counts, UInt32(1), design * self.grid.poses + pose, free)
        dr.eval(touched, counts)
        counted = np.array(counts, dtype=np.int64).reshape(len(designs), -1)
        return np.array(touched).reshape(len(designs), cells).mean(axis=1), self._mean(counted)

    def _over_mirrors(self, designs: FloatArray, lane: Any) -> tuple[tuple[MirrorPlane, MirrorPlane], list[Hit]]:
        """Kernel: M1 and M2 of each lane, and where its ray hits them."""
        design, pose, ray = self._lanes(lane)
        mirrors = self._mirrors(self._numbers(designs), design, pose)
        return mirrors, reflect_over(mirrors, *self._rays(ray))

    def _mean(self, rays: NDArray[Any]) -> FloatArray:
        """Pixels, mean over the joint ranges, of rays counted by design and pose."""
        return np.asarray(self.pixels_per_ray * (rays * self.pose_weight).sum(axis=1) / self.pose_weight.sum())

    def soft_resolution_derivatives(self, designs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Resolution with soft mirror edges and without the hull, and its derivatives by the design.

        Counting rays has no derivative; with edges that fade over `SOFTNESS_M` it has one. Dr.Jit differentiates
        forward, one free number at a time, so that every sum is made in a fixed order and a seed gives the same bytes.

        Returns
        -------
        value : array, shape (n,)
            Pixels.
        derivatives : array, shape (n, 6)
            Pixels per millimetre.
        """
        shape = (len(designs), self.grid.poses, self.grid.rays)

        def total(lanes: Any) -> FloatArray:
            return self._mean(np.array(lanes).reshape(shape).sum(axis=2))

        derivatives = np.zeros(designs.shape)
        value = np.zeros(len(designs))
        for parameter in range(designs.shape[1]):
            numbers = self._numbers(designs)
            dr.enable_grad(numbers[parameter])
            design, pose, ray = self._lanes(dr.arange(UInt32, len(designs) * self.grid.poses * self.grid.rays))
            mirrors = self._mirrors(numbers, design, pose)
            m1, m2 = reflect_over([replace(mirror, outline=None) for mirror in mirrors], *self._rays(ray))
            facing = dr.gather(Bool, Bool(self.seen), ray) & m1.front & m2.front
            passed = dr.select(facing, _soft(mirrors[0], m1) * _soft(mirrors[1], m2), 0)
            dr.set_grad(numbers[parameter], 1e-3)
            dr.forward_to(passed)
            derivatives[:, parameter] = total(dr.grad(passed))
            value = total(dr.detach(passed))
        return value, derivatives

    def _lanes(self, lane: Any) -> tuple[Any, Any, Any]:
        """Kernel: design, pose and ray of lanes by their number, the rays of a pose side by side."""
        # Literal divisors: Dr.Jit then multiplies and shifts, where a division took half of a score's time.
        poses, rays, columns, pans = self.grid.poses, self.grid.rays, self.grid.columns, self.grid.pan_steps
        rest = lane // rays
        pose, cell = rest % poses, lane - rest * rays
        column = cell % columns * INTERLEAVED + pose % pans % INTERLEAVED
        row = cell // columns * INTERLEAVED + pose // pans % INTERLEAVED
        return rest // poses, pose, row * (columns * INTERLEAVED) + column

    def _numbers(self, designs: FloatArray) -> list[Any]:
        """Columns of the designs, metres."""
        return to_columns(designs / 1000)

    def _mirrors(self, numbers: list[Any], design: Any, pose: Any) -> tuple[MirrorPlane, MirrorPlane]:
        """Kernel: M1 and M2 of each lane."""
        d1, d2 = (dr.gather(Float64, numbers[index], design) for index in (D1, D2))
        half = [dr.gather(Float64, number, design) * 0.5 for number in numbers]
        rotation = self.layout.body_from_camera.rotation
        pinhole = opaque_vector(self.layout.body_from_camera.translation)
        m1_centre = pinhole + opaque_vector(rotation.apply([0.0, 0.0, 1.0])) * d1
        m2_centre = m1_centre + opaque_vector(rotation.apply(self.layout.fold_direction)) * d2
        axes = self.layout.body_from_m1.rotation.as_matrix().T
        of_m1, of_m2 = (
            outline(half_width=half[width], half_height=half[height])
            for outline, (width, height) in zip(self.outlines, SIDES, strict=True)
        )
        x, y, normal = (opaque_vector(axis) for axis in axes)
        m1 = MirrorPlane(point=m1_centre, x=x, y=y, normal=normal, outline=of_m1)
        columns = [Float64(aligned(column, np.float64)) for column in self.m2_axes.transpose(0, 2, 1).reshape(-1, 9).T]
        turned = [dr.gather(Float64, column, pose) for column in columns]
        x, y, normal = (Array3f64(*turned[k : k + 3]) for k in (0, 3, 6))
        m2 = MirrorPlane(point=m2_centre, x=x, y=y, normal=normal, outline=of_m2)
        return m1, m2

    def _rays(self, ray: Any) -> tuple[Any, Any]:
        """Kernel: origin and direction of each lane's ray behind the port."""
        origin, direction = (Array3f64(*to_columns(array)) for array in (self.origin_m, self.direction))
        return dr.gather(Array3f64, origin, ray), dr.gather(Array3f64, direction, ray)

    def _hidden(self, m1: Hit, m2: Hit, active: Any) -> Any:
        """Kernel: whether the hull stands between the mirrors or behind M2 in a ray's way."""
        hull = self.occluder.parameters()
        between = m1.direction  # unit: reflections keep lengths
        first = blocks(hull, m1.point + between * SKIN_M, between, m2.distance - 2 * SKIN_M, active)
        last = blocks(hull, m2.point + m2.direction * SKIN_M, m2.direction, dr.inf, active & ~first)
        return first | last


def _soft(mirror: MirrorPlane, hit: Hit) -> Any:
    """Kernel: 1 well inside an outline, 0 well outside, a logistic step of `SOFTNESS_M` at the edge."""
    assert mirror.outline is not None
    # The hyperbolic tangent is the logistic step without an exponential that overflows, and its derivative with it.
    steps = [0.5 - 0.5 * dr.tanh(distance / (2 * SOFTNESS_M)) for distance in mirror.outline.beyond(*hit.local)]
    return prod(steps[1:], start=steps[0])
