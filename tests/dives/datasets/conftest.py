"""A small data set in open water, made once."""

import pytest

from dives.datasets.dataset import Dataset, parse_dataset
from dives.datasets.run import make_dataset
from scenes.baking.light_quality import LightQuality

SMALL_SET = """
name = "small"
samples = 6
seed = 7
licence = "CC-BY-4.0"
splits = { train = 2, val = 1 }
formats = ["coco", "yolo", "bop", "webdataset", "parquet"]
boxes = ["target", "decoy"]

[scene]
rig = "small.toml"
world = "blue"
depth_m = 4.0

[joints]
q1_deg = "-60..60"
q2_deg = { mean = 0.0, deviation = 10.0, low = -20.0, high = 20.0 }

[target]
colour = ["red", "orange"]
diameter_m = { values = [0.25, 0.35], weights = [1, 1] }
azimuth_deg = "-5..5"
distance_m = { low = 0.8, high = 2.0, log = true }

[[decoys]]
colour = "yellow"
diameter_m = 0.2
azimuth_deg = "-40..40"
present = 0.5
"""


@pytest.fixture(scope="package")
def small_set(small_folder) -> Dataset:
    """Six samples of 160 x 120 in two scenes."""
    return parse_dataset(SMALL_SET, source="small", folder=small_folder, quality=LightQuality.coarse())


@pytest.fixture(scope="package")
def made(small_set, tmp_path_factory):
    """Folder of the small set, whole."""
    folder = tmp_path_factory.mktemp("set") / "small"
    make_dataset(small_set, folder)
    return folder


def files_of(folder):
    """Content of every file, by its path in a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
