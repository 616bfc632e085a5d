"""What stands before the sun keeps it from the water in front: a disc's shadow in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from optics.kernels.backend import Array3f32, Float32, UInt32
from optics.mirror_outline import Rectangle
from scenes.kernels.paths import _behind_what_is_seen, _end_radius
from scenes.kernels.tracing import Primitive
from scenes.stage.records import WORLD

RADIUS_M = 0.1
HALF_WIDTH_M, HALF_HEIGHT_M = 0.2, 0.1
MIRROR = SimpleNamespace(outline=Rectangle(half_width=Float32(HALF_WIDTH_M), half_height=Float32(HALF_HEIGHT_M)))
MIRROR_RADIUS_M = (HALF_WIDTH_M * HALF_HEIGHT_M) ** 0.5
SUN = np.array([0.0, np.sin(0.4), np.cos(0.4)])


def share(angle_deg, length_m, primitive):
    """Of a way of a length that ends at a primitive, at an angle from the sun's direction."""
    across = np.array([1.0, 0.0, 0.0])
    angle = np.radians(angle_deg)
    way = np.cos(angle) * SUN + np.sin(angle) * across
    inputs = SimpleNamespace(
        light=SimpleNamespace(refracted_sun=[float(x) for x in SUN]),
        geometry=SimpleNamespace(groups={WORLD: None}),
        state=SimpleNamespace(ball=SimpleNamespace(radius=RADIUS_M), mirrors={"M1": MIRROR}),
    )
    hit = SimpleNamespace(primitive=UInt32(int(primitive)), distance=Float32(length_m))
    radius, _ = _end_radius(inputs, hit)
    return float(_behind_what_is_seen(inputs, Array3f32(*way.tolist()), hit, radius)[0])


@pytest.mark.parametrize("angle_deg", [2.0, 5.0, 20.0, 60.0])
@pytest.mark.parametrize("length_m", [0.2, 1.0, 5.0])
def test_the_share_is_that_of_points_whose_way_to_the_sun_meets_the_disc(angle_deg, length_m):
    """Expected: of 100 000 points on the way, those that see the sun through the disc about its end, square to the sun.

    A point at s before the end passes the disc's plane s sin(a) from its middle, s cos(a) farther on: for a disc square
    to the way that is s tan(a), which is what the kernel takes.
    """
    before = (np.arange(100_000) + 0.5) / 100_000 * length_m
    shadowed = before * np.tan(np.radians(angle_deg)) < RADIUS_M
    assert share(angle_deg, length_m, Primitive.BALL) == pytest.approx(shadowed.mean(), abs=2e-5)


def test_the_robot_counts_beside_the_sun_only_and_the_world_never():
    """Elsewhere the robot's shadow is in its table; the world's is in the map of its shadows."""
    assert share(5.0, 1.0, Primitive.M1_BACK) == share(5.0, 1.0, Primitive.M1) == 1.0
    assert share(7.4, 5.0, Primitive.M1) == pytest.approx(MIRROR_RADIUS_M / (5.0 * np.tan(np.radians(7.4))), rel=1e-5)
    assert share(20.0, 1.0, Primitive.M1_BACK) == 0.0
    assert share(0.5, 1.0, Primitive.FIRST_GROUP) == share(0.5, 1.0, Primitive.SEA_SURFACE) == 0.0
    assert share(120.0, 1.0, Primitive.BALL) == 0.0
