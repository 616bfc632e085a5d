"""Combinations of parameters against what spans them by hand."""

import numpy as np

from tracking.calibration.combinations import in_words, sparse_basis


def test_a_basis_has_a_parameter_of_its_own_in_each_row():
    """Of (1, 1, 0) and (0, 0, 1), however they are mixed."""
    rows = np.array([[1.0, 1.0, 2.0], [2.0, 2.0, -1.0]])
    found = sparse_basis(rows)
    np.testing.assert_allclose(sorted(found.tolist()), [[0, 0, 1], [1, 1, 0]], rtol=0, atol=1e-15)
    assert sparse_basis(rows[:0]).shape == (0, 3)


def test_words_begin_with_the_largest_part_and_leave_out_small_ones():
    names, units = ("a", "b", "c"), ("mm", "deg", "")
    per_unit = np.array([1000.0, 1.0, 1.0])
    assert in_words(np.array([0.5, -1.0, 0.01]), names, units, per_unit, least_share=0.05) == "b +1 deg, a -500 mm"
    assert in_words(np.array([0.01, 0.0, -2.0]), names, units, per_unit, least_share=0.05) == "c"
