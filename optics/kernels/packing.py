"""Numbers as the kernels take them: many in one array, and tables that are read row by row.

A frame has hundreds of numbers, and handing over each by itself costs more than a small frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import aligned, aligned_room
from optics.kernels.backend import Array3f32, ArrayXf32, Float32, dr
from optics.kernels.trees import Structure, leaves_of, structure_of

AT_ONCE = 8
"""Numbers of a record that are read together."""

Tree = TypeVar("Tree")


@dataclass(frozen=True)
class Packing:
    """Order of the numbers of a record; hashable, so that a kernel is compiled for it once.

    Numbers are the leaves of a tree (`optics.kernels.trees`): arrays on the host, Dr.Jit's numbers in a kernel.

    Attributes
    ----------
    structure : Structure
        Of the tree.
    shapes : tuple of shapes
        Of its leaves.
    """

    structure: Structure
    shapes: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, tree: Any, *, batched: bool = False) -> Packing:
        """Packing that fits a tree; of a batch, the first axis of each array are the records."""
        return cls(structure_of(tree), tuple(np.shape(leaf)[batched:] for leaf in leaves_of(tree)))

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """How many numbers each leaf has."""
        return tuple(math.prod(shape) for shape in self.shapes)

    @cached_property
    def width(self) -> int:
        """Numbers of a record, which is filled up to a multiple of what is read at once."""
        return -(-sum(self.counts) // AT_ONCE) * AT_ONCE

    def records(self, tree: Any, count: int = 1) -> NDArray[np.float32]:
        """Numbers in their order, shape (count, width)."""
        found = [np.asarray(leaf).reshape(count, -1) for leaf in leaves_of(tree)]
        counts = tuple(each.shape[1] for each in found)
        if counts != self.counts:
            raise ValueError(f"expected numbers {self.counts}, got {counts}")
        result = np.zeros((count, self.width), dtype=np.float32)
        np.concatenate(found, axis=1, out=result[:, : sum(counts)], casting="same_kind")
        return result

    def upload(self, tree: Any, count: int = 1) -> Any:
        """Records, one after the other, as a kernel takes them."""
        return Float32(aligned(self.records(tree, count), np.float32))

    def unpack(self, packed: Any, record: Any) -> Any:
        """Kernel: the tree with the numbers of a record for every lane; of width 1 when `record` is."""
        if dr.width(record) == 1:
            # Read side by side they would have to be put in order: code that takes three times as long to compile.
            every = [dr.gather(Float32, packed, record * self.width + number) for number in range(sum(self.counts))]
        else:
            chunks = self.width // AT_ONCE
            every = [number for chunk in range(chunks) for number in row_of(packed, record * chunks + chunk, AT_ONCE)]
        return self._filled(iter(every))

    def _filled(self, numbers: Iterator[Any]) -> Any:
        return self.structure.filled(iter([_nested(numbers, shape) for shape in self.shapes]))


def on_device(tree: Tree) -> Tree:
    """The tree of one record with Dr.Jit's numbers at its leaves, outside any kernel."""
    packing = Packing.of(tree)
    found: Tree = packing._filled(iter(opaque_numbers(packing.records(tree)[0])))
    return found


def on_host(columns: Sequence[Any]) -> NDArray[Any]:
    """Rows, shape (n, k), of k arrays; they are computed together, where each by itself would be compiled by itself."""
    dr.eval(columns)
    return np.stack([column.numpy() for column in columns], axis=-1)


def opaque_numbers(values: ArrayLike) -> list[Any]:
    """Numbers that are not baked into the code of a kernel."""
    return [dr.opaque(Float32, float(x)) for x in np.ravel(values)]


def _nested(numbers: Iterator[Any], shape: tuple[int, ...]) -> Any:
    return [_nested(numbers, shape[1:]) for _ in range(shape[0])] if shape else next(numbers)


def vectors(rows: NDArray[np.float64]) -> Any:
    """Rows, shape (n, 3), as vectors, one per lane."""
    return Array3f32(*(Float32(aligned(column, np.float32)) for column in rows.T))


def rows_of(table: NDArray[np.floating], width: int) -> Any:
    """Table of at most `width` columns as the kernels read it: padded rows, one after the other."""
    return Float32(padded_rows(table, width))


def padded_rows(table: NDArray[np.floating], width: int) -> NDArray[np.float32]:
    """The numbers of `rows_of`: a flat array."""
    padded = aligned_room(len(table) * width, np.float32)
    rows, columns = padded.reshape(len(table), width), table.shape[1]
    rows[:, :columns], rows[:, columns:] = table, 0
    return padded


def pairs_of(nodes: NDArray[np.float64], width: int) -> Any:
    """Table whose rows hold the numbers of a node and of the next one: what `between` reads at once.

    Parameters
    ----------
    nodes : array, shape (..., n, c)
        Values at the nodes; neighbours lie along the last axis but one. The last of them has itself for the next.
    width : int
        Of a row: two halves of at least c numbers.
    """
    return halves_of(nodes, np.concatenate([nodes[..., 1:, :], nodes[..., -1:, :]], axis=-2), width)


def halves_of(first: NDArray[np.float64], second: NDArray[np.float64], width: int) -> Any:
    """Table whose rows hold numbers of two arrays, each of shape (..., c) with c up to half the width."""
    rows = np.zeros((*first.shape[:-1], 2, width // 2))
    rows[..., 0, : first.shape[-1]] = first
    rows[..., 1, : first.shape[-1]] = second
    return rows_of(rows.reshape(-1, width), width)


def between(table: Any, row: Any, share: Any, width: int) -> list[Any]:
    """Kernel: numbers that lie a share of the way from a node of `pairs_of` to the next one."""
    numbers = row_of(table, row, width)
    return [
        dr.lerp(here, there, share) for here, there in zip(numbers[: width // 2], numbers[width // 2 :], strict=True)
    ]


def row_of(table: Any, row: Any, width: int) -> list[Any]:
    """Kernel: numbers of a row of a table; a width that is a power of two is read at once."""
    return list(dr.gather(ArrayXf32, table, row, shape=(width, dr.width(row))))
