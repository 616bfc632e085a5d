"""The fast model as a Mitsuba integrator: against the fast renderer, and against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import interpn
from scipy.spatial.transform import RigidTransform

from optics.kernels.backend import mi
from optics.kernels.refraction import dielectric_transmittance
from optics.layout import camera_pose
from optics.train import OpticalTrain, pixel_grid
from optics.water.pure_water import molecular_phase
from rigs import Rig
from rigs.port import NoPortSpec
from scenes.baking.lit_scene import prepare
from scenes.kernels import paths
from scenes.light.materials import Material, albedo_table
from scenes.light.spectrum import water_bands
from scenes.light.waves import Wind
from scenes.mitsuba_integrator import WaterIntegrator, light_of, register
from scenes.reference.bodies import surface_shapes
from scenes.renderer import FastRenderer
from scenes.stage.frame import Label
from scenes.stage.scene import Target, make_scene
from scenes.stage.targets import MeshShape
from scenes.surfaces.surface import surface
from scenes.worlds.tank import tank

DEPTH = 4.0
SINGLE_PRECISION = 2e-5
"""As in `test_light`: exponentials and interpolation in float32. Measured 4e-6."""

EDGE_PIXELS = 0.001
"""Fraction of pixels that may see the other side of an edge or a shadow's border."""

TABLES = 0.03
"""Interpolation in the tables of light and its division within a channel (`test_light`)."""

START_OFFSET = 5e-4
"""Mitsuba starts rays 1500 units in the last place off a surface, 0.5 mm at 5 m: so much water is left out."""

TRANSFORM = mi.ScalarTransform4f
CLEAR = "wavelength_nm,a_per_m,b_per_m\n400,1e-6,1e-10\n700,1e-6,1e-10\n"
COLOURLESS = "wavelength_nm,a_per_m,b_per_m\n400,0.1,0.2\n700,0.1,0.2\n"


def integrator(**properties):
    register()
    return {"type": "mirrorgaze_water", **properties}


def sensor(origin, target, *, size=(32, 24), fov=60.0, up=(0, 0, 1), samples=1):
    return {
        "type": "perspective",
        "fov": fov,
        "near_clip": 1e-3,
        "to_world": TRANSFORM().look_at(origin=list(origin), target=list(target), up=list(up)),
        "film": {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": samples},
    }


def seen_along(scene, origin, direction):
    """Radiance along one ray, shape (3,)."""
    ray = mi.Ray3f(mi.Point3f(*map(float, origin)), mi.Vector3f(*map(float, direction)))
    return np.array(scene.integrator().sample(scene, None, mi.RayDifferential3f(ray))[0]).ravel()


def properties(**values):
    result = mi.Properties()
    for name, value in values.items():
        result[name] = value
    return result


def square(centre, normal, half, bsdf, **more):
    """Square plate that faces along its normal."""
    up = [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0]
    ahead = [float(c + n) for c, n in zip(centre, normal, strict=True)]
    pose = TRANSFORM().look_at(origin=list(map(float, centre)), target=ahead, up=up).scale(float(half))
    return {"type": "rectangle", "to_world": pose, "bsdf": bsdf, **more}


def grey(value):
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": [value] * 3}}


@pytest.fixture(scope="module")
def grey_tank():
    """The tank in greys that have no colour at all: a Mitsuba scene has one reflectance for a whole channel."""
    world = tank(DEPTH)
    grey = np.random.default_rng(5).uniform(0.2, 0.8, (len(world.vertices_m), 1))
    return surface(world.vertices_m, world.faces, Material.COLOURED, np.repeat(grey, 3, axis=1))


def test_tank_looks_as_in_the_fast_renderer(grey_tank, monkeypatch):
    """Rationale: two tracers (packed groups and mirrors, or any Mitsuba scene) share the formulas of light alone.

    Expected: every pixel of a camera without port and mirrors, by the same rays, to single precision, but for pixels
    on a shadow's edge. The tank is a target to the fast renderer: what stands in a world is lit by its neighbours too,
    which this integrator does not know of. It does not know what a target is either, before which the sun is kept from
    the water.
    """
    monkeypatch.setattr(paths, "PART_RADIUS_M", 0.0)
    rig = Rig.load("bench").model_copy(update={"port": NoPortSpec(shape="none")})
    scene = make_scene(rig, world="blue", depth_m=DEPTH, jerlov_type="II", wind=Wind(speed_m_per_s=0.0))
    tank_shape = Target(shape=MeshShape(name="tank", surface=grey_tank), world_from_target=RigidTransform.identity())
    frame = FastRenderer(prepare(replace(scene, target=tank_shape), rig, []), width_px=96, height_px=72).render()

    water = rig.water.of_type("II")
    albedo = albedo_table(water_bands()) @ water_bands().weight.T
    own = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator(jerlov_type="II", salinity_ppt=water.salinity_ppt),
            "sensor": sensor([0, 0, -DEPTH], [1, 0, -DEPTH]),
            **surface_shapes("tank", grey_tank, RigidTransform.identity(), albedo, np.array([600.0, 540.0, 460.0])),
        },
        optimize=False,
    )
    train, pose = OpticalTrain.from_rig(rig), scene.world_from_body * camera_pose(rig.camera)
    rays = train.trace(pixel_grid(train.camera, 96, 72))
    ray = mi.Ray3f(
        mi.Point3f(pose.apply(rays.origin_m).T.astype(np.float32)),
        mi.Vector3f(pose.rotation.apply(rays.direction).T.astype(np.float32)),
    )
    colour, hit, _ = own.integrator().sample(own, None, mi.RayDifferential3f(ray))
    found = np.array(colour).T.reshape(frame.radiance.shape)
    hit = np.array(hit).reshape(frame.label.shape)
    seen = frame.label == Label.TARGET
    assert np.array(hit).reshape(seen.shape)[seen].all()
    assert 0.3 < seen.mean() < 0.95
    error = np.abs(found / frame.radiance - 1).max(axis=-1)
    assert (error > SINGLE_PRECISION).mean() < EDGE_PIXELS, np.sort(error.ravel())[-60:]


def test_floor_in_clear_water_sends_back_what_passes_the_surface(tmp_path):
    """Closed form: no scattering and no absorption; albedo / pi times refracted sun and sky (Fresnel, Lambert)."""
    file = tmp_path / "clear.csv"
    file.write_text(CLEAR)
    light = light_of(properties(iop_file=str(file), sun_elevation_deg=40.0))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator(iop_file=str(file), sun_elevation_deg=40.0),
            "sensor": sensor([0, 0, -2], [0, 0, -3], up=(0, 1, 0)),
            "floor": square([0, 0, -6], [0, 0, 1], 50, grey(0.5)),
        }
    )
    day = light.daylight
    cosine, weight = np.polynomial.legendre.leggauss(64)
    cosine, weight = (cosine + 1) / 2, weight / 2
    sky = (
        2
        * np.pi
        * day.sky_radiance(cosine)
        @ (weight * cosine * np.array(dielectric_transmittance(mi.Float64(cosine), 1.0, light.n_water)))
    )
    sun = day.sun_irradiance * day.sun.cosine * dielectric_transmittance(day.sun.cosine, 1.0, light.n_water)
    expected = 0.5 / np.pi * light.bands.weight @ (sun + sky)
    np.testing.assert_allclose(seen_along(scene, [0, 0, -2], [0, 0, -1]), expected, rtol=0.01)
    np.testing.assert_allclose(seen_along(scene, [0, 0, -2], [0.6, 0, -0.8]), expected, rtol=0.01)


@pytest.mark.parametrize("direction", [(0.6, 0.0, -0.8), (0.0, 0.8, 0.6), (0.9, -0.4, 0.03**0.5)])
def test_open_water_has_the_radiance_of_the_field(direction):
    """Straight from the field: its table of what was scattered more than once, and the closed form of what was not."""
    light = light_of(properties(jerlov_type="III", sun_azimuth_deg=30.0))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator(jerlov_type="III", sun_azimuth_deg=30.0),
            "sensor": sensor([0, 0, -30], [1, 0, -30]),
        }
    )
    field, optics, depth = light.field, light.optics, 30.0
    direction = np.array(direction)
    across = np.arctan2(direction[1], direction[0]) - np.radians(30.0)
    azimuth = np.abs((across + np.pi) % (2 * np.pi) - np.pi)
    axes = field.depth_m, field.cosine, field.azimuth_rad
    multiple = [np.exp(interpn(axes, np.log(m), (depth, direction[2], azimuth))[0]) for m in field.multiple]
    angle = np.arccos(direction @ light.towards_sun)
    molecules = optics.molecular_fraction
    phase = molecules * molecular_phase(np.array([angle])) + (1 - molecules) * optics.phase(angle)
    c, k_sun = field.beam_attenuation, field.beam_attenuation / field.sun_cosine
    once = optics.scattering * phase * field.sun_irradiance * np.exp(-k_sun * depth) / (c - k_sun * direction[2])
    expected = light.bands.weight @ (multiple + once)
    found = seen_along(scene, [0, 0, -depth], direction)
    np.testing.assert_allclose(found, expected, rtol=TABLES)


def test_emitter_behind_a_port_is_dimmed_by_fresnel_index_and_water():
    """T / n^2 exp(-c r) by channel: normal incidence on both faces (Born & Wolf 1.5.3), basic radiance conserved."""
    glass, water, distance = 1.5, 1.34, 2.5
    shapes = {
        "inner": square([0.01, 0, -5], [-1, 0, 0], 0.3, {"type": "dielectric", "int_ior": glass, "ext_ior": 1.0}),
        "outer": square([0.02, 0, -5], [1, 0, 0], 0.3, {"type": "dielectric", "int_ior": glass, "ext_ior": water}),
    }
    images = []
    for radiance in (0.0, 10.0):
        lamp = {"type": "area", "radiance": {"type": "rgb", "value": [radiance] * 3}}
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": integrator(jerlov_type="II", camera_in_water=False),
                "sensor": sensor([0, 0, -5], [1, 0, -5]),
                "panel": square([0.02 + distance, 0, -5], [-1, 0, 0], 3, grey(0.0), emitter=lamp),
                **shapes,
            }
        )
        images.append(seen_along(scene, [0, 0, -5], [1, 0, 0]))
    light = light_of(properties(jerlov_type="II"))
    fresnel = 4 * glass / (1 + glass) ** 2 * 4 * glass * water / (glass + water) ** 2
    passed = light.bands.weight @ np.exp(-light.field.beam_attenuation * distance)
    found = images[1] - images[0]
    np.testing.assert_allclose(found, 10 * fresnel / water**2 * passed, rtol=START_OFFSET)
    assert (images[0] > 0).all()  # the water between shines


def test_in_the_air_of_a_housing_nothing_is_lit():
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator(camera_in_water=False),
            "sensor": sensor([0, 0, -5], [1, 0, -5]),
            "wall": square([1, 0, -5], [-1, 0, 0], 1, grey(0.5)),
        }
    )
    np.testing.assert_array_equal(seen_along(scene, [0, 0, -5], [1, 0, 0]), 0)


def test_a_perfect_mirror_shows_what_the_mirrored_ray_sees(tmp_path):
    """Water, then what the ray behind the mirror sees through that water: F (1 - exp(-c r)) + exp(-c r) L.

    The water is the same at every wavelength, so that this holds channel by channel.
    """
    file = tmp_path / "colourless.csv"
    file.write_text(COLOURLESS)
    base = {
        "type": "scene",
        "integrator": integrator(iop_file=str(file)),
        "sensor": sensor([0, 0, -5], [1, 0, -5]),
    }
    floor = {"floor": square([0, 0, -8], [0, 0, 1], 50, grey(0.5))}
    mirror = square([2, 0, -5], [-(0.5**0.5), 0, -(0.5**0.5)], 0.2, {"type": "conductor", "material": "none"})
    folded = seen_along(mi.load_dict({**base, **floor, "mirror": mirror}), [0, 0, -5], [1, 0, 0])
    beyond = seen_along(mi.load_dict({**base, **floor}), [2, 0, -5], [0, 0, -1])
    open_water = seen_along(mi.load_dict(base), [0, 0, -5], [1, 0, 0])
    passed = np.exp(-light_of(properties(iop_file=str(file))).field.beam_attenuation[0] * 2.0)
    np.testing.assert_allclose(folded, (1 - passed) * open_water + passed * beyond, rtol=2 * START_OFFSET)


def test_glass_lets_the_sun_through_and_a_plate_does_not():
    """Sunlit floor minus shadowed floor is the direct sun, albedo / pi E mu exp(-c* z / mu), by channel."""
    light = light_of(properties(jerlov_type="II"))
    towards_sun = light.towards_sun
    above = np.array([0, 0, -6]) + towards_sun
    base = {
        "type": "scene",
        "integrator": integrator(jerlov_type="II"),
        "sensor": sensor([0, 0, -5], [0, 0, -6], up=(0, 1, 0)),
        "floor": square([0, 0, -6], [0, 0, 1], 50, grey(0.5)),
    }
    dielectric = {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.34}
    plates = {"none": {}, "glass": {"plate": square(above, [0, 0, 1], 0.1, dielectric)}}
    plates["grey"] = {"plate": square(above, [0, 0, 1], 0.1, grey(0.5))}
    seen = {
        name: seen_along(mi.load_dict({**base, **plate}), [0, 0, -5.9], [0, 0, -1]) for name, plate in plates.items()
    }
    np.testing.assert_array_equal(seen["glass"], seen["none"])
    field = light.field
    sun = field.sun_irradiance * np.exp(-field.beam_attenuation / field.sun_cosine * 6.0) * towards_sun[2]
    to_eye = np.exp(-field.beam_attenuation * 0.1)
    expected = 0.5 / np.pi * light.bands.weight @ (sun * to_eye)
    np.testing.assert_allclose(seen["none"] - seen["grey"], expected, rtol=1e-3)  # a difference of two images


def test_looking_up_the_surface_is_a_window_and_a_mirror():
    """Bright sky within Snell's window; beyond 48.6 degrees the water below is seen once more."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator(jerlov_type="IB", surface_z=7.0),
            "sensor": sensor([0, 0, 6], [1, 0, 6]),
        }
    )
    up = seen_along(scene, [0, 0, 6], [0, 0, 1])
    window = [seen_along(scene, [0, 0, 6], [0, np.sin(a), np.cos(a)]) for a in np.radians([47.0, 50.0])]
    assert (up > 3 * window[1]).all()
    assert (window[0] > 1.5 * window[1]).all()


def test_a_user_scene_renders_without_noise():
    """mi.render on a perspective camera: no chance but where in its pixel a sample lies."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator(jerlov_type="II", sun_elevation_deg=60, sun_azimuth_deg=120, surface_z=0.0),
            "sensor": sensor([0, 0, -5], [3, 0, -6]),
            "floor": square([0, 0, -6.5], [0, 0, 1], 50, {"type": "roughplastic", "alpha": 0.3}),
            "ball": {"type": "sphere", "center": [3, 0.3, -6], "radius": 0.4, "bsdf": grey(0.4)},
        }
    )
    first, second = (np.array(mi.render(scene, spp=1, seed=0)) for _ in range(2))
    assert first.tobytes() == second.tobytes()
    assert first.shape == (24, 32, 3)
    assert np.isfinite(first).all()
    assert (first > 0).all()
    many = np.array(mi.render(scene, spp=256, seed=3))
    two = np.array(mi.render(scene, spp=2, seed=5))
    # A sample may be anywhere in its pixel: as far off as the next pixel's middle, where the image is smooth.
    step = np.maximum(*(np.abs(np.gradient(many, axis=axis)) for axis in (0, 1)))
    near = np.abs(two - many) <= 1.5 * step + 1e-3 * many
    assert near.mean() > 0.97


def test_everything_that_is_wrong_is_said_at_once():
    wrong = properties(jerlov_type="9Z", sun_elevation_deg=-5.0, cloud=2.0)
    with pytest.raises(ValueError, match=r"(?s)mirrorgaze_water: .*jerlov_type.*elevation_deg.*cloud"):
        light_of(wrong)
    with pytest.raises(RuntimeError, match="depth_m"):
        mi.load_dict(integrator(depth_m=3.0))


def test_the_integrator_says_what_it_is():
    assert "surface_z = 1.5" in str(WaterIntegrator(properties(surface_z=1.5)))
