"""COCO: boxes and masks of each split in one JSON file, `annotations/instances_SPLIT.json`.

Masks are compressed run lengths as pycocotools has them; the layers hold the same masks.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from dives.datasets.dataset import Dataset
from dives.datasets.files import records
from dives.datasets.record import SampleRecord
from dives.datasets.rendering import FURTHER
from optics.status import Region
from rigs.atomic_files import atomic_file
from scenes.stage.frame import Label
from scenes.truth.coco import run_lengths

OWN_KEYS = ("name", "region", "further_reflection", "visible_fraction", "inside_fraction")
"""Beyond COCO's, as in `boxes.json` of a single image."""


def coco_file(split: str) -> str:
    """File of a split."""
    return f"annotations/instances_{split}.json"


def write_coco(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write a file for each split; returns their names."""
    names, chosen = [], indices_of_splits(dataset, folder, indices)
    for split, mine in chosen.items():
        names.append(coco_file(split))
        (folder / names[-1]).parent.mkdir(exist_ok=True)
        with atomic_file(folder / names[-1]) as partial, partial.open("w", encoding="utf-8") as file:
            file.writelines(_text(dataset, folder, mine))
    return names


def indices_of_splits(dataset: Dataset, folder: Path, indices: Sequence[int]) -> dict[str, list[int]]:
    """Samples of each split of the file, in their order."""
    chosen: dict[str, list[int]] = {split: [] for split in dataset.spec.splits}
    for record in records(folder, indices):
        chosen[record.split].append(record.index)
    return chosen


def category_names(dataset: Dataset) -> dict[int, str]:
    """Names of the categories by their numbers, in the order of the file's `boxes`."""
    return {int(Label[name.upper()]): name for name in dataset.spec.boxes}


def boxes_of(dataset: Dataset, record: SampleRecord) -> list[dict[str, Any]]:
    """Annotations of a record that the file asks for."""
    return [each for each in record.annotations if each["label"] in dataset.spec.boxes]


def _text(dataset: Dataset, folder: Path, chosen: Sequence[int]) -> Iterator[str]:
    """Text piece by piece: records are read twice, since those of a large set do not fit into memory."""
    spec = dataset.spec
    head = {
        "info": {"description": spec.description or spec.name, "version": "1.0"},
        "licenses": [{"id": 1, "name": spec.licence, "url": ""}],
        "categories": [{"id": number, "name": name} for number, name in category_names(dataset).items()],
        "images": [
            {
                "id": record.index,
                "file_name": record.file("images"),
                "width": record.width_px,
                "height": record.height_px,
                "license": 1,
            }
            for record in records(folder, chosen)
        ],
    }
    yield json.dumps(head, ensure_ascii=False)[:-1] + ', "annotations": ['
    number = 0
    for record in records(folder, chosen):
        for annotation in _annotations(dataset, folder, record):
            number += 1
            yield (",\n" if number > 1 else "\n") + json.dumps({"id": number} | annotation)
    yield "\n]}\n"


def _annotations(dataset: Dataset, folder: Path, record: SampleRecord) -> Iterator[dict[str, Any]]:
    boxes = boxes_of(dataset, record)
    if not boxes:
        return
    semantic, instances, paths = (read_layer(folder, record, kind) for kind in ("semantic", "instances", "paths"))
    for box in boxes:
        path = int(Region[box["region"].upper()]) + FURTHER * box["further_reflection"]
        mask = (semantic == box["category_id"]) & (instances == box["instance"] + 1) & (paths == path)
        yield {
            "image_id": record.index,
            "category_id": box["category_id"],
            "bbox": box["bbox"],
            "area": box["area"],
            "iscrowd": 0,
            "segmentation": {"size": list(mask.shape), "counts": compressed(run_lengths(mask))},
            **{key: box[key] for key in OWN_KEYS},
        }


def compressed(runs: Sequence[int]) -> str:
    """Run lengths as pycocotools packs them: differences to the run before the last, five bits a character."""
    text = []
    for place, run in enumerate(runs):
        left = run - runs[place - 2] if place > 2 else run
        more = True
        while more:
            bits, left = left & 0x1F, left >> 5
            more = left != (-1 if bits & 0x10 else 0)
            text.append(chr(48 + (bits | 0x20 if more else bits)))
    return "".join(text)


def read_layer(folder: Path, record: SampleRecord, kind: str) -> NDArray[Any]:
    """Image or layer of a sample as OpenCV reads it; `ValueError` with what to do when it is damaged."""
    file = folder / record.file(kind)
    image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise ValueError(
            f"{file}: expected an image; remove the record of sample {record.index}, and make the set again"
        )
    return np.asarray(image)
