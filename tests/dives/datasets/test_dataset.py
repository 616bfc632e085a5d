"""A data set's file: every problem at once, in its words."""

from dataclasses import replace

import pytest

from dives.datasets.dataset import DatasetError, parse_dataset
from scenes.baking.light_quality import LightQuality
from tests.dives.datasets.conftest import SMALL_SET

BAD_VALUES = """
name = "Bad"
samples = 0
splits = { train = 0 }
[scene]
rig = "aqua2"
depth_m = [3, 3]
[joints]
q1_deg = "far"
[target]
diametre_m = 3
"""

BAD_NAMES = """
name = "bad"
samples = 3
[scene]
rig = ["aqua2", "nothing"]
world = "moon"
depth_m = 3
water = ["IB", "XX", "none.csv"]
[joints]
q1_deg = [0, 100]
[target]
shape = ["ball", "diver"]
colour = "red"
[[decoys]]
shape = "diver"
diameter_m = 1
"""


@pytest.mark.parametrize(
    ("text", "places"),
    [
        (BAD_VALUES, {"name", "samples", "scene.depth_m", "joints.q1_deg", "target.diametre_m"}),
        (
            BAD_NAMES,
            {
                "scene.rig[1]",
                "scene.world",
                "scene.water[1]",
                "scene.water[2]",
                "joints.q1_deg",
                "target.shape",
                "decoys[0].shape",
            },
        ),
        ('name = "bad"\nsamples = 3\nsplits = { train = 0 }\n[scene]\nrig = "aqua2"\ndepth_m = 3\n', {"(whole file)"}),
        ("name = ", {"end of document"}),
    ],
)
def test_every_problem_is_told_at_once(text, places, tmp_path):
    with pytest.raises(DatasetError) as refused:
        parse_dataset(text, source="bad", folder=tmp_path)
    assert {problem.place for problem in refused.value.problems} == places


def test_what_is_of_the_whole_set_changes_no_sample(small_set, small_folder):
    more = SMALL_SET.replace("samples = 6", "samples = 9").replace("CC-BY-4.0", "CC0")
    other = SMALL_SET.replace("seed = 7", "seed = 8")
    identities = [
        parse_dataset(text, source="small", folder=small_folder, quality=small_set.quality).identity
        for text in (more, other)
    ]
    assert identities[0] == small_set.identity != identities[1]


def test_the_light_is_part_of_a_set_unless_it_is_full(small_set):
    """So that a set that was begun before it could be chosen can go on."""
    kinds = (None, LightQuality.full(), LightQuality.draft())
    default, full, draft = (replace(small_set, quality=quality).identity for quality in kinds)
    assert default == full != draft


def test_water_may_be_a_file_of_absorption_and_scattering(small_folder, tmp_path):
    (tmp_path / "bay.csv").write_text("wavelength_nm,a_per_m,b_per_m\n400,0.1,0.2\n550,0.1,0.2\n700,0.6,0.2\n")
    (tmp_path / "small.toml").write_bytes((small_folder / "small.toml").read_bytes())
    text = SMALL_SET.replace("depth_m", 'water = ["IB", "bay.csv"]\ndepth_m')
    dataset = parse_dataset(text, source="small", folder=tmp_path)
    assert dataset.spec.scene.water == ("IB", str(tmp_path / "bay.csv"))
    before = dataset.identity
    (tmp_path / "bay.csv").write_text("wavelength_nm,a_per_m,b_per_m\n400,0.2,0.2\n550,0.1,0.2\n700,0.6,0.2\n")
    assert parse_dataset(text, source="small", folder=tmp_path).identity != before
