"""The paper's filter, eqs. 8 to 10."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tracking.estimation.centroid_filter import CentroidFilter, CentroidNoise


def test_a_still_centroid_is_taken_over_with_the_settled_gain():
    """A = H = I: per axis the scalar filter; P = (q + sqrt(q^2 + 4 q r)) / 2, gain P / (P + r)."""
    process, measurement = 6.0**2, 2.0**2
    settled = (process + np.sqrt(process**2 + 4 * process * measurement)) / 2
    tracked = CentroidFilter(CentroidNoise(process_px=6.0, measurement_px=2.0))
    for _ in range(50):
        tracked.predict()
        tracked.update((100.0, 50.0))
    tracked.predict()
    tracked.update((110.0, 50.0))
    assert tracked.centroid_px[0] == pytest.approx(100 + 10 * settled / (settled + measurement), rel=1e-12)
    assert tracked.centroid_px[1] == pytest.approx(50.0, rel=1e-12)


def test_the_prediction_stays_unless_the_mirror_is_known_to_turn():
    tracked = CentroidFilter(CentroidNoise())
    tracked.predict((5.0, 5.0))
    assert tracked.centroid_px is None
    tracked.update((30.0, 40.0))
    for _ in range(30):
        tracked.predict()
    np.testing.assert_array_equal(tracked.centroid_px, [30.0, 40.0])
    tracked.predict((-10.0, 4.0))
    np.testing.assert_array_equal(tracked.centroid_px, [20.0, 44.0])


def test_it_goes_on_from_a_snapshot_to_the_same_bytes():
    whole = CentroidFilter(CentroidNoise())
    assert json.loads(json.dumps(whole.snapshot())) == whole.snapshot()
    rng = np.random.default_rng(2)
    for _ in range(10):
        whole.predict(rng.normal(size=2))
        whole.update(rng.normal(size=2))
    resumed = CentroidFilter(CentroidNoise())
    resumed.restore(json.loads(json.dumps(whole.snapshot())))
    for tracked in (whole, resumed):
        tracked.predict((1 / 3, 1 / 7))
        tracked.update((0.1, 0.2))
    assert whole.snapshot() == resumed.snapshot()
    whole.forget()
    assert whole.centroid_px is None
