"""The public names of the packages are there, and loading a package is light."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

LAZY = ("cad", "dives", "optics", "reports", "scenes", "studio", "tracking")

HEAVY = {"build123d", "cv2", "drjit", "matplotlib", "mitsuba", "scipy", "trimesh"}


def public_names() -> list[tuple[str, str]]:
    return [(package, name) for package in LAZY for name in importlib.import_module(package).__all__]


@pytest.mark.parametrize(("package", "name"), public_names(), ids=lambda text: text)
def test_public_names_are_there(package, name):
    found = getattr(importlib.import_module(package), name)
    assert getattr(found, "__name__", name) == name


@pytest.mark.parametrize("package", LAZY)
def test_no_public_name_is_that_of_a_module(package):
    # Once the module is loaded, the package would show it in the name's place.
    module = importlib.import_module(package)
    folder = Path(module.__file__).parent
    modules = {path.stem for path in folder.iterdir() if path.suffix == ".py" or (path / "__init__.py").is_file()}
    assert not modules & set(module.__all__)


def test_unknown_names_are_refused():
    import optics

    with pytest.raises(AttributeError, match="Telescope"):
        optics.Telescope  # noqa: B018  (the access is the test)


def test_loading_the_packages_is_light():
    code = f"import sys, {', '.join(LAZY)}, rigs; print(sorted({HEAVY} & set(sys.modules)))"
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ast.literal_eval(child.stdout) == []
