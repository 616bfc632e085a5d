import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from cad.placement import placement
from cad.placement.candidates import Shortfalls
from cad.placement.fold_frame import CAMERA, DIRECTION, FOLD_ANCHOR
from cad.placement.placement import Wanted, default_request, place
from rigs import FileHull, Rig
from tests.cad.placement.conftest import RADIUS_MM


@pytest.fixture(scope="module")
def rig(capsule: trimesh.Trimesh, tmp_path_factory: pytest.TempPathFactory) -> Rig:
    file = tmp_path_factory.mktemp("hull") / "capsule.stl"
    capsule.export(file)
    hull = FileHull.model_validate({"shape": "file", "file": Path(file), "unit": "mm"})
    return Rig.load("torpedo").with_gaze(hull=hull, mount={"fold_attachment": "screws", "base_attachment": "screws"})


def test_what_is_pinned_stays_and_the_cheapest_comes_first(rig: Rig, capsule: trimesh.Trimesh) -> None:
    camera = rig.camera.model_copy(update={"position_mm": (480.0, 0.0, 10.0)})
    wanted = Wanted(pinned={CAMERA, DIRECTION}, request=default_request(rig))
    ranked = placement._ranked(rig.model_copy(update={"camera": camera}), capsule, wanted, Shortfalls())
    assert ranked
    assert {(direction, candidate.site.pinhole_mm) for direction, candidate in ranked} == {("down", (480.0, 0.0, 10.0))}
    costs = [candidate.cost_mm for _, candidate in ranked]
    assert costs == sorted(costs)


def test_a_pinned_anchor_is_the_only_seat(rig: Rig, capsule: trimesh.Trimesh) -> None:
    pinned = rig.with_gaze(mount={"fold_anchor_mm": (380.0, 0.0, RADIUS_MM), "fold_plane": None})
    wanted = Wanted(pinned={FOLD_ANCHOR, DIRECTION}, request=default_request(rig))
    ranked = placement._ranked(pinned, capsule, wanted, Shortfalls())
    assert {candidate.fold.point_mm for _, candidate in ranked} == {(380.0, 0.0, RADIUS_MM)}


def test_an_unknown_pin_is_refused(rig: Rig, capsule: trimesh.Trimesh) -> None:
    with pytest.raises(ValueError, match=r"pinned keys among .*, got camera\.fx_px"):
        place(rig, capsule, pinned={"camera.fx_px"})


def test_where_nothing_fits_what_binds_is_named(rig: Rig, capsule: trimesh.Trimesh) -> None:
    # A camera in the middle of the hull: M1 is inside, wherever the mirrors are.
    camera = rig.camera.model_copy(update={"position_mm": (200.0, 0.0, 0.0)})
    with pytest.raises(ValueError, match=rf"M1's cell clear of the hull.*there is room without {CAMERA} pinned"):
        place(rig.model_copy(update={"camera": camera}), capsule, pinned={CAMERA, DIRECTION})


def test_a_camera_far_from_the_hull_has_no_seat_within_reach(rig: Rig, capsule: trimesh.Trimesh) -> None:
    camera = rig.camera.model_copy(update={"position_mm": (60_000.0, 0.0, 0.0)})
    within = f"a seat for the bracket within 520 mm of M1.*there is room without {CAMERA} pinned"
    with pytest.raises(ValueError, match=within):
        place(rig.model_copy(update={"camera": camera}), capsule, pinned={CAMERA, DIRECTION})


def test_loading_leaves_no_body_of_manifold3d():
    """It says at length, at the end of every command, what bodies it finds in a module that is not unloaded."""
    load = [sys.executable, "-c", "import cad.placement.placement"]
    assert subprocess.run(load, capture_output=True, text=True, check=True).stderr == ""
