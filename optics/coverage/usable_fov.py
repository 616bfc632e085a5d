"""Usable field of view: how much of the water a pose of the gaze mirror shows, and what takes the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.coverage.outcome import Outcome, by_outcome, by_region
from optics.coverage.pose_axes import PoseAxes
from optics.coverage.poses import trace_poses
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh
from optics.occlusion import Occluder
from optics.train import OpticalTrain
from rigs import Rig


@dataclass(frozen=True, kw_only=True)
class UsableFov:
    """Views of some poses: n of them, or a grid of n2 x n1.

    Attributes
    ----------
    q1_deg, q2_deg : arrays, shape (n,), or (n1,) and (n2,)
        Joint values.
    pixels : array, shape (..., len(Outcome))
        Number of cells of the image by their `Outcome`, pose by pose.
    solid_angle_by_outcome_sr : array, shape (..., len(Outcome))
        Their solid angle in the water.
    solid_angle_by_region_sr : array, shape (..., len(Region), len(Outcome))
        The same by region of the image and what the region shows there: SEEN is open water, a part what it hides.
    """

    q1_deg: FloatArray
    q2_deg: FloatArray
    pixels: NDArray[np.int64]
    solid_angle_by_outcome_sr: FloatArray
    solid_angle_by_region_sr: FloatArray

    @property
    def solid_angle_sr(self) -> FloatArray:
        """Solid angle seen over both mirrors, pose by pose."""
        return self.solid_angle_by_outcome_sr[..., Outcome.SEEN]


def usable_fov(
    rig: Rig,
    parts: Sequence[PartMesh],
    *,
    q1: ArrayLike,
    q2: ArrayLike,
    columns: int = 64,
    rows: int = 48,
) -> UsableFov:
    """Usable field of view of some poses.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh
        What blocks rays; empty for bare mirrors.
    q1, q2 : arrays, shape (n,)
        Joint values of each pose, radians.
    columns, rows : int
        Cells into which the image is divided; a cell counts by the ray of its centre.

    Raises
    ------
    ValueError
        For a rig without mirrors, joint values that are not finite or beyond their limits, or an empty grid.
    """
    q1, q2 = joint_values(rig, q1=q1, q2=q2)
    if q1.shape != q2.shape:
        raise ValueError(f"expected as many q1 as q2, got {q1.size} and {q2.size}")
    check_counts(columns=columns, rows=rows)
    layout = Layout.from_rig(rig)
    views = trace_poses(
        OpticalTrain.from_rig(rig, q1=float(q1[0]), q2=float(q2[0])),
        layout,
        {group: Occluder.of_group(parts, group) for group in Group},
        PoseAxes.of(layout, q1, q2),
        columns=columns,
        rows=rows,
    )
    return UsableFov(
        q1_deg=np.degrees(q1),
        q2_deg=np.degrees(q2),
        pixels=by_outcome(views.pixels),
        solid_angle_by_outcome_sr=by_outcome(views.solid_angle_sr),
        solid_angle_by_region_sr=by_region(views.solid_angle_sr),
    )


def joint_values(rig: Rig, *, q1: ArrayLike, q2: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Joint values as float64 arrays within the limits of a rig, or a `ValueError` that says what came."""
    layout = Layout.from_rig(rig)
    arrays = np.asarray(q1, dtype=np.float64), np.asarray(q2, dtype=np.float64)
    for name, array in zip(("q1", "q2"), arrays, strict=True):
        if array.ndim != 1 or array.size == 0 or not np.isfinite(array).all():
            raise ValueError(f"expected {name} of shape (n,), n > 0, finite, got {array}")
    for bound in (np.min, np.max):
        layout.check_joints(float(bound(arrays[0])), float(bound(arrays[1])))
    return arrays


def check_counts(**counts: int) -> None:
    """Raise a `ValueError` for a count that is not positive."""
    for name, count in counts.items():
        if count < 1:
            raise ValueError(f"expected {name} > 0, got {count}")
