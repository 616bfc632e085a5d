"""Frozen functions: recorded while there is garbage that no recording can hold."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from optics.kernels import freezing
from optics.kernels.backend import Array3f64, Backend, Float64, activate, dr
from optics.kernels.freezing import frozen

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


@frozen()
def divided(x):
    vector = Array3f64(x, 2 * x, -2 * x)
    return [dr.rcp(x), dr.rsqrt(x), *dr.normalize(vector), *(vector / (3 * x))]


def test_reciprocals_have_double_precision_in_every_thread():
    """A graphics card's fast ones have seven digits, and Dr.Jit takes them in a thread that nobody has told not to."""
    x = np.random.default_rng(5).uniform(0.1, 10, 1000)
    thirds = [1 / 3, 2 / 3, -2 / 3]
    expected = [1 / x, 1 / np.sqrt(x), *(np.full(1000, t) for t in thirds * 2)]
    with ThreadPoolExecutor(1) as other:
        for found in (divided(Float64(x)), other.submit(divided, Float64(x)).result()):
            np.testing.assert_allclose(np.array([column.numpy() for column in found]), expected, rtol=1e-15)


def is_fast():
    return dr.flag(dr.JitFlag.FastMath)


def test_on_the_processor_nothing_changes_and_on_a_card_what_is_asked_for(monkeypatch):
    usual = is_fast()
    with freezing.arithmetic(fast=not usual):
        assert is_fast() == (usual if activate().kind == "llvm" else not usual)
    monkeypatch.setattr(freezing, "activate", lambda: Backend(kind="cuda", device="a card"))
    for fast in (False, True):
        with freezing.arithmetic(fast=fast):
            assert is_fast() == fast
        assert is_fast() == usual
