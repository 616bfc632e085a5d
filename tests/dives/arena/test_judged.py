"""What a loop made of a dive: what was followed instead of the target."""

import numpy as np
import pyarrow as pa
import pytest

from dives.arena.judged import longest_s
from dives.metrics.frames import FLAGS, NUMBERS, TEXT, Frames

FRAMES = 60


def frames(**columns):
    """A log of 2 s in which the target is seen ahead and tracked, but for what a test says otherwise."""
    data = {name: np.zeros(FRAMES) for name in NUMBERS} | {"time_s": np.arange(FRAMES) / 30}
    data |= {"detector_both_px": np.full(FRAMES, 40.0), "target_visible_px": np.full(FRAMES, 50.0)}
    data |= {name: [""] * FRAMES for name in TEXT} | {name: [False] * FRAMES for name in FLAGS}
    return Frames.of(pa.table(data | {"mode": ["track"] * FRAMES, "detected": [True] * FRAMES} | columns))


def test_what_was_detected_last_is_what_is_followed():
    thing = np.array(["target"] * 20 + ["robot"] * 20 + [""] * 20)
    met = np.where(np.arange(FRAMES) < 20, 40.0, 0.0)
    detected = (np.arange(FRAMES) < 40).tolist()
    mode = ["track"] * 50 + ["scan"] * 10
    found = frames(detector_both_px=met, detected=detected, mode=mode, detected_thing=thing)
    on = found.followed
    assert on.tolist() == ["target"] * 20 + ["robot"] * 30 + [""] * 10
    assert longest_s(found, on == "robot") == pytest.approx(1.0)
    assert longest_s(found, on == "decoy") == 0.0
