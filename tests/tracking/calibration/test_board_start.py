"""Where boards stand, from a nominal rig: the start of a calibration."""

from __future__ import annotations

import numpy as np
import pytest

from dives.calibration.simulation import simulated_target, useful_poses
from optics.perturbation.train import PerturbedTrain
from rigs import NoPortSpec, Rig
from tracking.calibration.board_start import board_poses

RIGS = {
    "flat": Rig.load("aqua2"),
    "none": Rig.load("aqua2").model_copy(update={"port": NoPortSpec(shape="none")}),
}


@pytest.mark.parametrize(("name", "tolerance_px"), [("none", 1e-3), ("flat", 1.0)])
def test_a_board_is_found_by_the_nominal_rig(name, tolerance_px):
    """Without noise and perturbations the linear start is the answer: of a pinhole exactly, whose rays meet.

    Rays of converged projections (1e-9 px) intersected over metres: a thousandth of a pixel is ample. Behind a port
    they miss each other by millimetres, which turn with the distance into tenths of a pixel: a start, no result.
    """
    rig = RIGS[name]
    train = PerturbedTrain(rig)
    target = simulated_target(rig, {}, useful_poses(rig, 6), known=False, direct=True, noise_px=0.0, seed=0)
    assert len(target.boards) >= 2
    for index, camera_from_board in enumerate(board_poses(train, target)):
        on = target.board == index
        pixels = train.project(camera_from_board.apply(target.points_m[on]), target.q[on])
        np.testing.assert_allclose(pixels, target.pixels[on], atol=tolerance_px)
