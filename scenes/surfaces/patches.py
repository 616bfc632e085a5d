"""Patches of several kinds on a mesh, with borders that cross its faces as smooth lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from optics.kernels.arrays import FloatArray

NEAREST_END = 0.1
"""An edge is cut no nearer to its end than this share of it, so that no triangle becomes a splinter."""


@dataclass(frozen=True, kw_only=True)
class Patches:
    """A mesh whose faces were cut so that each is of one kind.

    Attributes
    ----------
    faces : array, shape (m, 3)
        Old vertices keep their numbers, new ones follow.
    kind : array, shape (m,)
        Column of the scores that is the largest there.
    weights : sparse array, shape (k, n)
        Of the old vertices in each new one; rows add up to 1.
    """

    faces: NDArray[np.int32]
    kind: NDArray[np.int64]
    weights: csr_array

    def over(self, values: FloatArray) -> FloatArray:
        """Values at the old vertices, shape (n,) or (n, k), and after them at the new ones, linear between old ones."""
        return np.concatenate([values, self.weights @ values])


def patches(faces: NDArray[np.int32], scores: FloatArray) -> Patches:
    """Cut faces where another kind takes over: each corner is of the kind with its largest score.

    An edge between two kinds is cut where their scores, linear along it, are equal; so neighbours are cut at the same
    points. In a face with three kinds the borders meet at its middle.

    Parameters
    ----------
    faces : array, shape (m, 3)
    scores : array, shape (n, k)
        Of each kind at each vertex.
    """
    kind = scores.argmax(axis=1)
    corners = kind[faces]
    kinds = 1 + (np.diff(np.sort(corners, axis=1), axis=1) > 0).sum(axis=1)
    two, three = faces[kinds == 2], faces[kinds == 3]
    # The corner that is alone with its kind comes first.
    alone = (corners[kinds == 2][:, :, np.newaxis] == corners[kinds == 2][:, np.newaxis]).sum(axis=2) == 1
    a, b, c = np.take_along_axis(two, (alone.argmax(axis=1)[:, np.newaxis] + np.arange(3)) % 3, axis=1).T
    d, e, f = three.T
    crossed = np.sort(np.concatenate([np.stack(edge, axis=1) for edge in ((a, b), (a, c), (d, e), (e, f), (f, d))]))
    edges, number = np.unique(crossed, axis=0, return_inverse=True)
    on_edge = (len(scores) + number).astype(np.int32)
    ab, ac = on_edge[: 2 * len(two)].reshape(2, -1)
    de, ef, fd = on_edge[2 * len(two) :].reshape(3, -1)
    middle = (len(scores) + len(edges) + np.arange(len(three))).astype(np.int32)
    parts = [
        (faces[kinds == 1].T, kind[faces[kinds == 1, 0]]),
        *(((a, ab, ac), kind[a]), ((ab, b, c), kind[b]), ((ab, c, ac), kind[b])),
        *(((d, de, middle), kind[d]), ((d, middle, fd), kind[d])),
        *(((e, ef, middle), kind[e]), ((e, middle, de), kind[e])),
        *(((f, fd, middle), kind[f]), ((f, middle, ef), kind[f])),
    ]
    return Patches(
        faces=np.concatenate([np.stack(corner, axis=1) for corner, _ in parts]),
        kind=np.concatenate([each for _, each in parts]),
        weights=_weights(edges, _shares(edges, scores, kind), three, len(scores)),
    )


def _shares(edges: NDArray[np.int32], scores: FloatArray, kind: NDArray[np.int64]) -> FloatArray:
    """How far along each edge, shape (e, 2), the kind of its second end takes over."""
    first, second = kind[edges].T
    lead, lag = (scores[end, first] - scores[end, second] for end in edges.T)
    return np.asarray(np.clip(lead / (lead - lag), NEAREST_END, 1 - NEAREST_END))


def _weights(edges: NDArray[np.int32], share: FloatArray, three: NDArray[np.int32], count: int) -> csr_array:
    """Of the old vertices in the points on edges, and after them in the middles of faces with three kinds."""
    weights = np.concatenate([np.stack([1 - share, share], axis=1).ravel(), np.full(three.size, 1 / 3)])
    columns = np.concatenate([edges.ravel(), three.ravel()])
    starts = np.concatenate([np.arange(len(edges)) * 2, edges.size + np.arange(len(three) + 1) * 3])
    return csr_array((weights, columns, starts), shape=(len(starts) - 1, count))
