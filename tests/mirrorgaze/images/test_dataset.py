"""`mirrorgaze dataset`: what it prints, and how it ends. Making sets itself is tested with the dives."""

import json
import os
import tomllib

import pytest
from typer.testing import CliRunner

from dives.datasets import run
from dives.datasets.run import DatasetResult
from mirrorgaze.cli import app
from optics.workers.shards import Shard

SPEC = 'name = "balls"\nsamples = 5\n[scene]\nrig = "aqua2"\ndepth_m = 3\n'


def dataset(*arguments):
    return CliRunner().invoke(app, ["dataset", *map(str, arguments)])


@pytest.fixture
def spec(here):
    (here / "balls.toml").write_text(SPEC)
    return here / "balls.toml"


@pytest.fixture
def asked(monkeypatch):
    """What is asked of `make_dataset`, which makes nothing here."""
    asked = []

    def make(dataset, folder, *, workers, scheduler, shard, progress, log):
        asked.append((dataset.spec.name, str(folder), workers, scheduler, shard))
        progress(5, 5)
        if shard is not None:
            return DatasetResult(folder=folder, done=3, samples=5, failed={}, broken={}, files=())
        if scheduler is not None:
            broken = {"scene 0, samples 1 to 4": "sample 3: 3 workers died"}
            return DatasetResult(folder=folder, done=4, samples=5, failed={}, broken=broken, files=())
        failed = {4: "sample 4: expected room"} if "crowded" in str(folder) else {}
        return DatasetResult(folder=folder, done=5, samples=5, failed=failed, broken={}, files=("samples.parquet",))

    monkeypatch.setattr(run, "make_dataset", make)
    return asked


def test_a_whole_set_says_what_there_is(spec, asked):
    done = dataset(spec)
    assert (done.exit_code, asked) == (0, [("balls", "out/balls", os.cpu_count(), None, None)])
    assert "out/balls: 5 samples, samples.parquet" in done.stdout


def test_a_shard_says_what_is_missing(spec, asked):
    done = dataset(spec, "-o", "there", "--shard", "2/4")
    assert (done.exit_code, asked) == (0, [("balls", "there", os.cpu_count(), None, Shard(2, 4))])
    assert "there: 3 of 5 samples" in done.stdout


def test_samples_that_cannot_be_made_are_named(spec, asked):
    done = dataset(spec, "-o", "crowded", "--json")
    assert done.exit_code == 1
    assert json.loads(done.stdout)["failed"] == {"4": "sample 4: expected room"}
    assert "crowded: sample 4: expected room" in done.stderr


def test_pieces_that_could_not_be_made_are_named(spec, asked):
    done = dataset(spec, "--scheduler", "tcp://10.0.0.1:8786", "--workers", 3)
    assert (done.exit_code, asked[0][2:4]) == (1, (3, "tcp://10.0.0.1:8786"))
    assert "4 of 5 samples; the same command tries the rest again" in done.stdout
    assert "scene 0, samples 1 to 4: sample 3: 3 workers died" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "one of SPEC"),
        (("balls.toml", "--schema"), "one of SPEC"),
        (("nothing.toml",), "nothing.toml"),
        (("balls.toml", "--shard", "5/4"), "--shard 5/4"),
        (("--verify", "."), "no manifest.json"),
    ],
)
def test_bad_input_is_a_sentence(spec, arguments, words):
    done = dataset(*arguments)
    assert done.exit_code == 2
    assert words in done.stderr


def test_a_bad_file_writes_nothing(here, spec):
    spec.write_text(SPEC.replace("depth_m = 3", "depth_m = -3"))
    done = dataset(spec)
    assert done.exit_code == 2
    assert "scene.depth_m[0] = -3" in done.stderr
    assert [path.name for path in here.iterdir()] == ["balls.toml"]


def test_the_schema_is_one_that_validates(spec):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(dataset("--schema").stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(tomllib.loads(SPEC), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads(SPEC) | {"sample": 3}, schema)
