"""How red a ball is beside the water behind it."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from optics.status import Region
from optics.water.radiative_transfer.column import multiple_radiance, once_radiance, solve_columns
from optics.water.radiative_transfer.field import WINDOW_STREAMS
from optics.water.radiative_transfer.quadrature import window_cosines_air
from rigs import Rig, Water
from rigs.lamps import Lamp
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.light.inherent_contrast import AZIMUTHS_RAD, inherent_contrast, level_radiance
from scenes.light.lamps import LampUniforms
from scenes.light.light import underwater_light
from scenes.light.materials import Material, albedo_table
from scenes.light.sky import Daylight
from scenes.light.spectrum import reflectance, water_bands
from scenes.light.sun import Sun
from scenes.renderer import FastRenderer
from scenes.stage.frame import Label
from scenes.stage.scene import make_scene, on_gaze
from scenes.stage.targets import Ball

DEPTH_M = 5.0


@pytest.fixture(scope="module")
def light():
    return underwater_light(Water(jerlov_type="IB"))


def test_open_water_looked_at_level_is_as_bright_as_the_solution_says(light):
    """Rationale: by streams and modes of each wavelength, with the sun's light scattered once along each level line.

    Expected: 1 %, what the tables interpolate.
    """
    columns = solve_columns(
        light.optics,
        sun_cosine_air=light.daylight.sun.cosine,
        sun_irradiance=light.daylight.sun_irradiance,
        sky_radiance=light.daylight.sky_radiance(window_cosines_air(WINDOW_STREAMS)),
    )
    where = np.array([DEPTH_M]), np.array([1e-6]), AZIMUTHS_RAD
    expected = [(multiple_radiance(c, *where) + once_radiance(c, *where)).mean() for c in columns]
    np.testing.assert_allclose(level_radiance(light, DEPTH_M), expected, rtol=0.01)


def test_two_bodies_differ_by_their_reflectance_alone(light):
    """Of a grey one the reflectance hardly depends on the wavelength, and is the same factor for every light."""
    grey, white = Material.PRINT_GREY, Material.PRINT_WHITE
    found = [inherent_contrast(light, DEPTH_M, each)[0] for each in (grey, white)]
    red = light.bands.weight[0]
    shares = [red @ reflectance(name, light.bands.wavelength_nm) for name in ("neutral 5 (.70 D)", "white 9.5 (.05 D)")]
    assert found[0] - found[1] == pytest.approx(np.log(shares[0] / shares[1]), abs=0.05)


def test_red_fades_with_depth(light):
    """At 5 m in clear water a red ball is more than twice as bright as the water in red, at 20 m it is darker."""
    found = [inherent_contrast(light, depth, Material.TARGET)[0] for depth in (2.0, 5.0, 10.0, 20.0)]
    assert np.all(np.diff(found) < 0)
    assert found[1] > np.log(2)
    assert found[-1] < 0


def test_a_lamp_by_day_carries_a_red_ball_a_metre():
    """A ball in the middle of a lamp's beam, 12 m deep in type II: the table of docs/explanation/perception.md.

    Expected: the page's numbers, to their last digit and one more.
    """
    daylight = Daylight(wavelength_nm=water_bands().wavelength_nm, sun=Sun(elevation_deg=45.0), cloud=0.0)
    light, depth_m = underwater_light(Water(jerlov_type="II"), daylight), 12.0
    lamp = Lamp(position_mm=(0.0, 0.0, 0.0), angle_deg=135.0, luminous_flux_lm=6000.0)
    [intensity] = LampUniforms.of([lamp], light.bands.wavelength_nm).intensity
    red = light.bands.weight[0]
    water = red @ level_radiance(light, depth_m)
    by_day = np.exp(inherent_contrast(light, depth_m, Material.TARGET)[0])
    found = []
    for distance_m in (1.0, 1.5, 2.4):
        irradiance = intensity * np.exp(-light.field.beam_attenuation * distance_m) / distance_m**2
        lit = red @ (albedo_table(light.bands)[Material.TARGET] * irradiance / np.pi)
        found.append(np.log(by_day + lit / water))
    np.testing.assert_allclose(found, [0.17, -0.18, -0.37], atol=0.02)


def rendered(depth_m, jerlov_type, material):
    """The same of an image of a ball 0.45 m away, mean of four headings; without hull and mount."""
    rig = Rig.load("aqua2")
    ball = Ball(radius_m=0.05, material=material)
    scene = make_scene(rig, world="blue", depth_m=depth_m, jerlov_type=jerlov_type, target=ball)
    renderer = FastRenderer(prepare(scene, rig, (), quality=LightQuality.coarse()), width_px=160, height_px=120)
    ratios = []
    for heading in np.radians([0, 90, 180, 270]):
        body = RigidTransform.from_components([0, 0, -depth_m], Rotation.from_euler("z", heading))
        place = body.apply(on_gaze(rig, q1=0.0, q2=0.0, distance_m=0.45))
        frame = renderer.render(world_from_body=body, world_from_target=RigidTransform.from_translation(place))
        red, gaze = frame.radiance[..., 0], frame.region == Region.GAZE
        ratios.append(red[frame.label == Label.TARGET].mean() / red[gaze & (frame.label == Label.OPEN_WATER)].mean())
    return inherent_contrast(scene.light, depth_m, material)[0], np.log(np.mean(ratios))


def test_images_say_what_water_and_material_change():
    """Rationale: the side that is looked at gets less light than the mean of all, alike for every ball and water.

    Expected: from one case to the next the numbers of the images change as predicted, within 0.4: what is left of a
    contrast after 0.45 m of water is a tenth to a quarter less, of numbers that differ by up to 1.7.
    """
    cases = [(5.0, "IB", Material.TARGET), (9.0, "1C", Material.TARGET), (5.0, "IB", Material.PRINT_BLACK)]
    predicted, seen = np.array([rendered(*case) for case in cases]).T
    assert np.ptp(predicted) > 1.4
    np.testing.assert_allclose(np.diff(seen), np.diff(predicted), atol=0.4)
