"""Frozen functions: recorded while there is garbage that no recording can hold."""

import subprocess
import sys

RECORDED_BESIDE_A_DEAD_SCENE = """
import gc

import numpy as np

from optics.kernels.backend import Float32
from optics.kernels.freezing import frozen
from optics.kernels.ray_scene import mesh_scene

class Owner:
    pass

gc.disable()
owner = Owner()
owner.itself = owner
owner.scene = mesh_scene(np.eye(3), np.array([[0, 1, 2]]))
del owner
gc.enable()

@frozen()
def doubled(values):
    if gc.isenabled():
        gc.collect()
    return values * 2

print(doubled(Float32([1, 2, 3])).numpy().tolist())
assert gc.isenabled()
"""


def test_a_scene_in_the_garbage_does_not_end_the_process():
    """In a process of its own, because what is tested for is the end of the process."""
    done = subprocess.run(
        [sys.executable, "-c", RECORDED_BESIDE_A_DEAD_SCENE], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "[2.0, 4.0, 6.0]\n"), done.stderr
