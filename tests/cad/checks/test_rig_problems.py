"""A rig against the mesh of its hull: a box whose sides are where the rig needs them, or not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cad.assembly.hull_surface import file_hull_distance
from cad.checks.rig_problems import rig_problems
from optics.feasibility.envelope import box_distance
from rigs import FileHull, Rig

HALF_MM = np.array([325.0, 130.5, 65.0])
"""aqua2's body: its port stands 5 mm proud of the front, its anchors lie on top and bottom."""


@pytest.fixture(scope="module")
def box_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("hull") / "box.stl"
    trimesh.creation.box(extents=2 * HALF_MM).export(file)
    return file


def boxed(file: Path, **hull: Any) -> Rig:
    return Rig.load("aqua2").with_gaze(hull=FileHull(shape="file", file=file, unit="mm", **hull))


def told(rig: Rig) -> dict[str, str]:
    return {problem.place: problem.expected for problem in rig_problems(rig)}


def test_distance_from_a_file_is_that_of_its_box(box_file: Path) -> None:
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 4, 3))
    distance = file_hull_distance(boxed(box_file))
    assert distance is not None
    assert distance(points) == pytest.approx(box_distance(points, HALF_MM / 1000), abs=1e-9)
    assert file_hull_distance(Rig.load("aqua2")) is None


def test_presets_are_good_as_they_are_and_on_the_mesh_of_their_hull(box_file: Path) -> None:
    assert rig_problems(Rig.load("aqua2")) == []
    assert rig_problems(boxed(box_file, window="cut")) == []


def test_a_port_in_closed_skin_asks_for_a_window(box_file: Path) -> None:
    problems = told(boxed(box_file))
    assert list(problems) == ["hull.window"]
    assert "100% of the rays to M1" in problems["hull.window"]
    assert "between the pinhole and the port" in problems["hull.window"]


def test_skin_in_front_of_the_port_is_named_with_its_distance(box_file: Path) -> None:
    # The port's face is at x = 330; a hull moved by 15 mm has its front at 340, and there M1's plate is clear still.
    problems = told(boxed(box_file, position_mm=(15.0, 0.0, 0.0)))
    assert "10.0 mm inside" in problems["camera.position_mm"]
    assert told(boxed(box_file, position_mm=(15.0, 0.0, 0.0), window="cut")) == {}


def test_everything_wrong_with_a_buried_rig_comes_at_once(box_file: Path) -> None:
    problems = told(boxed(box_file, position_mm=(200.0, 0.0, -20.0)))
    assert set(problems) == {
        "camera.position_mm",
        "mount.fold_anchor_mm",
        "mount.base_anchor_mm",
        "fold_mirror.distance_mm",
        "gaze_mirror.distance_mm",
    }
    # The front is at x = 525, the port's face at 330; the top at z = 45, the fold anchor at 65.
    assert "195 mm along its view, at [497.0, 60.0, 0.0], it is outside" in problems["camera.position_mm"]
    assert "20.0 mm outside, and the surface is at [276.0, 60.0, 45.0]" in problems["mount.fold_anchor_mm"]
    assert "moved with the camera, it is clear" in problems["fold_mirror.distance_mm"]
