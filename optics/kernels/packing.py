"""Numbers as the kernels take them: many in one array, and tables that are read row by row.

A frame has hundreds of numbers, and handing over each by itself costs more than a small frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import Array3f32, ArrayXf32, Float32, dr

AT_ONCE = 8
"""Numbers of a row that are read together."""

Numbers = dict[str, list[Any]]
"""Unpacked numbers by name, each a list of Dr.Jit arrays of width 1 or of one entry per lane."""


@dataclass(frozen=True)
class Packing:
    """Order of named numbers in a row; hashable, so that a kernel is compiled for it once.

    Attributes
    ----------
    counts : tuple of (name, count)
    """

    counts: tuple[tuple[str, int], ...]

    @classmethod
    def of(cls, numbers: Mapping[str, Any], rows: int = 1) -> Packing:
        """Packing that fits these numbers; each has as many of them for every row."""
        return cls(tuple((name, int(np.size(value)) // rows) for name, value in numbers.items()))

    @property
    def width(self) -> int:
        """Numbers in a row, which is filled up to a multiple of what is read at once."""
        return -(-sum(count for _, count in self.counts) // AT_ONCE) * AT_ONCE

    def rows(self, numbers: Mapping[str, Any], rows: int = 1) -> NDArray[np.float32]:
        """Numbers in their order, shape (rows, width); with several rows, they are the first axis of each value."""
        if Packing.of(numbers, rows) != self:
            raise ValueError(f"expected numbers {self.counts}, got {Packing.of(numbers, rows).counts}")
        result = np.zeros((rows, self.width), dtype=np.float32)
        found = [np.reshape(value, (rows, -1)) for value in numbers.values()]
        np.concatenate(found, axis=1, out=result[:, : sum(count for _, count in self.counts)], casting="same_kind")
        return result

    def upload(self, numbers: Mapping[str, Any], rows: int = 1) -> Any:
        """Rows of numbers, one after the other, as a kernel takes them."""
        # As a list, which is copied into Dr.Jit's own memory: it would use an array's as it is, and trace a kernel anew
        # for each alignment that comes along.
        return Float32(self.rows(numbers, rows).ravel().tolist())

    def unpack(self, packed: Any, row: Any) -> Numbers:
        """Kernel: numbers of a row for every lane; of width 1 when `row` is."""
        pieces = self.width // AT_ONCE
        every = [number for piece in range(pieces) for number in row_of(packed, row * pieces + piece, AT_ONCE)]
        result: Numbers = {}
        position = 0
        for name, count in self.counts:
            result[name] = every[position : position + count]
            position += count
        return result


def vector(numbers: Numbers, name: str) -> Any:
    """Kernel: three numbers as a vector."""
    return Array3f32(*numbers[name])


def vectors(rows: NDArray[np.float64]) -> Any:
    """Rows, shape (n, 3), as vectors, one per lane."""
    return Array3f32(*(Float32(np.ascontiguousarray(column, dtype=np.float32)) for column in rows.T))


def rows_of(table: NDArray[np.float64], width: int) -> Any:
    """Table of at most `width` columns as the kernels read it: padded rows, one after the other."""
    padded = np.zeros((len(table), width), dtype=np.float32)
    padded[:, : table.shape[1]] = table
    return Float32(padded.ravel())


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
