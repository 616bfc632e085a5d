"""A solid as small cubes of elastic material: its stiffness between what holds it and what it holds.

Each cube is an eight-node element with incompatible modes (Wilson 1973; Taylor, Beresford & Wilson 1976, Int. J.
Numerical Methods in Engineering 10, 1211), which bends as a beam does even when it is one cube thick. A cube that the
surface cuts has the stiffness of its filled part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from itertools import product

import manifold3d
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

BoolArray = NDArray[np.bool_]

POISSON_RATIO = 0.36
"""Of ABS and its like, nominal; bending hardly depends on it."""
SAMPLES = 4
"""Points per cube's edge that are asked whether they are inside."""
LEAST_FILL = 0.25
"""Cubes filled by less are left out: they would hang on by a corner."""
CORNERS = np.array(list(product((0, 1), repeat=3)))
"""Corners of a cube in units of its edge, x slowest."""


@dataclass(frozen=True, kw_only=True)
class Voxels:
    """Cubes of a solid.

    Attributes
    ----------
    edge_m : float
        Edge of a cube.
    cells : array, shape (n, 3)
        Indices of the cubes.
    fill : array, shape (n,)
        Filled part of each.
    origin_m : array, shape (3,)
        Lowest corner of the cube (0, 0, 0).
    """

    edge_m: float
    cells: NDArray[np.int64]
    fill: FloatArray
    origin_m: FloatArray

    @property
    def corners(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """Positions of all corners, shape (m, 3), and each cube's eight of them, shape (n, 8)."""
        every = (self.cells[:, None, :] + CORNERS).reshape(-1, 3)
        unique, owner = np.unique(every, axis=0, return_inverse=True)
        return self.origin_m + self.edge_m * unique, owner.reshape(-1, 8)


def voxelise(vertices_m: FloatArray, faces: NDArray[np.int32], edge_m: float) -> Voxels:
    """Fill a closed surface with cubes of a given edge; `ValueError` for one too thin to hold any."""
    low, high = vertices_m.min(axis=0), vertices_m.max(axis=0)
    counts = np.ceil((high - low) / edge_m).astype(int)
    # Half a cube of margin on either side, shared evenly.
    origin = (low + high - counts * edge_m) / 2
    x, y, z = (origin[axis] + edge_m / SAMPLES * (np.arange(SAMPLES * counts[axis]) + 0.5) for axis in range(3))
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(np.ascontiguousarray(vertices_m), np.ascontiguousarray(faces, dtype=np.uint64))
    )
    inside = np.zeros(SAMPLES * counts, dtype=bool)
    for level, height in enumerate(z):
        inside[:, :, level] = _within(solid.slice(height).to_polygons(), x, y)
    nx, ny, nz = counts
    fill = inside.reshape(nx, SAMPLES, ny, SAMPLES, nz, SAMPLES).mean(axis=(1, 3, 5))
    cells = np.argwhere(fill >= LEAST_FILL)
    if not len(cells):
        raise ValueError(f"expected a solid thicker than {1000 * edge_m:g} mm, got none of its cubes filled")
    return Voxels(edge_m=edge_m, cells=cells, fill=fill[tuple(cells.T)], origin_m=origin)


def _within(outlines: Iterable[FloatArray], x: FloatArray, y: FloatArray) -> BoolArray:
    """Which places of a grid are within outlines, shape (len(x), len(y)); an outline within an outline is a hole.

    Along a line of one x, each edge that is crossed leads in or out.
    """
    crossed = np.zeros((len(x), len(y) + 1), dtype=np.int64)
    for outline in outlines:
        start, end = np.asarray(outline), np.roll(outline, -1, axis=0)
        backwards = start[:, :1] > end[:, :1]
        left, right = np.where(backwards, end, start), np.where(backwards, start, end)
        first, last = np.searchsorted(x, left[:, 0]), np.searchsorted(x, right[:, 0])
        edge = np.repeat(np.arange(len(left)), last - first)
        line = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - last, last - first)
        rise = (right - left)[edge]
        at = left[edge, 1] + (x[line] - left[edge, 0]) * rise[:, 1] / rise[:, 0]
        np.add.at(crossed, (line, np.searchsorted(y, at)), 1)
    return np.asarray(crossed[:, :-1].cumsum(axis=1) % 2 == 1)


def condensed_stiffness(
    voxels: Voxels,
    modulus_pa: float,
    *,
    held: Callable[[FloatArray], BoolArray],
    loaded: Callable[[FloatArray], BoolArray],
    point_m: FloatArray,
) -> FloatArray:
    """Stiffness against moving one rigid patch of a solid while another is held.

    Parameters
    ----------
    voxels : Voxels
    modulus_pa : float
        Young's modulus.
    held, loaded : callable
        From corner positions, shape (m, 3), to whether they are in the patch that is held still, or moves as one.
    point_m : array, shape (3,)
        Where the moving patch's translation is measured; its turns are about this point.

    Returns
    -------
    array, shape (6, 6)
        Force and moment over translation and turn, N/m, N, N m.

    Raises
    ------
    ValueError
        When one of the patches holds fewer than three corners.
    """
    positions, owners = voxels.corners
    still, moving = held(positions), loaded(positions)
    moving = moving & ~still
    for name, corners in (("held", still), ("loaded", moving)):
        if np.count_nonzero(corners) < 3:
            raise ValueError(f"expected at least three corners in the {name} patch, got {np.count_nonzero(corners)}")
    stiffness = _assembled(voxels, owners, len(positions), modulus_pa)
    free = np.flatnonzero(np.repeat(~still & ~moving, 3))
    patch = np.flatnonzero(np.repeat(moving, 3))
    rigid = _rigid_motions(positions[moving] - point_m)
    to_patch = stiffness[free][:, patch] @ rigid
    answer = spl.splu(stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    whole = rigid.T @ (stiffness[patch][:, patch] @ rigid) - to_patch.T @ answer.solve(to_patch)
    return np.asarray((whole + whole.T) / 2)


def _assembled(voxels: Voxels, owners: NDArray[np.int64], count: int, modulus_pa: float) -> sp.csr_matrix:
    degrees = (3 * owners[:, :, None] + np.arange(3)).reshape(-1, 24)
    rows = np.repeat(degrees, 24, axis=1).ravel()
    columns = np.tile(degrees, (1, 24)).ravel()
    values = (modulus_pa * voxels.edge_m * voxels.fill[:, None] * _unit_stiffness().ravel()).ravel()
    return sp.csr_matrix((values, (rows, columns)), shape=(3 * count, 3 * count))


def _rigid_motions(arms: FloatArray) -> FloatArray:
    """Displacements, shape (3 n, 6), of points at `arms` under unit translations and unit turns."""
    motions = np.zeros((len(arms), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for axis in range(3):
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arms)
    return motions.reshape(-1, 6)


@cache
def _unit_stiffness() -> FloatArray:
    """Stiffness of a cube of unit edge and unit modulus, shape (24, 24), its nine inner modes condensed."""
    elastic = _elasticity()
    points = (-1 / np.sqrt(3), 1 / np.sqrt(3))
    outer, mixed, inner = np.zeros((24, 24)), np.zeros((9, 24)), np.zeros((9, 9))
    signs = 2 * CORNERS - 1
    for place in product(points, repeat=3):
        factors = 1 + signs * place
        gradients = np.empty((8, 3))
        for axis in range(3):
            others = [other for other in range(3) if other != axis]
            # In units of the cube's edge, which is twice that of its natural coordinates.
            gradients[:, axis] = 2 * signs[:, axis] * factors[:, others].prod(axis=1) / 8
        strain = np.hstack([_strain(gradient) for gradient in gradients])
        # The modes 1 - x^2, 1 - y^2, 1 - z^2 in natural coordinates.
        bubbles = np.hstack([_strain(2 * -2 * place[axis] * np.eye(3)[axis]) for axis in range(3)])
        weight = 1 / 8
        outer += weight * strain.T @ elastic @ strain
        mixed += weight * bubbles.T @ elastic @ strain
        inner += weight * bubbles.T @ elastic @ bubbles
    return np.asarray(outer - mixed.T @ np.linalg.solve(inner, mixed))


def _strain(gradient: FloatArray) -> FloatArray:
    """Strain (xx, yy, zz, yz, zx, xy) of a shape function's displacement, shape (6, 3)."""
    x, y, z = gradient
    return np.array([[x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0]])


def _elasticity() -> FloatArray:
    """Isotropic stiffness for unit modulus, shape (6, 6)."""
    shear = 1 / (2 * (1 + POISSON_RATIO))
    lame = POISSON_RATIO / ((1 + POISSON_RATIO) * (1 - 2 * POISSON_RATIO))
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = lame
    matrix[np.diag_indices(3)] += 2 * shear
    matrix[3:, 3:] = shear * np.eye(3)
    return matrix
