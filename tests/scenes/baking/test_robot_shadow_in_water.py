"""What a robot keeps from the water around it, against integrals made by other means."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import RigidTransform

from optics.kernels.backend import Array3f32, Float32, UInt32
from optics.kernels.packing import halves_of
from optics.mirror_outline import OUTLINES
from scenes.baking.ambient import Surroundings
from scenes.baking.light_quality import LightQuality
from scenes.baking.robot_light import RobotLight
from scenes.baking.robot_shadow_in_water import folded_begins, shadow_in_water
from scenes.baking.sample_directions import SampleDirections, scattered_density, scattered_directions
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.veiling_light import AZIMUTHS, ELEVATIONS, ROW, SEGMENTS, lengths_m, veiling_light
from scenes.light.light import without_forward_peak
from scenes.stage.records import MirrorPlate

DEPTH_M, RADIUS_M, BELOW_M = 5.0, 0.3, 0.6


@pytest.fixture(scope="module")
def light(aqua2_light):
    return aqua2_light


@pytest.fixture(scope="module")
def shares(light, black_ball):
    """From an eye below the ball, one far below it, and one before the sun; (3, elevations, azimuths, lengths, 3)."""
    pose = RigidTransform.from_translation([0, 0, -DEPTH_M])
    eyes = np.array([[0, 0, -BELOW_M], [0, 0, -30.0], light.towards_sun * BELOW_M])
    begins = np.repeat(eyes[:, np.newaxis], ELEVATIONS * AZIMUTHS, axis=1)
    around = RobotLight(black_ball, light, LightQuality.full(), lambda: Surroundings.of(black_ball, light))
    table = shadow_in_water(around, pose, begins)
    segments = np.array(table).reshape(3, ELEVATIONS, AZIMUTHS, SEGMENTS, 2, ROW // 2)[..., :3]
    return np.concatenate([segments[..., :1, 0, :], segments[..., 1, :]], axis=3)


def test_a_black_ball_keeps_what_a_direct_integral_says(light, shares):
    """The kept light is an integral over the ball's solid angle of phase function and open water's radiance.

    The sun's light scattered once is kept too.

    Expected: the first node of length, looking level across the sun, equals that integral by SciPy's and NumPy's means
    from the solved field itself (green), within 10 %: the light that the water between ball and point sends is left out
    here, and there coefficients are the channel's means.
    """
    row = ELEVATIONS // 2
    sun = light.towards_sun
    across = np.degrees(np.arctan2(sun[1], sun[0])) + 90
    column = round(across / (360 / AZIMUTHS)) % AZIMUTHS
    angle = 2 * np.pi * column / AZIMUTHS
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    weight = light.bands.weight[1]
    wavelengths = np.flatnonzero(weight)
    field = light.field
    axes = (field.depth_m, field.cosine, field.azimuth_rad)
    tables = {k: RegularGridInterpolator(axes, field.multiple[k]) for k in wavelengths}
    length = lengths_m()[1]
    cosine_from_zenith, turn = np.meshgrid(np.linspace(0, 1, 101)[1:] - 1 / 200, np.radians(np.arange(0, 360, 6) + 3))
    total = 0.0
    steps = (np.arange(8) + 0.5) / 8 * length
    for s in steps:
        point = np.array([0, 0, -BELOW_M]) + s * way
        distance = np.linalg.norm(point)
        lowest = np.sqrt(1 - (RADIUS_M / distance) ** 2)
        cosine = 1 - (1 - lowest) * cosine_from_zenith
        axis = -point / distance
        first = np.cross(axis, [0, 1.0, 0.3])
        first = first / np.linalg.norm(first)
        second = np.cross(axis, first)
        sine = np.sqrt(1 - cosine**2)
        looks = (
            axis * cosine[..., None]
            + first * (sine * np.cos(turn))[..., None]
            + second * (sine * np.sin(turn))[..., None]
        )
        azimuth = np.arccos(
            np.clip((looks[..., :2] @ sun[:2]) / np.linalg.norm(looks[..., :2], axis=-1) / np.hypot(*sun[:2]), -1, 1)
        )
        for k in wavelengths:
            seen = tables[k](np.stack([np.full_like(azimuth, DEPTH_M + BELOW_M), looks[..., 2], azimuth], axis=-1))
            seen = seen + once_scattered(light, k, looks, DEPTH_M + BELOW_M) + sky(light, k, looks)
            solid_angle = 2 * np.pi * (1 - lowest)
            scattered = light.optics.scattering[k] * (phase(light, k, looks @ way) * seen).mean() * solid_angle
            total += weight[k] * scattered * length / len(steps)
    # The ball stands before the sun, 22 degrees from the zenith, in front of all these points.
    uniforms = light.uniforms(DEPTH_M)
    for k in wavelengths:
        beam = field.sun_irradiance[k] * np.exp(-uniforms.sun_attenuation[k] * (DEPTH_M + BELOW_M))
        total += weight[k] * light.optics.scattering[k] * phase(light, k, way @ sun) * beam * length
    level = sum(weight[k] * tables[k]([[DEPTH_M + BELOW_M, 0.0, np.pi / 2]])[0] for k in wavelengths)
    assert shares[0, row, column, 1, 1] == pytest.approx(total / level, rel=0.1)


def phase(light, k, cosine):
    f = light.optics.molecular_fraction[k]
    ratio = light.uniforms(DEPTH_M).molecular_anisotropy
    molecules = 3 * (1 + ratio * cosine**2) / (4 * np.pi * (3 + ratio))
    # What is scattered by next to nothing counts with the light it comes from.
    share = float(np.mean(light.field.forward_fraction / (1 - light.optics.molecular_fraction)))
    return (1 - f) * without_forward_peak(light.optics.phase, share, np.arccos(cosine)) + f * molecules


def once_scattered(light, k, looks, depth):
    """Sun scattered once, by the source function integrated up to the surface; for looks that rise."""
    uniforms = light.uniforms(depth)
    x = uniforms.beam_attenuation[k] - uniforms.sun_attenuation[k] * looks[..., 2]
    reach = depth / looks[..., 2]
    source = light.optics.scattering[k] * light.field.sun_irradiance[k] * phase(light, k, looks @ light.towards_sun)
    return source * np.exp(-uniforms.sun_attenuation[k] * depth) * -np.expm1(-x * reach) / x


def sky(light, k, looks):
    """Sky through the flat surface, and its attenuation on the way."""
    n = light.n_water
    sine = n * np.sqrt(1 - looks[..., 2] ** 2)
    inside = sine < 1
    outside = np.sqrt(np.where(inside, 1 - sine**2, 1))
    reflected = (
        ((n * looks[..., 2] - outside) / (n * looks[..., 2] + outside)) ** 2
        + ((looks[..., 2] - n * outside) / (looks[..., 2] + n * outside)) ** 2
    ) / 2
    radiance = light.daylight.sky_radiance(outside.ravel())[k].reshape(outside.shape)
    way = np.exp(-light.uniforms(DEPTH_M).beam_attenuation[k] * (DEPTH_M + BELOW_M) / looks[..., 2])
    return np.where(inside, n**2 * (1 - reflected) * radiance * way, 0)


def test_a_line_that_the_robot_stops_goes_on_in_the_table(light, shares):
    """Away from the sun and through the ball: its shadow behind it counts, for lines beside the ball run through it."""
    x, y, z = -light.towards_sun
    row = round((np.arcsin(z) / np.pi + 0.5) * (ELEVATIONS - 1))
    column = round(np.arctan2(y, x) / (2 * np.pi) * AZIMUTHS) % AZIMUTHS
    behind = int(np.searchsorted(lengths_m(), BELOW_M + RADIUS_M))
    assert lengths_m()[behind - 1] > BELOW_M - RADIUS_M
    assert (shares[2, row, column, behind] > shares[2, row, column, behind - 1] + 0.02).all()


def test_nothing_is_kept_far_away(shares):
    """The ball fills 1e-4 of the half-space from 30 m: what it keeps is less than 2e-3, the sun's shadow apart."""
    level = shares[1, ELEVATIONS // 2]
    assert np.abs(level).max() < 2e-3


@pytest.mark.parametrize("name", OUTLINES)
def test_folded_lines_begin_where_the_mirror_is_hit(name):
    """A mirror of 80 x 100 mm, 0.1 m before the eye at the origin, tilted by 45 degrees: the law of reflection.

    Expected: where a line begins is on the mirror, and the way there from the eye, reflected, is the line's direction;
    for directions that no ray from the eye is folded into, it begins at the mirror's border.
    """
    across, along = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
    normal = np.cross(across, along)
    if normal[0] > 0:
        across, normal = -across, -normal
    centre = np.array([0.1, 0.0, 0.0])
    outline = OUTLINES[name](half_width=0.04, half_height=0.05)
    mirror = MirrorPlate(centre=centre, x=across, y=along, outline=outline)
    begins = folded_begins(np.zeros(3), mirror)
    places = (begins - centre) @ np.column_stack([across, along, normal])
    assert np.abs(places[:, 2]).max() < 1e-12
    beyond = np.max(outline.beyond(*places[:, :2].T), axis=0)
    assert beyond.max() < 1e-12
    border = beyond > -1e-12
    assert 10 < (~border).sum() < len(border) / 4
    way = begins / np.linalg.norm(begins, axis=1, keepdims=True)
    folded = way - 2 * (way @ normal)[:, np.newaxis] * normal
    np.testing.assert_allclose(folded[~border], node_directions(AZIMUTHS, ELEVATIONS)[~border], atol=1e-12)


def test_looks_are_as_dense_as_they_say():
    """The mean of 1 / density over the directions drawn in a cone is its solid angle (3 %, 20 000 looks)."""
    ahead = [0.48, -0.6, 0.64]
    drawn = np.array(scattered_directions(Array3f32(*ahead), SampleDirections.of(1, 20_000))).T
    cosine = drawn @ ahead
    density = scattered_density(Float32(cosine)).numpy()
    for angle in (0.1, 0.5, 1.5):
        inside = cosine > np.cos(angle)
        assert (inside / density).mean() == pytest.approx(2 * np.pi * (1 - np.cos(angle)), rel=0.03)


def test_kernel_gives_the_nodes_and_closes_the_circle():
    """At nodes the table itself; between the last azimuth and the first one half of each (float32: 1e-4)."""
    nodes = np.random.default_rng(0).uniform(size=(1, ELEVATIONS, AZIMUTHS, SEGMENTS + 1, 3))
    table = halves_of(nodes[..., :-1, :], nodes[..., 1:, :], ROW)
    line, node = 7, 3
    elevation = np.pi * line / (ELEVATIONS - 1) - np.pi / 2
    for turn, expected in (
        (5.0, nodes[0, line, 5, node]),
        (AZIMUTHS - 0.5, (nodes[0, line, 0, node] + nodes[0, line, -1, node]) / 2),
    ):
        azimuth = 2 * np.pi * turn / AZIMUTHS
        way = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        direction = Array3f32(*(Float32(float(x)) for x in way))
        kept = veiling_light(table, UInt32(0), direction, Float32(float(lengths_m()[node])))
        np.testing.assert_allclose([float(k[0]) for k in kept], expected, atol=1e-3)
