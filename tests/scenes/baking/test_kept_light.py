"""Light that is found once and kept, against what was recorded for its version.

Few directions from a coarse floor: the light is rough, but a change of the way in which it is found shows in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from scenes.baking.ambient import LIGHT_VERSION, PlaceSizes, Surroundings, ambient_light, light_key
from scenes.baking.light_quality import LightQuality
from scenes.baking.robot_light import RobotLight
from scenes.baking.robot_shadow_in_water import shadow_in_water
from scenes.baking.robot_shadow_on_world import shadow_on_world
from scenes.baking.source_volume import lit_world
from scenes.kernels.veiling_light import AZIMUTHS, ELEVATIONS
from scenes.light.materials import Material
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh
from scenes.surfaces.shapes import unit_sphere

RECORDED_REL = 1e-4
"""Kernels count in single precision: vertices moved by 3e-7 of themselves change these sums by up to 1e-5 ..."""
FEW_LOOKS_REL = 5e-3
"""... but by 1.7e-3 where each point looks in 4 directions, and one ray in thousands then misses the robot."""
COARSE = LightQuality.coarse()
BALL_M = 5.0
FLOOR_M = 6.0


def crumpled(vertices, faces, by_m, *, label):
    """Bright mesh whose vertices are moved at random: its faces see each other, and no ray just meets an edge."""
    moved = vertices + np.random.default_rng(1).uniform(-by_m, by_m, vertices.shape)
    return GroupMesh(
        vertices_m=moved,
        faces=faces.astype(np.int32),
        material=np.full(len(faces), Material.TILE_WHITE, dtype=np.int32),
        label=np.full(len(faces), label, dtype=np.int32),
        instance=np.zeros(len(faces), dtype=np.int32),
        colour=np.full((len(moved), 3), 0.7, dtype=np.float32),
    )


@pytest.fixture(scope="module")
def nothing_kept(tmp_path_factory, aqua2_light):
    """An empty cache: what is kept for a key is what is tested here. The field of the water itself may be kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MIRRORGAZE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def lit_floor(aqua2_light, nothing_kept):
    """A level square of 4 x 4 x 2 triangles, crumpled and lit, and the source volume above it."""
    x = np.linspace(-2, 2, 5)
    vertices = np.stack([*(axis.ravel() for axis in np.meshgrid(x, x, indexing="ij")), np.full(25, -FLOOR_M)], axis=1)
    a = (5 * np.arange(4)[:, np.newaxis] + np.arange(4)).ravel()
    faces = np.concatenate([np.stack([a, a + 5, a + 6], axis=1), np.stack([a, a + 6, a + 1], axis=1)])
    return lit_world(crumpled(vertices, faces, 0.3, label=Label.WORLD), aqua2_light, COARSE)


@pytest.fixture(scope="module")
def ball():
    """In place of a robot, crumpled too."""
    vertices, faces = unit_sphere(2)
    return crumpled(0.3 * vertices - [0, 0, BALL_M], faces, 0.05, label=Label.HULL)


def test_kept_light_of_a_world_is_what_would_be_found_today(lit_floor, aqua2_light, nothing_kept, check_recorded):
    """On its surfaces, in what the water scatters, and around what moves in it."""
    floor, source, around = lit_floor
    found = {
        "ambient": floor.ambient,
        "source": np.array(source.values),
        "around": np.array(around.values),
    }
    check_recorded("light of a world", LIGHT_VERSION, rel=RECORDED_REL, **found)


def test_kept_light_of_a_robot_is_what_would_be_found_today(ball, aqua2_light, nothing_kept, check_recorded):
    """On it, and its shadows in the water and on the world."""
    pose = RigidTransform.from_translation([0, 0, -BALL_M])
    begins = np.broadcast_to([0.0, 0.0, -0.8], (1, ELEVATIONS * AZIMUTHS, 3))
    around = Surroundings.of(ball, aqua2_light)
    ambient = ambient_light(ball, around, COARSE, PlaceSizes(iterated=0.1, kept=0.01))
    robot = RobotLight(replace(ball, ambient=ambient), aqua2_light, COARSE, lambda: around)
    shadow = np.array(shadow_in_water(robot, pose, begins))
    check_recorded("light of a robot", LIGHT_VERSION, rel=RECORDED_REL, ambient=ambient, in_the_water=shadow)
    values = np.array(shadow_on_world(robot, pose).values)
    check_recorded("shadow of a robot on the world", LIGHT_VERSION, rel=FEW_LOOKS_REL, values=values)


def test_a_world_s_light_is_the_same_whatever_a_robot_s_mirrors_are_coated_with(ball, aqua2_light):
    """Not so a robot's: its mirrors throw light."""
    coated = replace(aqua2_light, coating="enhanced-aluminium")
    world, robot = ball, replace(ball, mirrors={"M1": np.zeros(3)})
    same = [
        light_key("light", mesh, aqua2_light, COARSE) == light_key("light", mesh, coated, COARSE)
        for mesh in (world, robot)
    ]
    assert same == [True, False]
