"""The card of a data set: what hubs read of it, and counts that are true."""

import json
import re
from typing import get_args

import cv2
import pyarrow.parquet as pq
import yaml

from dives.datasets.card import FORMAT_WORDS
from dives.datasets.finishing import FORMATS
from dives.datasets.specification import Format


def test_the_card_counts_what_is_there(made):
    text = (made / "README.md").read_text()
    rows = pq.read_table(made / "samples.parquet").to_pylist()
    for split in ("train", "val"):
        chosen = [row for row in rows if row["split"] == split]
        seen = sum(row["target.pixels"] > 0 for row in chosen)
        assert f"| {split} | {len(chosen)} | {seen} | {sum(row['bytes'] for row in chosen) / 1e6:.1f} |" in text
    diameters = [row["target.diameter_m"] for row in rows]
    assert re.search(rf"\| target.diameter_m \| {min(diameters):.4g} \|.*\| {max(diameters):.4g} \|", text)
    assert "| target.colour | orange: 3, red: 3 |" in text
    assert "CC-BY-4.0" in text
    told = [name for name, words in FORMAT_WORDS.items() if f"| {name} | {words} |" in text]
    assert told == ["coco", "yolo", "bop", "webdataset", "parquet"]


def test_every_format_has_its_words():
    assert FORMAT_WORDS.keys() == FORMATS.keys() == set(get_args(Format))


def test_hubs_find_licence_and_files(made):
    front = yaml.safe_load((made / "README.md").read_text().split("---\n")[1])
    assert front["license"] == "cc-by-4.0"
    for files in front["configs"][0]["data_files"]:
        assert list(made.glob(files["path"]))


def test_the_contact_sheet_is_a_picture_that_the_manifest_knows(made):
    sheet = cv2.imread(str(made / "contact_sheet.png"))
    assert sheet.shape == (2 * 180, 8 * 240, 3)
    assert "contact_sheet.png" in json.loads((made / "manifest.json").read_text())["files"]
