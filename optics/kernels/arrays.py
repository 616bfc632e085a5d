"""The border between NumPy, which public functions speak, and Dr.Jit, which kernels speak.

To import it loads neither Dr.Jit nor Mitsuba: only the functions that speak to them do.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from optics.kernels import backend

FloatArray = NDArray[np.float64]

CACHE_LINE_BYTES = 64


def check_points(name: str, points: ArrayLike, columns: int) -> FloatArray:
    """Float64 array of shape (n, columns), or a `ValueError` that says what came."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"expected {name} of shape (n, {columns}), got {array.shape}")
    return array


def check_vector(name: str, vector: ArrayLike) -> FloatArray:
    """Finite float64 array of shape (3,), or a `ValueError` that says what came."""
    array = np.asarray(vector, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"expected {name} to be three finite numbers, got {vector!r}")
    return array


def unit(name: str, vector: ArrayLike) -> FloatArray:
    """Unit vector along `vector`; a zero vector is a `ValueError`."""
    array = check_vector(name, vector)
    largest = np.abs(array).max()
    if largest == 0:
        raise ValueError(f"expected {name} to have a direction, got {vector!r}")
    # Squares of very large or small components would overflow or vanish.
    array = array / largest
    return np.asarray(array / np.linalg.norm(array))


def opaque(value: float) -> Any:
    """Dr.Jit scalar that is an input of a kernel, not a literal in it: other values reuse the compiled code."""
    return backend.dr.opaque(backend.Float64, float(value))


def opaque_vector(vector: ArrayLike) -> Any:
    """Dr.Jit 3-vector that is an input of a kernel."""
    return backend.Array3f64(*(opaque(component) for component in np.asarray(vector, dtype=np.float64)))


def aligned(values: ArrayLike, dtype: DTypeLike) -> NDArray[Any]:
    """Flat copy whose memory begins where a cache line does, to be handed to Dr.Jit.

    Dr.Jit uses an array's memory as it is, and compiles a kernel once more for each mixture of aligned and unaligned
    arrays: with what NumPy happens to allocate it would never be done.
    """
    flat = np.asarray(values).ravel()
    result = aligned_room(flat.size, dtype)
    result[:] = flat
    return result


def aligned_room(count: int, dtype: DTypeLike) -> NDArray[Any]:
    """Memory for `count` numbers, as `aligned` has it, with nothing in it yet."""
    memory = np.empty(count * np.dtype(dtype).itemsize + CACHE_LINE_BYTES, dtype=np.uint8)
    start = -memory.ctypes.data % CACHE_LINE_BYTES
    return memory[start : start + memory.size - CACHE_LINE_BYTES].view(dtype)


def to_columns(array: FloatArray) -> list[Any]:
    """Columns of an (n, k) array as Dr.Jit arrays."""
    return [backend.Float64(aligned(column, np.float64)) for column in array.T]


def to_rows(columns: Iterable[Any]) -> FloatArray:
    """(n, k) NumPy array of k Dr.Jit arrays, such as the components of an array of vectors."""
    arrays = [column.numpy() for column in columns]
    # Column by column is five times as fast as np.stack, which walks through all of them at once.
    rows = np.empty((max(map(len, arrays)), len(arrays)))
    for index, array in enumerate(arrays):
        rows[:, index] = array
    return rows
