"""A rig on a hull of one's own, from the file to a mount that builds; and placed again after a change."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from cad.placement.fold_frame import BASE_ANCHOR, CAMERA, FOLD_ANCHOR, PLACED_KEYS
from cad.placement.placement import Placement
from reports.studies import new_rig
from reports.studies import placement as studied
from reports.studies.new_rig import new_rig_on_hull
from reports.studies.placement import pinned_keys, place_rig_file, placement_rows
from rigs import Rig, load_document
from tests.cad.placement.conftest import LENGTH_MM, RADIUS_MM, capsule

__all__ = ["capsule"]


def _silent(line: str) -> None:
    pass


@pytest.fixture(scope="module")
def file(capsule: trimesh.Trimesh, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("placed")
    capsule.export(folder / "eel.stl")
    new_rig_on_hull("eel", folder / "eel.toml", folder / "eel.stl", log=_silent)
    return folder / "eel.toml"


def test_a_hull_gets_a_mount_that_builds(file: Path) -> None:
    # Only what was built and checked is written; here the places are looked at.
    rig = Rig.load(file)
    mount, half = rig.require_gaze().mount, LENGTH_MM / 2 - RADIUS_MM
    depth = 28.0  # pinhole to the port's outer face
    assert rig.camera.position_mm[0] + depth == pytest.approx(LENGTH_MM / 2 + 5, abs=5)
    for anchor in (mount.fold_anchor_mm, mount.base_anchor_mm):
        away = np.linalg.norm(np.array(anchor) - [np.clip(anchor[0], -half, half), 0, 0]) - RADIUS_MM
        assert abs(away) < 1
    assert mount.fold_anchor_mm[2] * mount.base_anchor_mm[2] < 0
    volume = np.pi * RADIUS_MM**2 * (2 * half) + 4 / 3 * np.pi * RADIUS_MM**3
    assert rig.vehicle is not None
    assert rig.vehicle.mass_kg == pytest.approx(volume / 1e9 * 1026, rel=0.01)


def test_what_was_placed_is_marked_with_its_reason(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert "# placed: the nearest seat that holds a flange" in text
    assert pinned_keys(load_document(file)) == set()


def test_without_its_mark_a_key_is_pinned(file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    rig = Rig.load(file)
    asked = []

    def kept(rig: Rig, hull: trimesh.Trimesh, *, pinned: set[str], log: object) -> Placement:
        asked.append(pinned)
        return Placement(rig=rig, reasons={BASE_ANCHOR: "asked"}, rejected=())

    monkeypatch.setattr(studied, "place", kept)
    document = load_document(file)
    document["camera"]["position_mm"].trivia.comment = ""
    document["mount"]["fold_anchor_mm"].trivia.comment = "# measured"
    document["hull"]["file"] = str(file.with_suffix(".stl"))
    (tmp_path / "eel.toml").write_text(document.as_string(), encoding="utf-8")
    placed = place_rig_file(str(tmp_path / "eel.toml"), log=_silent)
    assert asked == [{CAMERA, FOLD_ANCHOR}]
    assert Rig.load(tmp_path / "eel.toml").require_gaze().mount == rig.require_gaze().mount
    (row,) = placement_rows(placed)
    assert (row[0], row[2]) == (BASE_ANCHOR, "asked")
    assert "# placed: asked" in (tmp_path / "eel.toml").read_text(encoding="utf-8")


def test_a_camera_that_looks_elsewhere_is_written_before_it_is_placed(
    file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def kept(rig: Rig, hull: trimesh.Trimesh, *, pinned: set[str], log: object) -> Placement:
        assert (rig.camera.position_mm, rig.camera.yaw_deg, rig.camera.pitch_deg) == ((480.0, 0.0, 10.0), 30.0, -20.0)
        assert pinned == {CAMERA}
        return Placement(rig=rig, reasons={}, rejected=())

    monkeypatch.setattr(studied, "place", kept)
    new_rig_on_hull(
        "eel",
        tmp_path / "eel.toml",
        file.with_suffix(".stl"),
        camera_mm=(480.0, 0.0, 10.0),
        look_deg=(30.0, -20.0),
        log=_silent,
    )
    text = (tmp_path / "eel.toml").read_text(encoding="utf-8")
    assert "yaw_deg = 30.0 # as given: to the left\npitch_deg = -20.0 # as given: up\n" in text


def test_a_camera_of_the_robot_brings_where_it_looks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(studied, "place", lambda rig, hull, **given: Placement(rig=rig, reasons={}, rejected=()))
    link = '<link name="b"><visual><geometry><box><size>1 0.3 0.3</size></box></geometry></visual>{}</link>'
    eye = '<sensor name="eye" type="camera"><pose>0.4 0.1 0 0 0.35 0.5</pose></sensor>'
    (tmp_path / "r.sdf").write_text(f'<sdf version="1.9"><model name="r">{link.format(eye)}</model></sdf>')
    new_rig_on_hull("eel", tmp_path / "eel.toml", tmp_path / "r.sdf", camera_from="eye", log=_silent)
    camera = Rig.load(tmp_path / "eel.toml").camera
    assert camera.position_mm == (400.0, 100.0, 0.0)
    assert (camera.yaw_deg, camera.pitch_deg, camera.roll_deg) == pytest.approx((28.6, -20.1, 0.0), abs=0.06)
    assert "# of eye: to the left" in (tmp_path / "eel.toml").read_text(encoding="utf-8")


def test_where_skin_is_missing_that_is_said_with_what_does_not_fit(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A scan that has lost every other patch of its skin, beside a tube that is open at both ends."""

    def nothing_fits(rig: Rig, hull: trimesh.Trimesh, **given: object) -> Placement:
        raise ValueError("expected a hull with room for a mount, found none")

    monkeypatch.setattr(studied, "place", nothing_fits)
    monkeypatch.setattr(new_rig, "file_hull_solid", lambda section: trimesh.creation.box(extents=(800, 200, 200)))
    tube = trimesh.creation.cylinder(
        100, 800, sections=16, transform=trimesh.transformations.rotation_matrix(1.5708, (0, 1, 0))
    )
    tube.update_faces(np.abs(tube.face_normals[:, 0]) < 0.5)
    tube.export(tmp_path / "tube.stl")
    tube.subdivide().submesh([np.arange(0, 4 * len(tube.faces), 2)], append=True).export(tmp_path / "scan.stl")
    with pytest.raises(ValueError, match=r"found none$"):
        new_rig_on_hull("eel", tmp_path / "eel.toml", tmp_path / "tube.stl", unit="mm", log=_silent)
    with pytest.raises(ValueError, match=r"found none; no flange stands where skin is missing \(.*: fill the holes"):
        new_rig_on_hull("eel", tmp_path / "eel.toml", tmp_path / "scan.stl", unit="mm", log=_silent)
    assert not (tmp_path / "eel.toml").exists()


def test_a_name_that_no_rig_can_have_is_refused_before_the_hull_is_worked_on(
    file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(new_rig, "file_hull_solid", lambda section: pytest.fail("a solid was made"))
    with pytest.raises(ValueError, match=r"name = 'Eel\.1': expected lower-case letters"):
        new_rig_on_hull("Eel.1", tmp_path / "eel.toml", file.with_suffix(".stl"), log=_silent)


def test_presets_and_files_with_everything_pinned_are_refused(file: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"expected a rig file of yours.*mirrorgaze new"):
        place_rig_file("torpedo", log=_silent)
    document = load_document(file)
    for key in PLACED_KEYS:
        section, name = key.split(".")
        document[section][name].trivia.comment = ""
    document["hull"]["file"] = str(file.with_suffix(".stl"))
    (tmp_path / "eel.toml").write_text(document.as_string(), encoding="utf-8")
    before = (tmp_path / "eel.toml").read_bytes()
    with pytest.raises(ValueError, match="all of them pinned; put the comment '# placed'"):
        place_rig_file(str(tmp_path / "eel.toml"), log=_silent)
    assert (tmp_path / "eel.toml").read_bytes() == before
