"""The wheel: it holds every package with its data and nothing else, and works installed far from the repository."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
PACKAGES = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"][
    "packages"
]

DATA = (
    "rigs/presets/aqua2.toml",
    "rigs/data/servos.toml",
    "optics/water/data/jerlov1976_kd.csv",
    "optics/water/data/port_materials.json",
    "scenes/light/data/astm_g173_350_750.csv",
    "dives/presets/spiral.toml",
    "reports/pages/explorer.html",
    "reports/pages/page.css",
    "reports/pages/page.html",
    "reports/pages/pdf.typ",
    *(f"{package}/py.typed" for package in PACKAGES),
)
"""One file of each kind that is no code."""

VIEW = ("--world", "blue", "--width-px", "8", "--height-px", "6", "--samples", "1")


@dataclass(frozen=True, kw_only=True)
class Environment:
    """An environment that the wheel alone was installed in; what it depends on is found where the tests find it."""

    folder: Path

    def run(self, command: str, *arguments: str, cwd: Path) -> str:
        # Nothing of the repository may be found by the way the tests were started.
        clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        program = self.folder / "bin" / command
        done = subprocess.run([program, *arguments], cwd=cwd, env=clean, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=REPOSITORY, check=True, capture_output=True)
    (made,) = folder.iterdir()
    return made


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Environment:
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    pip = [sys.executable, "-m", "pip", "--python", str(folder / "bin/python"), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--no-deps", "--no-index", str(wheel)], check=True, capture_output=True)
    # A path in a .pth file comes behind the environment's own, and the .pth files that lie there are not read: an
    # editable install of the repository stays unknown.
    own = Path(sysconfig.get_path("purelib", "venv", {"base": str(folder)}))
    paths = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (own / "dependencies.pth").write_text("\n".join(sorted(paths)))
    return Environment(folder=folder)


def test_all_packages_are_in_it_with_their_data_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    files = (path for package in PACKAGES for path in (REPOSITORY / package).rglob("*") if path.is_file())
    assert held == {path.relative_to(REPOSITORY).as_posix() for path in files if "__pycache__" not in path.parts}
    assert set(DATA) <= held


def test_every_package_comes_from_it(installed, tmp_path):
    code = f"import {', '.join(PACKAGES)}\nfor each in ({', '.join(PACKAGES)}): print(each.__file__)"
    found = installed.run("python", "-c", code, cwd=tmp_path).splitlines()
    assert len(found) == len(PACKAGES)
    assert all(Path(file).is_relative_to(installed.folder) for file in found), found


@pytest.mark.slow
def test_a_rig_is_begun_checked_and_rendered_from_another_folder(installed, tmp_path):
    installed.run("mirrorgaze", "new", "pool", "--from", "bench", cwd=tmp_path)
    assert "pool" in installed.run("mirrorgaze", "check", "pool.toml", cwd=tmp_path)
    installed.run("mirrorgaze", "render", "pool.toml", *VIEW, "-o", "view.png", cwd=tmp_path)
    assert (tmp_path / "view.png").read_bytes().startswith(b"\x89PNG")
