"""The paper's follower: what its gains do."""

from __future__ import annotations

import numpy as np
import pytest

from optics.layout import Layout
from rigs import Rig
from tracking.control.crop_follower import CropFollower
from tracking.control.crop_scale import level_pose
from tracking.control.follower import Observation
from tracking.control.paper_law import GAIN
from tracking.estimation.centroid_filter import CentroidNoise
from tracking.estimation.gimbal import Gimbal
from tracking.loop.variants import VARIANTS, Variant
from tracking.perception import Crop
from tracking.records import Blob

SCALE = np.array([0.002, 0.003])
SQUARE = Crop.of([[0, 0], [320, 0], [320, 240], [0, 240]])


@pytest.fixture(scope="module")
def gimbal():
    return Gimbal(Layout.from_rig(Rig.load("aqua2")))


def turn(gimbal, gains):
    """Of both joints for a blob 20 px right of the middle and 10 px below it, radians."""
    q = level_pose(gimbal)
    blob = Blob(area_px=500.0, centroid_px=(179.5, 129.5), box_px=(0, 0, 9, 9), circularity=1.0)
    observation = Observation(time_s=0.0, interval_s=0.03, q=q, q_command=q, crop=SQUARE, blobs=(blob,))
    follower = CropFollower(gimbal, SCALE, CentroidNoise(), literal=False, gains=gains)
    follower.expect(observation)
    follower.update(observation)
    return follower.follow(observation) - q


def test_each_gain_is_a_share_of_its_error(gimbal):
    """20 px are 0.04 rad; of 10 px down, 0.03 rad, the mirror takes half."""
    np.testing.assert_allclose(np.abs(turn(gimbal, (GAIN, GAIN))), [GAIN * 0.04, GAIN * 0.03 / 2])
    np.testing.assert_allclose(turn(gimbal, (2 * GAIN, 3 * GAIN)), turn(gimbal, (GAIN, GAIN)) * [2, 3])


@pytest.mark.parametrize("gains", [(0.0, 0.2), (0.2, float("nan"))])
def test_gains_that_turn_nothing_are_refused(gains):
    fields = vars(VARIANTS["paper"]) | {"gains": gains}
    with pytest.raises(ValueError, match="expected gains above 0"):
        Variant(**fields)
