import pytest

from cad.assembly.meshes import rig_meshes
from rigs import Rig


@pytest.fixture(scope="session")
def aqua2():
    return Rig.load("aqua2")


@pytest.fixture(scope="session")
def aqua2_meshes(aqua2):
    return rig_meshes(aqua2)
