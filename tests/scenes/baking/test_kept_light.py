"""Light that is found once and kept, against what was recorded for its version.

Few directions from a coarse floor: the light is rough, but a change of the way in which it is found shows in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from scenes.baking.ambient import LIGHT_VERSION, ambient_light
from scenes.baking.irradiance_volume import ambient_volume
from scenes.baking.robot_shadow_in_water import water_shade
from scenes.baking.robot_shadow_on_world import world_shade
from scenes.baking.source_volume import lit_world
from scenes.kernels.veiling_light import AZIMUTHS, ELEVATIONS
from scenes.light.materials import Material
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh

pytestmark = pytest.mark.usefixtures("rough_light")

RECORDED_REL = 1e-4
"""Kernels count in single precision, and one machine's vectors are longer than another's."""
BALL_M = 5.0
FLOOR_M = 6.0


@pytest.fixture(scope="module")
def lit_floor(aqua2_light):
    """A bright level square of 3 x 3 x 2 triangles, lit, and the source volume above it."""
    x = np.linspace(-2, 2, 4)
    vertices = np.stack([*(axis.ravel() for axis in np.meshgrid(x, x, indexing="ij")), np.full(16, -FLOOR_M)], axis=1)
    a = (4 * np.arange(3)[:, np.newaxis] + np.arange(3)).ravel()
    faces = np.concatenate([np.stack([a, a + 4, a + 5], axis=1), np.stack([a, a + 5, a + 1], axis=1)]).astype(np.int32)
    floor = GroupMesh(
        vertices_m=vertices,
        faces=faces,
        material=np.full(len(faces), Material.TILE_WHITE, dtype=np.int32),
        label=np.full(len(faces), Label.WORLD, dtype=np.int32),
        instance=np.zeros(len(faces), dtype=np.int32),
        colour=np.full((len(vertices), 3), 0.7, dtype=np.float32),
    )
    return lit_world(floor, aqua2_light)


def test_kept_light_of_a_world_is_what_would_be_found_today(lit_floor, aqua2_light, check_recorded):
    """On its surfaces, in what the water scatters, and around what moves in it."""
    floor, source = lit_floor
    around = ambient_volume(floor, aqua2_light, source)
    found = {
        "ambient": floor.ambient,
        "source": np.array(source.values),
        "around": np.array(around.values),
    }
    check_recorded("light of a world", LIGHT_VERSION, rel=RECORDED_REL, **found)


def test_kept_light_of_a_robot_is_what_would_be_found_today(black_ball, aqua2_light, check_recorded):
    """On it, and its shadows in the water and on the world."""
    pose = RigidTransform.from_translation([0, 0, -BALL_M])
    begins = np.broadcast_to([0.0, 0.0, -0.8], (1, ELEVATIONS * AZIMUTHS, 3))
    ambient = ambient_light(black_ball, aqua2_light)
    robot = replace(black_ball, ambient=ambient)
    found = {
        "ambient": ambient,
        "in_the_water": np.array(water_shade(robot, pose, begins, aqua2_light)),
        "on_the_world": np.array(world_shade(robot, pose, aqua2_light).values),
    }
    check_recorded("light of a robot", LIGHT_VERSION, rel=RECORDED_REL, **found)
