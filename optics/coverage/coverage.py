"""Coverage: the part of the sphere around the robot that some pose of the gaze mirror shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.coverage.blockers import Occluders
from optics.coverage.outcome import Outcome, by_outcome, by_region
from optics.coverage.pose_axes import PoseAxes, Progress
from optics.coverage.poses import trace_poses
from optics.coverage.sphere import cell_directions, check_nside
from optics.coverage.sphere_views import see_sphere
from optics.coverage.usable_fov import UsableFov, check_counts, joint_values
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh
from optics.occlusion import Occluder
from optics.train import OpticalTrain
from rigs import Rig
from rigs.display import facts_table


@dataclass(frozen=True, kw_only=True)
class Coverage(UsableFov):
    """Views of a grid of n2 x n1 poses, and the sphere of directions they cover together.

    Attributes
    ----------
    nside : int
        Of the sphere of directions, whose cells `optics.coverage.sphere` numbers; all have the same solid angle.
    poses_by_outcome : array, shape (len(Outcome), cells)
        Number of poses whose mirrors point a ray of the camera at the centre of each cell of the sphere, by what that
        ray hits: open water (SEEN) or a part.
    pixels_per_degree : array, shape (cells,)
        Best resolution at which a pose sees each cell; zero where none does.
    """

    nside: int
    poses_by_outcome: NDArray[np.int64]
    pixels_per_degree: FloatArray

    @property
    def mean_solid_angle_sr(self) -> float:
        """Mean of the solid angle seen over both mirrors over the joint values' ranges, by the trapezoidal rule.

        A plain mean over the grid would count the ends of the ranges twice.
        """
        weights = np.outer(_trapezoid(self.q2_deg), _trapezoid(self.q1_deg))
        return float((weights * self.solid_angle_sr).sum())

    @property
    def poses_seeing(self) -> NDArray[np.int64]:
        """Number of poses that see each cell of the sphere: how long a search may dwell there; shape (cells,)."""
        seeing: NDArray[np.int64] = self.poses_by_outcome[Outcome.SEEN]
        return seeing

    @property
    def covered(self) -> NDArray[np.bool_]:
        """Cells of the sphere that some pose shows, shape (cells,)."""
        return self.poses_seeing > 0

    @property
    def covered_fraction(self) -> float:
        """Share of the whole sphere that some pose shows."""
        return float(self.covered.mean())

    @property
    def blind_fraction(self) -> float:
        """Share of the whole sphere that no pose shows."""
        return 1 - self.covered_fraction

    @property
    def upper_fraction(self) -> float:
        """Share of the upper hemisphere that some pose shows."""
        return self._covered_share(1)

    @property
    def lower_fraction(self) -> float:
        """Share of the lower hemisphere that some pose shows."""
        return self._covered_share(-1)

    def _repr_html_(self) -> str:
        poses = f"{len(self.q1_deg)} x {len(self.q2_deg)}"
        mean, most = 1e3 * self.mean_solid_angle_sr, 1e3 * self.solid_angle_sr.max()
        facts = [
            ("Poses (pan x tilt)", poses),
            ("Covered", f"{self.covered_fraction:.1%} of all directions"),
            ("Upper, lower hemisphere", f"{self.upper_fraction:.1%}, {self.lower_fraction:.1%}"),
            (
                "Usable solid angle",
                f"{mean:.1f} msr mean, {most:.1f} msr at most",
            ),
        ]
        return facts_table("Coverage", facts)

    def _covered_share(self, side: int) -> float:
        # The ring on the horizon belongs half to each hemisphere.
        weights = np.heaviside(side * cell_directions(self.nside)[:, 2], 0.5)
        return float((weights * self.covered).sum() / weights.sum())


def compute_coverage(
    rig: Rig,
    parts: Sequence[PartMesh],
    *,
    q1: ArrayLike,
    q2: ArrayLike,
    columns: int = 64,
    rows: int = 48,
    nside: int = 64,
    progress: Progress | None = None,
) -> Coverage:
    """Coverage of all pairs of the given joint values.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh
        What blocks rays; empty for bare mirrors.
    q1 : array, shape (n1,)
    q2 : array, shape (n2,)
        Joint values, radians.
    columns, rows : int
        Cells into which the image is divided.
    nside : int
        Fineness of the sphere of directions, a power of two: it has 12 nside^2 cells, at 64 of 0.92 degrees.
    progress : callable, optional
        Called with the number of poses done and their total.

    Raises
    ------
    ValueError
        For a rig without mirrors, joint values that are not finite or beyond their limits, or an empty grid.

    Notes
    -----
    A cell of the sphere is covered when some pose shows its centre: the centre's direction is traced back through both
    mirrors and the port to its pixel, and from there out again past all parts (`optics.coverage.sphere_views`).
    Directions are those of far away things: the centimetres between the poses' viewpoints are left out. The cells of
    the image do not matter to what is covered; they are what `pixels`, solid angles and resolution are counted in.
    `optics.coverage.convergence` says how far a result is off.
    """
    q1, q2 = joint_values(rig, q1=q1, q2=q2)
    check_counts(columns=columns, rows=rows)
    check_nside(nside)
    grid1, grid2 = np.meshgrid(q1, q2)
    layout = Layout.from_rig(rig)
    train = OpticalTrain.from_rig(rig, q1=float(q1[0]), q2=float(q2[0]))
    occluders = {group: Occluder.of_group(parts, group) for group in Group}
    axes = PoseAxes.of(layout, grid1.ravel(), grid2.ravel())
    views = trace_poses(train, layout, occluders, axes, columns=columns, rows=rows)
    sphere = see_sphere(train, layout, occluders, axes, columns=columns, rows=rows, nside=nside, progress=progress)
    by_region_sr = by_region(views.solid_angle_sr)
    return Coverage(
        q1_deg=np.degrees(q1),
        q2_deg=np.degrees(q2),
        pixels=by_outcome(views.pixels).reshape(*grid1.shape, -1),
        solid_angle_by_outcome_sr=by_outcome(views.solid_angle_sr).reshape(*grid1.shape, -1),
        solid_angle_by_region_sr=by_region_sr.reshape(*grid1.shape, *by_region_sr.shape[1:]),
        nside=nside,
        poses_by_outcome=sphere.poses_by_outcome,
        pixels_per_degree=sphere.pixels_per_degree,
    )


def covered_cells(
    rig: Rig,
    parts: Sequence[PartMesh] | Occluders,
    *,
    q1: ArrayLike,
    q2: ArrayLike,
    nside: int,
    cells: NDArray[np.int64] | None = None,
) -> NDArray[np.bool_]:
    """Which cells of the sphere some pair of the given joint values shows, as `compute_coverage`; no image is counted.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh, or mapping
        What blocks rays, or what is made of it for every group.
    q1, q2 : arrays, shape (n1,) and (n2,)
        Joint values, radians.
    nside : int
    cells : array of int, shape (n,), optional
        Those asked for; few of them take little time. By default all.

    Returns
    -------
    array of bool, shape (n,)
    """
    q1, q2 = joint_values(rig, q1=q1, q2=q2)
    check_nside(nside)
    grid1, grid2 = np.meshgrid(q1, q2)
    layout = Layout.from_rig(rig)
    views = see_sphere(
        OpticalTrain.from_rig(rig, q1=float(q1[0]), q2=float(q2[0])),
        layout,
        parts if isinstance(parts, Mapping) else {group: Occluder.of_group(parts, group) for group in Group},
        PoseAxes.of(layout, grid1.ravel(), grid2.ravel()),
        columns=1,
        rows=1,
        nside=nside,
        chosen=cells,
    )
    seen = views.poses_by_outcome[Outcome.SEEN] > 0
    return np.asarray(seen if cells is None else seen[cells])


def stepped_joints(rig: Rig, step_deg: float) -> tuple[FloatArray, FloatArray]:
    """Values of both joints from limit to limit, radians, in equal steps of at most `step_deg`."""
    if not 0 < step_deg < np.inf:
        raise ValueError(f"expected a step of the joints > 0 degrees, got {step_deg:g}")
    layout = Layout.from_rig(rig)
    q1, q2 = (
        # A range of whole steps must not gain one by rounding.
        joint.values(int(np.ceil((joint.max_deg - joint.min_deg) / step_deg - 1e-9)) + 1)
        for joint in (layout.pan, layout.tilt)
    )
    return q1, q2


def _trapezoid(values: FloatArray) -> FloatArray:
    """Weights of the trapezoidal rule over sorted values, with the sum 1; of a single value its own."""
    if len(values) == 1 or np.ptp(values) == 0:
        return np.full(len(values), 1 / len(values))
    return np.asarray(np.abs(np.gradient(values) * np.r_[0.5, np.ones(len(values) - 2), 0.5]) / np.ptp(values))
