"""Solid angles of pixels in the water, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from optics.camera import PinholeCamera, camera_from_spec
from optics.coverage.field import pixel_solid_angles
from optics.ports.port import DomePort, FlatPort, NoPort, port_from_spec
from rigs import Rig

CAMERA = PinholeCamera(width_px=640, height_px=480, fx_px=500.0, fy_px=480.0, cx_px=300.0, cy_px=250.0)

ROUNDING_SR = 1e-12
"""Sums of a few thousand solid angles of 1e-4 sr in float64."""


def edges(camera: PinholeCamera) -> tuple[float, float, float, float]:
    """Tangents of the image's edges: left, right, top, bottom."""
    left, right = (np.array([-0.5, camera.width_px - 0.5]) - camera.cx_px) / camera.fx_px
    top, bottom = (np.array([-0.5, camera.height_px - 0.5]) - camera.cy_px) / camera.fy_px
    return left, right, top, bottom


def pyramid(left: float, right: float, top: float, bottom: float) -> float:
    """Solid angle of a rectangle at distance 1: the four corner terms of atan(x y / sqrt(1 + x^2 + y^2))."""

    def corner(x: float, y: float) -> float:
        return float(np.arctan2(x * y, np.sqrt(1 + x * x + y * y)))

    return corner(right, bottom) - corner(left, bottom) - corner(right, top) + corner(left, top)


def behind_flat_port(camera: PinholeCamera, n: float) -> float:
    """Field in the water behind a flat port, by Gauss-Legendre quadrature over the image.

    Snell squeezes the ring of directions at the angle t into that at t', sin t = n sin t': the solid angle in the
    water is that in air times ``cos t / (n^2 cos t')``; that in air is ``cos^3 t`` per unit of tangents squared.
    """
    left, right, top, bottom = edges(camera)
    nodes, weights = np.polynomial.legendre.leggauss(80)
    x = left + (right - left) * (nodes + 1) / 2
    y = (top + (bottom - top) * (nodes + 1) / 2)[:, np.newaxis]
    cosine = 1 / np.sqrt(1 + x * x + y * y)
    cosine_in_water = np.sqrt(1 - (1 - cosine**2) / n**2)
    density = cosine**3 * cosine / (n**2 * cosine_in_water)
    return float((density * weights * weights[:, np.newaxis]).sum() * (right - left) * (bottom - top) / 4)


@pytest.mark.parametrize("grid", [(1, 1), (7, 5), (64, 48)])
def test_without_a_port_cells_add_up_to_the_pyramid(grid: tuple[int, int]) -> None:
    # Straight edges in the image are great circles: the sum is exact for any cells.
    assert pixel_solid_angles(CAMERA, NoPort(), *grid).sum() == pytest.approx(pyramid(*edges(CAMERA)), abs=ROUNDING_SR)


def test_a_centred_dome_changes_nothing() -> None:
    port = DomePort(radius_m=0.05, thickness_m=0.006, aperture_radius_m=0.001)
    assert pixel_solid_angles(CAMERA, port, 8, 6).sum() == pytest.approx(pyramid(*edges(CAMERA)), abs=ROUNDING_SR)


def test_behind_a_flat_port_the_sum_converges_to_the_integral() -> None:
    port = FlatPort(distance_m=0.02, thickness_m=0.008, n_water=1.34)
    exact = behind_flat_port(CAMERA, 1.34)
    errors = [abs(pixel_solid_angles(CAMERA, port, 8 * k, 6 * k).sum() - exact) for k in (1, 2, 4)]
    # Cells are bounded by great circles between corners that are off the bent edge by the square of their size.
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.05)
    assert errors[2] < 1e-4 * exact


def test_bench_sees_the_field_that_snell_leaves_it() -> None:
    rig = Rig.load("bench")
    camera, port = camera_from_spec(rig.camera), port_from_spec(rig.port, rig.water)
    assert isinstance(camera, PinholeCamera)
    coarse, fine = (pixel_solid_angles(camera, port, 240 * k, 180 * k) for k in (1, 2))
    assert fine.shape == (480 * 360,)
    # The second order shown above, extrapolated to cells of no size (Richardson); the next order is the fourth.
    limit = (4 * fine.sum() - coarse.sum()) / 3
    assert limit == pytest.approx(behind_flat_port(camera, port.n_water), rel=1e-8)
