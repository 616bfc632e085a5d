"""What the robot keeps from surfaces around it, against its solid angle in the solved field."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import interpn
from scipy.spatial.transform import RigidTransform

from cad.assembly.meshes import rig_meshes
from optics.kernels.backend import Array3f32, Float32
from optics.kernels.packing import pairs_of
from rigs import Rig
from scenes.baking.ambient import Surroundings
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.baking.robot_light import RobotLight
from scenes.baking.robot_shadow_on_world import shadow_on_world
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.shadow_table import AZIMUTHS, DISTANCES, ELEVATIONS, ROW, distances_m, hidden_from_surface
from scenes.light.forward_cone import lengths_over_radius
from scenes.renderer import FastRenderer
from scenes.stage.frame import Label
from scenes.stage.scene import make_scene

DEPTH_M, RADIUS_M = 5.0, 0.3


@pytest.fixture(scope="module")
def light(aqua2_light):
    return aqua2_light


@pytest.fixture(scope="module")
def shadow(light, black_ball):
    around = RobotLight(black_ball, light, LightQuality.full(), lambda: Surroundings.of(black_ball, light))
    return shadow_on_world(around, RigidTransform.from_translation([0, 0, -DEPTH_M]))


def test_a_far_black_ball_keeps_its_solid_angle_of_open_water(light, shadow):
    """From d away a ball fills pi r^2 / d^2 and hides open water there, but for what the way between still sends.

    Expected: from level with the ball, across the sun, where the field is even, the table's last node is pi r^2 times
    open water's radiance, with ``exp(-c (d - r))`` of it for the water before the ball, over what lights a level plane;
    with what that water scatters by less than the ball is wide, ``exp(k b d)``; green, 10 %.
    """
    values = np.array(shadow.values).reshape(ELEVATIONS, AZIMUTHS, DISTANCES, 2, ROW // 2)[..., 0, :3]
    sun = light.towards_sun
    across = np.degrees(np.arctan2(sun[1], sun[0])) + 90
    column = round(across / (360 / AZIMUTHS)) % AZIMUTHS
    node = 4
    distance = distances_m(RADIUS_M)[node]
    direction = node_directions(AZIMUTHS, ELEVATIONS).reshape(ELEVATIONS, AZIMUTHS, 3)[ELEVATIONS // 2, column]
    radiance = open_water(light, -direction)
    attenuation = light.channel_means(DEPTH_M)["attenuation"][1]
    share = np.interp(distance / RADIUS_M, lengths_over_radius(), light.hidden_shares)
    scattered = np.exp(share * light.channel_means(DEPTH_M)["scattering_without_peak"][1] * distance)
    expected = np.pi * RADIUS_M**2 * radiance * np.exp(-attenuation * (distance - RADIUS_M)) * scattered
    found = values[ELEVATIONS // 2, column, node, 1] * light.ambient_up(DEPTH_M)[1]
    assert distance > 5 * RADIUS_M
    assert found == pytest.approx(expected, rel=0.1)


def open_water(light, way):
    """Radiance in green along a level way, from the solved field and the sun scattered once."""
    total, sun = 0.0, light.towards_sun
    uniforms, weight = light.uniforms(DEPTH_M), light.bands.weight[1]
    azimuth = np.arccos(way[:2] @ sun[:2] / np.hypot(*sun[:2]))
    for k in np.flatnonzero(weight):
        axes = (light.field.depth_m, light.field.cosine, light.field.azimuth_rad)
        multiple = interpn(axes, light.field.multiple[k], (DEPTH_M, way[2], azimuth))[0]
        phase = light.phase_without_peak(np.arccos(way @ sun), light.optics.molecular_fraction[k])
        beam = light.field.sun_irradiance[k] * np.exp(-uniforms.sun_attenuation[k] * DEPTH_M)
        once = light.optics.scattering[k] * phase * beam / uniforms.beam_attenuation[k]
        total += weight[k] * (multiple + once)
    return total


def test_the_most_is_kept_where_the_sky_is_brightest(shadow):
    """Below the ball, away from the sun, more is kept than above it, where it hides the dark below."""
    values = np.array(shadow.values).reshape(ELEVATIONS, AZIMUTHS, DISTANCES, 2, ROW // 2)[..., 0, :3]
    below, above = values[0, 0, 3], values[-1, 0, 3]
    assert (below > 5 * np.abs(above)).all()
    assert (values[:, :, 3].max(axis=(0, 1)) > below).all()  # the glow around the sun, farther down its beam


def test_kernel_weighs_nodes_by_distance_facing_and_depth():
    """At a node: its number over d^2, times the cosine, times the light that falls off with depth; none behind."""
    nodes = np.random.default_rng(0).uniform(size=(ELEVATIONS * AZIMUTHS, DISTANCES, 3))
    shadow = SimpleNamespace(values=pairs_of(nodes, ROW), radius=Float32(0.5))
    light = SimpleNamespace(
        reference_depth_m=Float32(5.0),
        ambient_up=[Float32(x) for x in (1.0, 2.0, 3.0)],
        ambient_fall=[Float32(x) for x in (0.1, 0.2, 0.3)],
    )
    row, node = 7 * AZIMUTHS + 5, 3
    way, distance = node_directions(AZIMUTHS, ELEVATIONS)[row], distances_m(0.5)[node]
    normal = -way + np.cross(way, [0.0, 0.0, 1.0]) * np.sqrt(3) / np.linalg.norm(np.cross(way, [0.0, 0.0, 1.0]))
    expected = nodes[row, node] / distance**2 / 2 * [1, 2, 3] * np.exp(-np.array([0.1, 0.2, 0.3]) * 1.5)
    for each, wanted in ((normal / 2, expected), (-normal / 2, np.zeros(3))):
        place, facing = (Array3f32(*(Float32(float(x)) for x in v)) for v in (way * distance, each))
        kept = hidden_from_surface(shadow, light, place, facing, Float32(6.5))
        np.testing.assert_allclose([float(k[0]) for k in kept], wanted, rtol=2e-3, atol=1e-6)


def test_a_shadow_never_takes_more_light_than_there_is():
    """Just above a tank's floor aqua2's shadow, and the light that the water before it lacks, would be more than all.

    A camera takes no negative radiance. Nor is there nothing but shadow: most of the floor is lit.
    """
    rig = Rig.load("aqua2")
    scene = make_scene(rig, world="tank", depth_m=1.0, jerlov_type="IB")
    renderer = FastRenderer(prepare(scene, rig, rig_meshes(rig), quality=LightQuality.coarse()))
    low = RigidTransform.from_translation(renderer.scene.world_from_body.translation - [0.0, 0.0, 0.8])
    frame = renderer.render(q1=0.0, q2=0.0, world_from_body=low)
    assert frame.radiance.min() >= 0
    assert np.mean(frame.radiance[frame.label == Label.WORLD] > 0) > 0.9
