"""Projection through a flat port as the root of a polynomial, in plain NumPy: shares nothing with `optics`."""

from __future__ import annotations

import numpy as np
import pytest

from optics.camera import PinholeCamera
from optics.ports.port import FlatPort
from optics.status import Status
from optics.train import OpticalTrain

CAMERA = PinholeCamera(width_px=1920, height_px=1440, fx_px=476.0, fy_px=476.0, cx_px=960.0, cy_px=720.0)

SECOND_FORMULA_PX = 1e-8
"""The promise of the issue; rounding in the companion matrix leaves below 1e-10 px."""


def crossing(distance, depth, radius, n_inside, n_water):
    """Where on one plane the ray from the pinhole to a point crosses it, from the axis.

    Snell, squared: ``n_i^2 r^2 (y^2 + (x - r)^2) = n_w^2 (x - r)^2 (d^2 + r^2)``, a quartic in r (Glaeser & Schroecker
    2000; Agrawal et al., CVPR 2012, 4th degree for a single refraction), with its one root between 0 and x.
    """
    rest = np.array([1, -2 * radius, radius**2])
    left = n_inside**2 * np.polymul([1, 0, 0], np.polyadd(rest, [depth**2]))
    right = n_water**2 * np.polymul(rest, [1, 0, distance**2])
    roots = np.roots(np.polysub(left, right))
    real = roots.real[(np.abs(roots.imag) < 1e-7) & (roots.real >= 0) & (roots.real <= radius)]
    assert len(real) == 1
    return real[0]


@pytest.mark.parametrize("n_water", [1.2, 1.333, 1.4])
@pytest.mark.parametrize("filling", [1.0, 1.333])
def test_points_are_seen_where_the_quartic_says(n_water, filling):
    """A window of the index on one of its sides is no window: one refraction is left, at its other face.

    A window of air moves the refraction to its outer face, a window of water to its inner face.
    """
    n_port = 1.0 if filling == 1.0 else n_water
    port = FlatPort(distance_m=0.012, thickness_m=0.005, n_port=n_port, n_water=n_water)
    plane = 0.017 if filling == 1.0 else 0.012
    rng = np.random.default_rng(4)
    points = np.stack([rng.uniform(-0.7, 0.7, 200), rng.uniform(-0.7, 0.7, 200), rng.uniform(0.3, 3, 200)], axis=1)
    image = OpticalTrain(camera=CAMERA, port=port).project(points)
    seen = image.status == Status.OK
    assert seen.mean() > 0.8
    for pixel, point in zip(image.pixels[seen], points[seen], strict=True):
        radius = float(np.hypot(point[0], point[1]))
        slope = crossing(plane, point[2] - plane, radius, 1.0, n_water) / plane
        expected = [960.0, 720.0] + 476.0 * slope * point[:2] / radius
        np.testing.assert_allclose(pixel, expected, rtol=0, atol=SECOND_FORMULA_PX)
