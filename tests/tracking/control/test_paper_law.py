"""Eqs. 11 to 15: as printed, as meant, and what follows from the gain."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.control.paper_law import GAIN, NO_ERRORS, CropErrors, error, meant_turn, printed_turn

GAINS = np.array([2.0, 10.0])


def errors(found, centroid, prediction):
    return CropErrors(found=found, centroid=np.array(centroid), prediction=np.array(prediction))


def test_errors_are_from_the_middle_of_the_crop():
    """Eq. 11 on a crop of 320 x 240: C - I / 2, with the first pixel's centre at zero half a pixel less."""
    np.testing.assert_array_equal(error((160.0, 100.0), 320, 240), [0.5, -19.5])


def test_the_law_as_printed():
    """Eq. 13: kp1 (e_x + psi e_px). Eq. 14: kp2 / 2 (e_x + psi e_px) of the image before. psi is 1 when found."""
    now, before = errors(True, [3.0, 100.0], [1.0, 100.0]), errors(True, [5.0, 100.0], [2.0, 100.0])
    np.testing.assert_array_equal(printed_turn(now, before, GAINS), [2 * (3 + 1), 10 / 2 * (5 + 2)])
    lost = errors(False, [0.0, 0.0], [7.0, 100.0])
    np.testing.assert_array_equal(printed_turn(lost, now, GAINS), [0, 10 / 2 * 3])
    np.testing.assert_array_equal(printed_turn(lost, lost, GAINS), [0, 0])


def test_the_law_as_meant():
    """e_y for tilt, of the same image; the prediction only when the target is not found."""
    np.testing.assert_array_equal(meant_turn(errors(True, [3.0, 4.0], [9.0, 9.0]), GAINS), [2 * 3, 10 * 4 / 2])
    np.testing.assert_array_equal(meant_turn(errors(False, [0.0, 0.0], [7.0, -8.0]), GAINS), [2 * 7, -10 * 8 / 2])
    np.testing.assert_array_equal(meant_turn(NO_ERRORS, GAINS), [0, 0])


def test_the_gain_is_the_fastest_without_overshoot():
    """With two images from exposure to answer e_(k+1) = e_k - g e_(k-1): a double root at 1/4, beyond it rings."""
    assert np.roots([1, -1, GAIN]) == pytest.approx([0.5, 0.5])
    assert np.abs(np.roots([1, -1, GAIN / 2])).max() > 0.5
    assert np.iscomplex(np.roots([1, -1, GAIN * 1.1])).all()
