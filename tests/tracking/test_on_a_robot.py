"""The robot's side runs without whatever renders or models solids: it is imported where those cannot be."""

import os
import subprocess
import sys

BLOCKED = ("scenes", "cad", "dives", "mitsuba", "build123d")

IMPORT_ALL = f"""
import importlib, pkgutil, sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {BLOCKED}:
            raise ImportError("blocked: " + name)

sys.meta_path.insert(0, Blocked())
import tracking
names = [module.name for module in pkgutil.walk_packages(tracking.__path__, "tracking.")]
for name in names:
    importlib.import_module(name)
from rigs import Rig
from tracking.perception.corners.exact import ExactCorners
corners = ExactCorners(Rig.load("aqua2")).corners([[0.0, 0.0]])
print(len(names), corners.shape)
"""


def test_every_module_of_the_robots_side_works_without_renderer_and_solids():
    child = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
    )
    assert child.returncode == 0, child.stderr
    modules, *shape = child.stdout.split(maxsplit=1)
    assert int(modules) > 40
    assert shape == ["(1, 4, 2)\n"]
