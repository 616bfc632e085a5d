"""Coverage: the part of the sphere around the robot that some pose of the gaze mirror shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.analysis.fate import Fate
from optics.analysis.poses import Progress, trace_poses
from optics.analysis.usable_fov import check_counts, joint_values
from optics.arrays import FloatArray
from optics.mesh import PartMesh
from rigs import Rig


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """Views of a grid of n1 x n2 poses, and the sphere of directions they cover together.

    Attributes
    ----------
    q1_deg : array, shape (n1,)
    q2_deg : array, shape (n2,)
        Joint values.
    pixels : array, shape (n2, n1, len(Fate))
        Number of cells of the image by their `Fate`.
    solid_angle_by_fate_sr : array, shape (n2, n1, len(Fate))
        Their solid angle in the water.
    sphere : array, shape (rows, columns)
        How many pairs of a pose and a cell of the image look into each cell of the sphere; `optics.analysis.sphere`
        says where the cells are. All have the same solid angle.
    """

    q1_deg: FloatArray
    q2_deg: FloatArray
    pixels: NDArray[np.int64]
    solid_angle_by_fate_sr: FloatArray
    sphere: NDArray[np.int64]

    @property
    def solid_angle_sr(self) -> FloatArray:
        """Solid angle seen over both mirrors, shape (n2, n1)."""
        return self.solid_angle_by_fate_sr[..., Fate.SEEN]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """Cells of the sphere that some pose shows, shape (rows, columns)."""
        return self.sphere > 0

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
        return float(self.covered[len(self.sphere) // 2 :].mean())

    @property
    def lower_fraction(self) -> float:
        """Share of the lower hemisphere that some pose shows."""
        return float(self.covered[: len(self.sphere) // 2].mean())


def coverage(
    rig: Rig,
    parts: Sequence[PartMesh],
    *,
    q1: ArrayLike,
    q2: ArrayLike,
    columns: int = 64,
    rows: int = 48,
    sphere: tuple[int, int] = (360, 180),
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
    sphere : (int, int)
        Columns (azimuth) and rows (sine of the elevation, even) of the sphere of directions.
    progress : callable, optional
        Called with the number of poses done and their total.

    Raises
    ------
    ValueError
        For a rig without mirrors, joint values that are not finite or beyond their limits, or an empty grid.

    Notes
    -----
    A cell of the sphere is covered when the centre of a cell of the image looks into it. Directions count as seen
    from far away: the centimetres between the poses' viewpoints are left out. The rule leaves false holes where rays
    are fewer than cells of the sphere, and counts cells at the rim as wholly covered. The defaults (cells of the image
    and of the sphere both about 0.8 degrees wide) suit some 90 x 90 poses; with few poses take a coarser sphere or
    more rays.
    """
    q1, q2 = joint_values(rig, q1=q1, q2=q2)
    check_counts(columns=columns, rows=rows, sphere_columns=sphere[0], sphere_rows=sphere[1])
    if sphere[1] % 2:
        raise ValueError(f"expected an even number of rows of the sphere, got {sphere[1]}")
    grid1, grid2 = np.meshgrid(q1, q2)
    views = trace_poses(
        rig, parts, q1=grid1.ravel(), q2=grid2.ravel(), columns=columns, rows=rows, sphere=sphere, progress=progress
    )
    return Coverage(
        q1_deg=np.degrees(q1),
        q2_deg=np.degrees(q2),
        pixels=views.pixels.reshape(*grid1.shape, len(Fate)),
        solid_angle_by_fate_sr=views.solid_angle_sr.reshape(*grid1.shape, len(Fate)),
        sphere=views.sphere,
    )
