"""YOLO files, as training code reads them: images from lists, labels from where their folder's name is exchanged."""

import json

import pytest
import yaml


def test_boxes_are_those_of_coco(made):
    data = yaml.safe_load((made / "data.yaml").read_text())
    assert data["names"] == {0: "target", 1: "decoy"}
    found = 0
    for split in ("train", "val"):
        document = json.loads((made / f"annotations/instances_{split}.json").read_text())
        category = {each["id"]: number for number, each in enumerate(document["categories"])}
        listed = (made / data["path"] / data[split]).read_text().split()
        assert listed == [f"./{image['file_name']}" for image in document["images"]]
        for name, image in zip(listed, document["images"], strict=True):
            label = name.replace("/images/", "/labels/").replace(".png", ".txt")
            lines = [list(map(float, line.split())) for line in (made / label).read_text().splitlines()]
            boxes = [each for each in document["annotations"] if each["image_id"] == image["id"]]
            assert len(lines) == len(boxes)
            for (number, u, v, width, height), each in zip(lines, boxes, strict=True):
                columns, rows = image["width"], image["height"]
                left, top = (u - width / 2) * columns, (v - height / 2) * rows
                assert number == category[each["category_id"]]
                assert [left, top, width * columns, height * rows] == pytest.approx(each["bbox"], abs=1e-3)
                found += 1
    assert found > 4
