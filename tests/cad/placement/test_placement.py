import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from cad.placement import placement
from cad.placement.candidates import Shortfalls, _steepest_deg
from cad.placement.fold_frame import CAMERA, DIRECTION, FOLD_ANCHOR
from cad.placement.placement import place
from cad.placement.ranking import Ranking, _plane_mm
from cad.placement.seats import SeatFinder
from cad.placement.wanted import Wanted, default_request, easier
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
    ranked = Ranking(rig.model_copy(update={"camera": camera}), capsule, wanted, Shortfalls()).found
    assert ranked
    assert {(direction, candidate.site.pinhole_mm) for direction, candidate in ranked} == {("down", (480.0, 0.0, 10.0))}
    costs = [candidate.cost_mm for _, candidate in ranked]
    assert costs == sorted(costs)


def test_where_a_seat_is_refused_the_next_one_is_tried(rig: Rig, capsule: trimesh.Trimesh) -> None:
    """On a hull that is a seat all along, the nearest seat was once all that a design had."""
    camera = rig.camera.model_copy(update={"position_mm": (480.0, 0.0, 10.0)})
    wanted = Wanted(pinned={CAMERA, DIRECTION}, request=default_request(rig))
    ranking = Ranking(rig.model_copy(update={"camera": camera}), capsule, wanted, Shortfalls())
    given = iter(ranking)
    direction, first = next(given)
    ranking.refuse(direction, first.base.point_mm, "too near", 23.0)
    again = [candidate for _, candidate in ranking.found if candidate.shape is first.shape]
    assert len(again) == 1
    assert again[0].fold == first.fold
    assert again[0].base_arm_mm > first.base_arm_mm
    left = [candidate.base.point_mm for _, candidate in given]
    assert left
    assert min(np.linalg.norm(np.subtract(point, first.base.point_mm)) for point in left) > 23


def test_a_pinned_anchor_is_the_only_seat(rig: Rig, capsule: trimesh.Trimesh) -> None:
    pinned = rig.with_gaze(mount={"fold_anchor_mm": (380.0, 0.0, RADIUS_MM), "fold_plane": None})
    wanted = Wanted(pinned={FOLD_ANCHOR, DIRECTION}, request=default_request(rig))
    ranked = Ranking(pinned, capsule, wanted, Shortfalls()).found
    assert {candidate.fold.point_mm for _, candidate in ranked} == {(380.0, 0.0, RADIUS_MM)}


def test_a_hull_that_is_turned_with_its_camera_gets_the_same_candidates(rig: Rig, capsule: trimesh.Trimesh) -> None:
    """The hull's field and seats are looked at from the camera: what differs is rounding, and which cells it moves."""
    camera = rig.camera.model_copy(update={"position_mm": (480.0, 0.0, 10.0)})
    straight = rig.model_copy(update={"camera": camera})
    turn = Rotation.from_euler("ZYX", [30.0, 20.0, 0.0], degrees=True)
    position = tuple(turn.apply(camera.position_mm).tolist())
    angles = {"yaw_deg": 30.0, "pitch_deg": -20.0, "position_mm": position}
    turned = rig.model_copy(update={"camera": camera.model_copy(update=angles)})
    hull = trimesh.Trimesh(turn.apply(capsule.vertices), capsule.faces, process=False)
    wanted = Wanted(pinned={CAMERA, DIRECTION}, request=default_request(rig))
    _, expected = Ranking(straight, capsule, wanted, Shortfalls()).found[0]
    _, found = Ranking(turned, hull, wanted, Shortfalls()).found[0]
    np.testing.assert_allclose(found.shape.design, expected.shape.design)
    np.testing.assert_allclose(found.fold.point_mm, expected.fold.point_mm, atol=0.2)
    np.testing.assert_allclose(found.base.point_mm, expected.base.point_mm, atol=0.2)


def test_a_camera_that_looks_aslant_goes_where_the_hull_is_foremost_in_its_view() -> None:
    """On a ball that is where the skin faces the view, in the plane through its centre."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=100.0).apply_translation((0.0, 50.0, 0.0))
    for yaw, expected in ((30.0, 50 * np.cos(np.radians(30))), (0.0, 50.0)):
        turn = Rotation.from_euler("z", -yaw, degrees=True)
        found = _plane_mm(turn.apply(ball.vertices), turn)
        assert found == pytest.approx(expected, abs=2)


def test_where_nothing_fits_a_camera_may_be_turned_less(rig: Rig) -> None:
    camera = rig.camera.model_copy(update={"pitch_deg": -70.0})
    wanted = Wanted(pinned=(), request=default_request(rig))
    words = [words for words, *_ in easier(rig.model_copy(update={"camera": camera}), wanted)]
    assert words[:2] == ["with camera.pitch_deg = -35", "with camera.pitch_deg = 0"]
    assert not any("pitch" in words for words, *_ in easier(rig, wanted))


def test_decks_count_as_seats_of_a_camera_that_leans(finder: SeatFinder) -> None:
    assert [_steepest_deg(33.0, replace(finder, lean_deg=lean)) for lean in (0.0, 20.0, 40.0, 90.0)] == [33, 33, 43, 50]


def test_an_unknown_pin_is_refused(rig: Rig, capsule: trimesh.Trimesh) -> None:
    with pytest.raises(ValueError, match=r"pinned keys among .*, got camera\.fx_px"):
        place(rig, capsule, pinned={"camera.fx_px"})


def test_where_nothing_fits_what_binds_is_named(rig: Rig, capsule: trimesh.Trimesh) -> None:
    # A camera in the middle of the hull: M1 is inside, wherever the mirrors are.
    camera = rig.camera.model_copy(update={"position_mm": (200.0, 0.0, 0.0)})
    with pytest.raises(ValueError, match=rf"M1's cell clear of the hull.*there is room without {CAMERA} pinned"):
        place(rig.model_copy(update={"camera": camera}), capsule, pinned={CAMERA, DIRECTION})


def test_where_mounts_fail_as_they_are_built_only_what_was_built_is_advised(
    rig: Rig, capsule: trimesh.Trimesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mount that a larger printer alone would make: a smaller gaze range has room as well, but fails as built."""

    def problem(asked: Rig, log: object) -> str:
        bed = asked.require_gaze().mount.printer_bed_mm[0]
        return "" if bed > 300 else "mount.printer_bed_mm = 'too tall': expected less"

    monkeypatch.setattr(placement, "_problem", problem)
    monkeypatch.setattr(placement, "BUILT", 2)
    monkeypatch.setattr(placement, "easier", lambda rig, wanted: list(easier(rig, wanted))[-2:])
    camera = rig.camera.model_copy(update={"position_mm": (480.0, 0.0, 10.0)})
    pinned = {CAMERA, DIRECTION}
    said = "too tall.* turned away the last 2 that were built; there is room with a printer of 600 x 600 x 600 mm"
    with pytest.raises(ValueError, match=said):
        place(rig.model_copy(update={"camera": camera}), capsule, pinned=pinned)


def test_a_camera_far_from_the_hull_has_no_seat_within_reach(rig: Rig, capsule: trimesh.Trimesh) -> None:
    camera = rig.camera.model_copy(update={"position_mm": (60_000.0, 0.0, 0.0)})
    within = f"a seat for the bracket within 520 mm of M1.*there is room without {CAMERA} pinned"
    with pytest.raises(ValueError, match=within):
        place(rig.model_copy(update={"camera": camera}), capsule, pinned={CAMERA, DIRECTION})


def test_loading_leaves_no_body_of_manifold3d():
    """It says at length, at the end of every command, what bodies it finds in a module that is not unloaded."""
    load = [sys.executable, "-c", "import cad.placement.placement"]
    assert subprocess.run(load, capture_output=True, text=True, check=True).stderr == ""
