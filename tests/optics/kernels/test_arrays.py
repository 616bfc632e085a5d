"""What crosses the border between NumPy and Dr.Jit is checked, and comes back as it was."""

from __future__ import annotations

import numpy as np
import pytest

from optics.kernels.arrays import (
    CACHE_LINE_BYTES,
    aligned,
    check_points,
    check_vector,
    opaque,
    to_columns,
    to_rows,
    unit,
)
from optics.kernels.backend import Array3f64


def test_points_keep_their_numbers_through_dr_jit():
    points = np.random.default_rng(0).normal(size=(9, 3))
    assert (to_rows(Array3f64(*to_columns(points))) == points).all()


def test_columns_of_a_transposed_array_are_not_mixed_up():
    """A view with foreign strides: Dr.Jit reads memory in order."""
    points = np.arange(12.0).reshape(3, 4).T
    assert (to_rows(Array3f64(*to_columns(points))) == points).all()


def test_an_opaque_number_is_double_precision():
    assert np.array(opaque(0.1))[0] == 0.1


@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((4, 3)), np.zeros((2, 2, 2)), 1.0])
def test_wrong_shapes_are_refused(wrong):
    with pytest.raises(ValueError, match=r"expected pixels of shape \(n, 2\), got \("):
        check_points("pixels", wrong, 2)


def test_points_may_be_lists_of_integers():
    assert check_points("pixels", [[1, 2]], 2).dtype == np.float64


@pytest.mark.parametrize("wrong", [(1, 2), (1, 2, np.nan), (1, np.inf, 0), [[1, 2, 3]]])
def test_wrong_vectors_are_refused(wrong):
    with pytest.raises(ValueError, match="expected normal to be three finite numbers, got"):
        check_vector("normal", wrong)


def test_a_zero_vector_has_no_direction():
    with pytest.raises(ValueError, match="expected normal to have a direction, got"):
        unit("normal", (0, 0, 0))


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1.0, 1e200])
def test_unit_keeps_the_direction_at_any_scale(scale):
    np.testing.assert_allclose(unit("normal", np.array([3.0, 0, 4.0]) * scale), [0.6, 0, 0.8], rtol=1e-15)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint32])
def test_aligned_memory_begins_where_a_cache_line_does(dtype):
    """Whatever it is a copy of: of every other item, from any first one on."""
    values = np.arange(101)
    for first in range(8):
        found = aligned(values[first::2], dtype)
        assert found.ctypes.data % CACHE_LINE_BYTES == 0
        assert found.dtype == dtype
        np.testing.assert_array_equal(found, values[first::2])
