"""COCO files, read by pycocotools."""

import json

import cv2
import numpy as np
import pytest

from dives.datasets.formats.coco import compressed
from scenes.stage.frame import Label
from scenes.truth.coco import run_lengths

pycocotools_mask = pytest.importorskip("pycocotools.mask")
coco = pytest.importorskip("pycocotools.coco")


def loaded(made, split):
    return coco.COCO(str(made / f"annotations/instances_{split}.json"))


# pycocotools' own arrays know no NumPy 2.
@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
def test_pycocotools_reads_boxes_and_masks_of_all_images(made):
    images = 0
    for split in ("train", "val"):
        read = loaded(made, split)
        for image in read.loadImgs(read.getImgIds()):
            images += 1
            shown = cv2.imread(str(made / image["file_name"]))
            assert shown.shape[:2] == (image["height"], image["width"])
            semantic = cv2.imread(str(made / image["file_name"].replace("images", "semantic")), cv2.IMREAD_UNCHANGED)
            masks = np.zeros_like(semantic)
            for annotation in read.loadAnns(read.getAnnIds(image["id"])):
                mask = read.annToMask(annotation)
                assert mask.sum() == annotation["area"]
                np.testing.assert_array_equal(pycocotools_mask.toBbox(read.annToRLE(annotation)), annotation["bbox"])
                masks[mask > 0] = annotation["category_id"]
            things = np.isin(semantic, (Label.TARGET, Label.DECOY))
            np.testing.assert_array_equal(masks, np.where(things, semantic, 0))
    assert images == 6


def test_categories_are_those_that_the_file_asks_for(made):
    document = json.loads((made / "annotations/instances_train.json").read_text())
    assert [each["name"] for each in document["categories"]] == ["target", "decoy"]
    assert document["licenses"][0]["name"] == "CC-BY-4.0"


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 1.0])
def test_packed_run_lengths_are_those_of_pycocotools(share):
    mask = np.random.default_rng(1).random((200, 300)) < share
    encoded = pycocotools_mask.encode(np.asfortranarray(mask.astype(np.uint8)))
    assert compressed(run_lengths(mask)) == encoded["counts"].decode()
