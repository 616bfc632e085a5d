"""The veiling light's table and its drawn estimate, against sources whose integral along a line is closed form."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from optics.kernels.backend import Array3f32, Float32, UInt32
from optics.kernels.packing import on_device, rows_of, vectors
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.grid import GridTable
from scenes.kernels.veiling_light import (
    AZIMUTHS,
    ELEVATIONS,
    SEGMENTS,
    SOURCE_AZIMUTHS,
    SOURCE_ELEVATIONS,
    SOURCE_ROW,
    lengths_m,
    sampled_veiling_light,
    veiling_light,
    veiling_light_table,
)
from scenes.stage.records import Pose

ATTENUATION = np.array([0.5, 0.2, 0.3])
EYES_M = np.array([[0.3, 0.1, 0.0], [0.0, 0.0, -0.2]])
TURNED = Rotation.from_euler("ZYX", [70, -20, 10], degrees=True)
SHIFT_M = np.array([0.5, -0.3, -5.0])


def geometry(source):
    """Grid of 8 m about the robot, whose source is a function of points and directions."""
    axes = [np.linspace(-4, 4, 9), np.linspace(-4, 4, 9), np.linspace(-9, -1, 9)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    values = source(points, node_directions(SOURCE_AZIMUTHS, SOURCE_ELEVATIONS)[np.newaxis])
    rows = np.repeat(values.reshape(-1, 1), 3, axis=1)
    return SimpleNamespace(
        source=GridTable.of(axes, rows_of(rows, SOURCE_ROW)), shadow_in_water=None, eyes=vectors(EYES_M)
    )


def light():
    return SimpleNamespace(channel_attenuation=[Float32(float(c)) for c in ATTENUATION])


def pose(_):
    return on_device(Pose(rotation=TURNED.as_matrix(), translation=SHIFT_M))


def seen(source, eye, direction, length):
    """Veil of a line of the world frame, from the table in the turned robot's own frame."""
    table = veiling_light_table(light(), pose, geometry(source), None, eyes=len(EYES_M), states=1)
    turned = TURNED.inv().apply(direction)
    found = veiling_light(table, UInt32(eye), Array3f32(*(Float32(float(x)) for x in turned)), Float32(length))
    return np.array([float(channel[0]) for channel in found])


@pytest.mark.parametrize("piece", [1, 4, 7])
def test_an_even_source_adds_its_saturating_share(piece):
    """J (1 - exp(-c r)) / c, at the ends of segments, from any place in any direction."""
    length = float(lengths_m()[piece])
    expected = 0.7 * -np.expm1(-ATTENUATION * length) / ATTENUATION
    for eye, direction in enumerate(([0.6, 0.0, 0.8], [-0.36, 0.48, -0.8])):
        found = seen(lambda points, ways: 0.7 + 0 * (points + ways)[..., 0], eye, direction, length)
        np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_a_source_is_found_where_and_along_which_way_it_is():
    """A source 1 + w_z + x/10 in the world, from a turned robot: along a line x grows with the path.

    The table has nodes by direction (7.5 and 15 degrees): 2 %.
    """
    direction, length = np.array([0.6, 0.64, -0.48]), float(lengths_m()[6])
    begin = TURNED.apply(EYES_M[1]) + SHIFT_M
    s = (np.arange(4000) + 0.5) / 4000 * length
    source = 1 + direction[2] + (begin[0] + s * direction[0]) / 10
    expected = [np.mean(source * np.exp(-c * s)) * length for c in ATTENUATION]
    found = seen(lambda points, ways: 1 + ways[..., 2] + points[..., 0] / 10, 1, direction, length)
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_what_the_robot_hides_is_a_share_of_open_water():
    """Without a world the table holds minus the hidden share times open water's radiance, which is one here."""
    hidden = np.random.default_rng(0).uniform(size=(ELEVATIONS * AZIMUTHS * SEGMENTS, 8)) * [1, 1, 1, 0, 1, 1, 1, 0]
    level = SimpleNamespace(
        reference_depth_m=Float32(0.0), sun_azimuth=[Float32(1.0), Float32(0.0)], table_decay=[Float32(0.0)] * 3
    )
    layer = Float32(np.ones(65 * 25 * 8, dtype=np.float32))
    only_robot = SimpleNamespace(source=None, shadow_in_water=rows_of(hidden, 8), eyes=vectors(EYES_M[:1]))
    table = veiling_light_table(level, pose, only_robot, layer, eyes=1, states=1)
    np.testing.assert_allclose(np.array(table), -hidden.ravel(), atol=1e-6)


def test_drawn_veil_has_the_integral_for_its_mean():
    """100 000 draws of a source that changes with place and direction; the channels' mean within 1 %."""
    count, length = 100_000, 3.0
    begin, direction = np.array([0.3, 0.2, -5.0]), np.array([0.6, 0.64, -0.48])
    volume = geometry(lambda points, ways: 2 + ways[..., 2] + points[..., 0] / 4).source
    origin, looking = (Array3f32(*(Float32(float(x)) for x in each)) for each in (begin, direction))
    seed = UInt32(np.arange(count, dtype=np.uint32))
    drawn = sampled_veiling_light(volume, light(), seed, origin, looking, Float32(length))
    found = [np.array(channel).mean() for channel in drawn]
    s = (np.arange(4000) + 0.5) / 4000 * length
    source = 2 + direction[2] + (begin[0] + s * direction[0]) / 4
    expected = [np.mean(source * np.exp(-c * s)) * length for c in ATTENUATION]
    np.testing.assert_allclose(found, expected, rtol=0.01)
