"""The names that `docs` and README promise can be imported from `optics`, and loading the package is light."""

import subprocess
import sys

import pytest

import optics


@pytest.mark.parametrize("name", optics.__all__)
def test_public_names_are_there(name):
    assert getattr(optics, name).__name__ == name
    assert optics.HOMES.keys() == set(optics.__all__)


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="no attribute 'Telescope'"):
        optics.Telescope  # noqa: B018  (the access is the test)


def test_loading_the_package_chooses_no_backend():
    code = "import sys, optics; print(sorted({'drjit', 'mitsuba'} & set(sys.modules)))"
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert child.stdout.strip() == "[]"
