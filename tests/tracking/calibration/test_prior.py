"""What is known of a rig before any image."""

from __future__ import annotations

import numpy as np
import pytest

from rigs import Rig
from tracking.calibration.prior import PRINT_TOLERANCES, estimated_parameters, standard_deviations


def test_tolerances_of_one_thing_add_up_in_squares():
    """m1_turn_x: a degree of the seat and the flatness of the glass; index of water: temperature and salinity."""
    rig = Rig.load("aqua2")
    found = standard_deviations(rig, PRINT_TOLERANCES)
    assert found["m1_turn_x"] == pytest.approx(np.hypot(np.radians(1.0), 1e-4), rel=1e-12)
    assert found["m2_shift_x"] == pytest.approx(1e-3, rel=1e-12)
    assert set(found) == set(estimated_parameters(rig))
    assert all(value > 0 for value in found.values())
