"""What tests of light share."""

import numpy as np
import pytest

from rigs import Rig
from scenes.light.light import Light, underwater_light
from scenes.light.materials import Material
from scenes.light.spectrum import bands_of_camera
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh
from scenes.surfaces.shapes import unit_sphere


@pytest.fixture(scope="module")
def aqua2_light() -> Light:
    """Light in aqua2's water, in its camera's bands."""
    rig = Rig.load("aqua2")
    return underwater_light(rig.water, bands=bands_of_camera(rig.camera))


@pytest.fixture(scope="module")
def black_ball() -> GroupMesh:
    """In place of a robot: 0.3 m in radius, 5 m deep, and no light from around reaches it."""
    vertices, faces = unit_sphere(4)
    return GroupMesh(
        vertices_m=vertices * 0.3 - [0, 0, 5.0],
        faces=faces.astype(np.int32),
        material=np.full(len(faces), Material.NEOPRENE, dtype=np.int32),
        label=np.full(len(faces), Label.HULL, dtype=np.int32),
        instance=np.zeros(len(faces), dtype=np.int32),
        colour=np.ones((len(vertices), 3), dtype=np.float32),
        ambient=np.zeros((len(vertices), 3)),
    )
