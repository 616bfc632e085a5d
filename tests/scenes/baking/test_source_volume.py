"""What a world changes of the light that water scatters, against integrals over the solved field."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from optics.water.pure_water import molecular_phase
from scenes.baking.light_quality import LightQuality
from scenes.baking.source_volume import RaysToGo, direction_weights, lit_world, sample_directions, side_weights
from scenes.kernels.ambient_cube import SIDES
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.veiling_light import SOURCE_AZIMUTHS, SOURCE_ELEVATIONS, SOURCE_ROW
from scenes.light.materials import Material
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh

FLOOR_M, HALF_M = 6.0, 4.0


@pytest.fixture(scope="module")
def light(aqua2_light):
    return aqua2_light


def floor(colour, cells=8):
    side = np.linspace(-HALF_M, HALF_M, cells + 1)
    x, y = np.meshgrid(side, side, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, -FLOOR_M)], axis=-1)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).astype(np.int32)
    return GroupMesh(
        vertices_m=vertices,
        faces=faces,
        material=np.full(len(faces), Material.TILE_WHITE, dtype=np.int32),
        label=np.full(len(faces), Label.WORLD, dtype=np.int32),
        instance=np.zeros(len(faces), dtype=np.int32),
        colour=np.full((len(vertices), 3), colour, dtype=np.float32),
    )


def source_at(volume, *, height):
    """Source above the floor's middle, shape (directions, 3), at the layer of the grid nearest to a height."""
    count = [int(n[0]) for n in volume.count]
    corner, step = float(volume.corner[2][0]), 1 / float(volume.inverse_step[2][0])
    layer = round((height - FLOOR_M - corner) / step)
    values = np.array(volume.values).reshape(*count, SOURCE_ELEVATIONS * SOURCE_AZIMUTHS, SOURCE_ROW)
    return values[count[0] // 2, count[1] // 2, layer, :, :3], -(corner + layer * step)


def test_looks_share_out_all_that_is_scattered_by_more_than_the_peak(light):
    """Each row of shares sums to the phase function without its forward peak (its rings' own error: 2e-3)."""
    shares = direction_weights(light, np.zeros(3), sample_directions(light.towards_sun))
    angle = np.linspace(0, np.pi, 100_001)
    whole = np.trapezoid(2 * np.pi * np.sin(angle) * light.phase_without_peak(angle, 0.0), angle)
    np.testing.assert_allclose(shares.sum(axis=2), whole, rtol=2e-3)
    assert 0.7 < whole < 0.8


def test_phase_without_peak_mixes_molecules_in(light):
    angle = np.radians([20.0, 90.0, 160.0])
    particles = light.phase_without_peak(angle, 0.0)
    mixed = light.phase_without_peak(angle, 0.25)
    np.testing.assert_allclose(mixed, 0.75 * particles + 0.25 * molecular_phase(angle))


def test_right_above_a_black_floor_the_water_lacks_what_comes_from_below(light):
    """Just over a floor that sends nothing, all that open water sends from below is gone.

    Expected: minus the scattering coefficient times phase function times open water's radiance from the solved field,
    over the lower half-space, looking down and half down, in green; 8 % for the looks' spacing and for what the water
    above lacks.
    """
    _, volume, _ = lit_world(floor(0.0), light, LightQuality.full())
    found, depth = source_at(volume, height=0.02)
    means = light.channel_means(depth)
    edges = np.concatenate([[0], np.geomspace(np.radians(0.1), np.pi, 300)])
    middle = (edges[:-1] + edges[1:]) / 2
    solid = (np.cos(edges[:-1]) - np.cos(edges[1:])) * np.radians(3)
    turn = np.radians(np.arange(0, 360, 3) + 1.5)
    directions = node_directions(SOURCE_AZIMUTHS, SOURCE_ELEVATIONS)
    for node in (0, SOURCE_ELEVATIONS // 4 * SOURCE_AZIMUTHS + 3):
        across = np.linalg.svd(directions[node][np.newaxis])[2][1:]
        beside = np.cos(turn)[:, np.newaxis] * across[0] + np.sin(turn)[:, np.newaxis] * across[1]
        ways = np.cos(middle)[:, np.newaxis, np.newaxis] * directions[node]
        ways = ways + np.sin(middle)[:, np.newaxis, np.newaxis] * beside
        radiance = upwelling(light, depth, ways).sum(axis=1)
        phase = light.phase_without_peak(middle, means["molecular"][1])
        expected = -means["scattering"][1] * (phase * radiance) @ solid
        assert found[node, 1] == pytest.approx(expected, rel=0.08)


def upwelling(light, depth, ways):
    """Radiance of open water in green for ways that go down, else zero."""
    mu = np.minimum(ways[..., 2], -1e-9)
    level = np.maximum(np.linalg.norm(ways[..., :2], axis=-1), 1e-9)
    axes = (light.field.depth_m, light.field.cosine, light.field.azimuth_rad)
    weight, sun, uniforms = light.bands.weight[1], light.towards_sun, light.uniforms(depth)
    from_sun = np.arccos(np.clip(ways[..., :2] @ sun[:2] / level / np.hypot(*sun[:2]), -1, 1))
    radiance = np.zeros_like(mu)
    for k in np.flatnonzero(weight):
        multiple = RegularGridInterpolator(axes, light.field.multiple[k])
        x = uniforms.beam_attenuation[k] - uniforms.sun_attenuation[k] * mu
        angle = np.arccos(np.clip(ways @ sun, -1, 1))
        scattered = light.optics.scattering[k] * light.phase_without_peak(angle, light.optics.molecular_fraction[k])
        once = scattered * light.field.sun_irradiance[k] * np.exp(-uniforms.sun_attenuation[k] * depth) / x
        radiance += weight[k] * (multiple(np.stack([np.full_like(mu, depth), mu, from_sun], axis=-1)) + once)
    return np.where(ways[..., 2] < 0, radiance, 0)


def test_over_a_white_floor_the_water_shines_most_downwards(light):
    """A white floor sends more than open water: looking down most, looking up hardly, and less from farther above."""
    _, volume, _ = lit_world(floor(1.0), light, LightQuality.full())
    near, _ = source_at(volume, height=0.02)
    far, _ = source_at(volume, height=0.35)
    level = SOURCE_ELEVATIONS // 2 * SOURCE_AZIMUTHS
    assert (near[0] > 2 * near[level]).all()
    assert (near[level] > 2 * near[-1]).all()
    assert (near[0] > far[0]).all()


def test_looks_share_out_the_irradiance_of_each_side(light):
    """Of an even light that is pi, and of one that grows with the cosine to a side, 2/3 pi of the side itself."""
    directions = sample_directions(light.towards_sun)
    weights = side_weights(directions)
    np.testing.assert_allclose(weights.sum(axis=1), np.pi, rtol=1e-4)
    rising = np.maximum(directions @ SIDES.T, 0)
    np.testing.assert_allclose(np.diag(weights @ rising), 2 / 3 * np.pi, rtol=5e-3)


def test_each_quarter_of_the_rays_says_how_long_the_others_take(monkeypatch, caplog):
    now_s = [100.0]
    monkeypatch.setattr("time.perf_counter", lambda: now_s[0])
    caplog.set_level("INFO")
    rays = RaysToGo(1000)
    for count in (200, 100, 100, 350, 250):
        now_s[0] += count / 50
        rays.traced(count)
    assert caplog.messages == [
        "light on the world: 30 % of its rays are traced, 14 s to go",
        "light on the world: 75 % of its rays are traced, 5.0 s to go",
    ]


def test_what_is_left_of_the_light_on_a_world_is_told(light, monkeypatch, tmp_path, caplog):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    caplog.set_level("INFO")
    lit_world(floor(0.5), light, LightQuality.coarse())
    told = [message for message in caplog.messages if message.startswith("light on the world: ")]
    assert told
    assert all(message.endswith("to go") for message in told)
