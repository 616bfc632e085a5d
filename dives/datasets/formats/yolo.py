"""YOLO: a text file of boxes for each image in `labels/`, the splits as lists of images, and `data.yaml`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dives.datasets.dataset import Dataset
from dives.datasets.files import file_name, records
from dives.datasets.formats.coco import boxes_of
from dives.datasets.record import SampleRecord
from rigs.atomic_files import write_text

LABELS = "labels"


def write_yolo(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write labels, lists and `data.yaml`; returns the names of lists and `data.yaml`."""
    lists: dict[str, list[str]] = {split: [] for split in dataset.spec.splits}
    for record in records(folder, indices):
        path = folder / file_name(LABELS, record.index)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, label_text(dataset, record))
        lists[record.split].append(f"./{record.file('images')}\n")
    for split, lines in lists.items():
        write_text(folder / f"{split}.txt", "".join(lines))
    write_text(folder / "data.yaml", _yaml(dataset))
    return [*(f"{split}.txt" for split in lists), "data.yaml"]


def label_text(dataset: Dataset, record: SampleRecord) -> str:
    """Lines of class, middle, width and height of each box, as shares of the image."""
    columns, rows = record.width_px, record.height_px
    lines = []
    for box in boxes_of(dataset, record):
        left, top, width, height = box["bbox"]
        shares = ((left + width / 2) / columns, (top + height / 2) / rows, width / columns, height / rows)
        lines.append(f"{dataset.spec.boxes.index(box['label'])} {' '.join(f'{share:.6f}' for share in shares)}\n")
    return "".join(lines)


def _yaml(dataset: Dataset) -> str:
    splits = list(dataset.spec.splits)
    # Training code knows three names; what a set calls otherwise keeps its name beside them.
    known = {"train": splits[0], "val": splits[min(1, len(splits) - 1)], "test": splits[-1]}
    known |= {"val" if split == "validation" else split: split for split in splits}
    lines = ["path: .", *(f"{name}: {split}.txt" for name, split in known.items()), "names:"]
    return "\n".join([*lines, *(f"  {number}: {name}" for number, name in enumerate(dataset.spec.boxes))]) + "\n"
