"""What the arena draws: the same for a seed, possible dives, and rigs that see what their presets see."""

import numpy as np
import pytest

from dives.arena.distribution import OFF_THE_WORLD_M, PLACES, RIGS, arena_dive, arena_rig
from dives.checks import dive_problems, instants
from dives.paths import target_pose
from optics.train import OpticalTrain
from rigs import ImageSensorSpec, Rig
from scenes.worlds import world_named

SEEDS = range(12)


@pytest.fixture(scope="module")
def drawn():
    return [arena_dive(seed) for seed in SEEDS]


def test_a_seed_is_one_dive(drawn):
    again = arena_dive(5)
    assert again.dive == drawn[5].dive
    assert again.factors == drawn[5].factors
    assert len({each.dive.model_dump_json(exclude={"name", "seed"}) for each in drawn}) == len(drawn)


def test_dives_with_a_red_decoy_are_told_apart(drawn):
    for each in drawn:
        colours = {decoy.colour for decoy in each.dive.decoys}
        assert (each.factors["red decoy"] == "yes") == ("red" in colours) == (each.factors["decoys"] == "a red one")
    assert {each.factors["red decoy"] for each in drawn} == {"yes", "no"}


def test_every_dive_can_be_dived(drawn):
    for each in drawn:
        assert dive_problems(each.dive) == []
        assert not each.dive.functional_check
        assert each.dive.rig == each.factors["rig"]


def test_targets_keep_off_the_world(drawn):
    """By the corners of its triangles, which are no nearer than its faces."""
    for each in drawn:
        corners = world_named(each.dive.world, each.dive.depth_m, 0).vertices_m
        if len(corners):
            places = target_pose(each.dive, instants(each.dive)[::20]).translation
            nearest = min(float(np.linalg.norm(corners - place, axis=1).min()) for place in places)
            assert nearest > each.dive.target.diameter_m / 2 + OFF_THE_WORLD_M


def test_what_is_drawn_varies(drawn):
    """40 seeds draw every place, every rig and every kind of decoys: each is missed in fewer than 1 of 500 cases."""
    factors = [each.factors for each in (*drawn, *map(arena_dive, range(len(SEEDS), 40)))]
    assert {each["place"] for each in factors} == {place.name for place in PLACES}
    assert {each["rig"] for each in factors} == set(RIGS)
    assert {each["decoys"] for each in factors} == {"none", "of other colours", "a red one"}


def test_a_negative_seed_is_refused():
    with pytest.raises(ValueError, match="a seed of 0 or more, got -1"):
        arena_dive(-1)


@pytest.mark.parametrize("name", RIGS)
def test_a_camera_that_skips_pixels_sees_the_same(name):
    """The same rays at the same distances from the image's edge, and the same time from the first row to the last.

    What does not fill a whole pixel at the end is left out.
    """
    rig, skipping = Rig.load(name), arena_rig(name)
    pixels = np.array([[300.0, 200.0], [250.5, 260.0]])
    directions = [
        OpticalTrain.from_rig(each, q1=0.0, q2=0.0).trace(places).direction
        for each, places in ((rig, pixels), (skipping, (pixels + 0.5) / RIGS[name] - 0.5))
    ]
    np.testing.assert_allclose(*directions, atol=1e-9)
    before, after = (
        each.camera.height_px * (each.image_sensor or ImageSensorSpec()).row_time_us for each in (rig, skipping)
    )
    assert after == pytest.approx(before, rel=RIGS[name] / rig.camera.height_px)
