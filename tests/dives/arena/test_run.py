"""Diving the arena: what is done stays done, failures are told, and images are those of the dive."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from cad.assembly.meshes import rig_meshes
from dives.arena import replay
from dives.arena.distribution import ArenaDive, arena_dive
from dives.arena.run import NUMBERS_FILE, drawn_digest, run_arena, with_loop
from dives.known_target import with_known_target
from dives.runner import ClosedLoop, run_dive
from scenes.baking.light_quality import LightQuality
from tracking.overlay import overlay


def pretend(seed, variant, folder):
    """Write down which dive it would have been; seed 1 fails."""
    if seed == 1:
        raise OSError("no disk")
    Path(folder).mkdir(parents=True)
    found = {"drawn": drawn_digest(arena_dive(seed).dive), "numbers": {"seed": seed, "variant": variant}}
    (Path(folder) / NUMBERS_FILE).write_text(json.dumps(found), encoding="utf-8")


def run(folder, seeds):
    said = []
    outcomes = run_arena(seeds, ["default"], folder, workers=2, log=said.append, work=pretend)
    return outcomes, said


def test_what_is_done_stays_done_and_failures_keep_nobody(tmp_path):
    outcomes, said = run(tmp_path, [0, 1])
    assert [(each.seed, each.variant, each.numbers) for each in outcomes] == [
        (0, "default", {"seed": 0, "variant": "default"}),
        (1, "default", None),
    ]
    assert outcomes[1].failure.sentence == "OSError: no disk"
    assert len(said) == 2
    again, said = run(tmp_path, [0, 2])
    assert [each.numbers["seed"] for each in again] == [0, 2]
    assert said[0] == "1 of 2 dives: done before"
    assert said[1].startswith("2 of 2 dives")


def test_the_default_without_a_part_is_dived_beside_it(tmp_path):
    loops = ["default", "default-without-contrast"]
    assert with_loop(arena_dive(0), loops[1]).loop_variant().contrast is False
    for _ in range(2):
        outcomes = run_arena([0], loops, tmp_path, workers=2, log=print, work=pretend)
        assert [each.numbers["variant"] for each in outcomes] == loops
    assert {path.name for path in tmp_path.iterdir()} == {f"0000-{loop}" for loop in loops}


def test_a_folder_of_another_draw_is_refused(tmp_path):
    run(tmp_path, [0])
    file = tmp_path / "0000-default" / NUMBERS_FILE
    file.write_text(file.read_text(encoding="utf-8").replace('"drawn": "', '"drawn": "0'), encoding="utf-8")
    with pytest.raises(ValueError, match="expected the dive that is drawn for this seed"):
        run(tmp_path, [0])


@pytest.mark.parametrize(("variants", "workers", "said"), [(["best"], 1, "loop best"), (["default"], 0, "one worker")])
def test_bad_input_is_told_before_anything_is_dived(variants, workers, said, tmp_path):
    with pytest.raises(ValueError, match=said):
        run_arena([0], variants, tmp_path, workers=workers, log=print, work=pretend)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def quiet(small_dive, monkeypatch):
    """What every seed is: a small dive without video."""
    quiet = small_dive.model_copy(update={"video": "none", "overlay": False})
    monkeypatch.setattr(replay, "arena_dive", lambda seed: ArenaDive(seed=seed, dive=quiet, factors={}))
    monkeypatch.setattr(replay, "arena_rig", lambda name: quiet.load_rig())
    return quiet


def test_images_are_those_of_the_dive(quiet, tmp_path):
    """Frame 5, drawn whole after five that were not, is frame 5 of a dive that is drawn whole throughout."""
    replay.write_frames(0, "default", {5: str(tmp_path / "key_frames" / "five.png")}, quality=LightQuality.coarse())
    rig = quiet.load_rig()
    closed = ClosedLoop(with_known_target(quiet, rig), rig, rig_meshes(rig), LightQuality.coarse())
    closed.whole_images = True
    for _ in range(6):
        record = closed.next()
    expected = overlay(record.camera_frame, record.step)
    found = cv2.imread(str(tmp_path / "key_frames" / "five.png"))[..., ::-1]
    assert np.array_equal(found, expected)


def test_a_video_is_the_overlay_of_the_dive_to_the_byte(quiet, tmp_path):
    """As `run_dive` writes it when asked for it, with or without single images; nothing else is left beside it."""
    coarse = LightQuality.coarse()
    images = {2: str(tmp_path / "film" / "two.png")}
    replay.write_frames(0, "default", images, str(tmp_path / "film" / "overlay.mp4"), quality=coarse)
    dived = run_dive(quiet.model_copy(update={"overlay": True}), tmp_path / "dive", quality=coarse)
    assert (tmp_path / "film" / "overlay.mp4").read_bytes() == (dived / "overlay.mp4").read_bytes()
    assert {path.name for path in (tmp_path / "film").iterdir()} == {"two.png", "overlay.mp4"}
