"""Parquet files, loaded by `datasets` of Hugging Face."""

import json

import cv2
import numpy as np
import pytest

from scenes.stage.frame import Label


# What a library warns about itself is not ours.
@pytest.mark.filterwarnings("ignore")
def test_datasets_loads_images_boxes_and_numbers(made, tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    datasets = pytest.importorskip("datasets")
    files = {split: str(made / f"parquet/{split}-*.parquet") for split in ("train", "val")}
    loaded = datasets.load_dataset("parquet", data_files=files, cache_dir=str(tmp_path))
    indices = []
    for split, part in loaded.items():
        for row in part:
            indices.append(row["index"])
            assert row["split"] == split
            file = made / f"images/00000/{row['index']:08d}.png"
            np.testing.assert_array_equal(np.asarray(row["image"]), cv2.imread(str(file))[..., ::-1])
            np.testing.assert_array_equal(
                np.asarray(row["depth"]),
                cv2.imread(str(file).replace("images", "depth"), cv2.IMREAD_UNCHANGED),
            )
            record = json.loads((made / f"samples/00000/{row['index']:08d}.json").read_text())
            boxes = [each for each in record["annotations"] if each["category_id"] in (Label.TARGET, Label.DECOY)]
            assert row["objects"]["bbox"] == [each["bbox"] for each in boxes]
            assert row["objects"]["path"] == [each["region"] for each in boxes]
    assert sorted(indices) == list(range(6))
