"""Trees that grow into a cloud of points: the skeletons of sea fans and soft corals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optics.kernels.arrays import FloatArray
from optics.mesh import Triangles, joined_triangles
from scenes.surfaces.shapes import tubes

MOST_STEPS = 200
THINNEST_PER_STEP = 0.22
PIPE_EXPONENT = 2.6
"""A stem's radius to this power is the sum of its branches' (Murray: 3; da Vinci: 2)."""


@dataclass(frozen=True, kw_only=True)
class Tree:
    """Skeleton of a tree.

    Attributes
    ----------
    nodes_m : array, shape (n, 3)
        The root first, each node behind its parent.
    parent : array, shape (n,)
        -1 for the root.
    radius_m : array, shape (n,)
    """

    nodes_m: FloatArray
    parent: NDArray[np.int64]
    radius_m: FloatArray


def grown_tree(attractors_m: FloatArray, *, step_m: float) -> Tree:
    """Tree from the origin into a cloud of points by space colonisation.

    Every point pulls at the node nearest to it, every node that is pulled at grows a step in the mean direction, and a
    point that was reached pulls no more (Runions, Lane and Prusinkiewicz 2007, "Modeling trees with a space
    colonization algorithm").
    """
    nodes, parents = np.zeros((1, 3)), np.array([-1])
    remaining = attractors_m
    for _ in range(MOST_STEPS):
        distance, nearest = cKDTree(nodes).query(remaining)
        kept = distance > 2 * step_m
        remaining, nearest = remaining[kept], nearest[kept]
        if not len(remaining):
            break
        pulled, group = np.unique(nearest, return_inverse=True)
        pull = remaining - nodes[nearest]
        pull = pull / np.linalg.norm(pull, axis=1, keepdims=True)
        mean = np.stack([np.bincount(group, weights=column, minlength=len(pulled)) for column in pull.T], axis=-1)
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        grown = nodes[pulled] + step_m * mean / np.where(length > 0, length, 1)
        # Two points that pull a node to and fro would grow the same twig for ever.
        new = cKDTree(nodes).query(grown)[0] > 0.5 * step_m
        if not new.any():
            break
        nodes, parents = np.concatenate([nodes, grown[new]]), np.concatenate([parents, pulled[new]])
    return Tree(nodes_m=nodes, parent=parents, radius_m=_radii(parents, THINNEST_PER_STEP * step_m))


def _radii(parent: NDArray[np.int64], thinnest_m: float) -> FloatArray:
    load = np.zeros(len(parent))
    for node in range(len(parent) - 1, -1, -1):
        load[node] = load[node] or thinnest_m**PIPE_EXPONENT
        if parent[node] >= 0:
            load[parent[node]] += load[node]
    return load ** (1 / PIPE_EXPONENT)


def tree_surface(tree: Tree, sides: int) -> Triangles:
    """Closed tubes along the tree: one for each chain from a fork to a tip, along the thickest branch."""
    return joined_triangles(
        [tubes(tree.nodes_m[chain][np.newaxis], tree.radius_m[chain][np.newaxis], sides) for chain in _chains(tree)]
    )


def _chains(tree: Tree) -> list[list[int]]:
    heir = np.full(len(tree.parent), -1)
    for node in np.argsort(tree.radius_m, kind="stable"):
        if tree.parent[node] >= 0:
            heir[tree.parent[node]] = node
    chains = []
    for node, parent in enumerate(tree.parent):
        if (parent >= 0 and heir[parent] != node) or parent < 0 <= heir[node]:
            chain = [int(node)] if parent < 0 else [int(parent), int(node)]
            while heir[chain[-1]] >= 0:
                chain.append(int(heir[chain[-1]]))
            chains.append(chain)
    return chains
