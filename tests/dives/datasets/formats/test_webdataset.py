"""Tar shards, read by webdataset."""

import gc
import json

import numpy as np
import pytest

webdataset = pytest.importorskip("webdataset")


# It leaves the files that it reads open.
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_webdataset_reads_every_sample_with_all_its_layers(made):
    found = {}
    for split in ("train", "val"):
        shards = [str(path) for path in sorted((made / "webdataset").glob(f"{split}-*.tar"))]
        for sample in webdataset.WebDataset(shards, shardshuffle=False).decode("rgb8"):
            assert sample["json"]["split"] == split
            found[sample["__key__"]] = sample
    gc.collect()
    assert sorted(found) == [f"{index:08d}" for index in range(6)]
    for key, sample in found.items():
        record = json.loads((made / f"samples/00000/{key}.json").read_text())
        assert sample["json"] == record
        assert sample["image.png"].shape == (120, 160, 3)
        assert sample["image.png"].dtype == np.uint8
        assert {name for name in sample if name.endswith(".png")} == {
            f"{layer}.png" for layer in ("image", "depth", "normal", "semantic", "instance", "path")
        }
