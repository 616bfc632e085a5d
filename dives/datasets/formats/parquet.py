"""Parquet with the images inside, `parquet/SPLIT-00000.parquet`: what `datasets` of Hugging Face loads."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from dives.datasets.dataset import Dataset
from dives.datasets.files import records
from dives.datasets.formats.coco import boxes_of, indices_of_splits
from dives.datasets.formats.webdataset import KEYS
from dives.datasets.record import SampleRecord
from dives.datasets.rendering import FLOW, LAYERS
from dives.datasets.table import row_of, schema
from rigs.atomic_files import atomic_file

SAMPLES_A_FILE = 1000
ROWS_A_GROUP = 50
"""Rows that are in memory at once, images included."""

IMAGE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
OBJECTS = pa.struct(
    [("bbox", pa.list_(pa.list_(pa.float32(), 4))), ("category", pa.list_(pa.int64())), ("path", pa.list_(pa.string()))]
)


def write_parquet(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write the files of each split; returns their names."""
    splits = indices_of_splits(dataset, folder, indices)
    (folder / "parquet").mkdir(exist_ok=True)
    names, columns = [], _columns(dataset)
    for split, chosen in splits.items():
        for number, start in enumerate(range(0, len(chosen), SAMPLES_A_FILE)):
            names.append(f"parquet/{split}-{number:05d}.parquet")
            with atomic_file(folder / names[-1]) as partial, pq.ParquetWriter(partial, columns) as writer:
                for group in _groups(chosen[start : start + SAMPLES_A_FILE]):
                    rows = [_row(dataset, folder, record) for record in records(folder, group)]
                    writer.write_table(pa.Table.from_pylist(rows, schema=columns))
    return names


def _groups(indices: Sequence[int]) -> Iterator[Sequence[int]]:
    for start in range(0, len(indices), ROWS_A_GROUP):
        yield indices[start : start + ROWS_A_GROUP]


def _columns(dataset: Dataset) -> pa.Schema:
    """Columns of the set's table behind images and boxes, with what `datasets` makes of them."""
    plain = [field for field in schema(dataset) if field.name not in ("image", "record_sha256")]
    images = [pa.field(KEYS[kind], IMAGE) for kind in _kinds(dataset)]
    features: dict[str, Any] = {KEYS[kind]: {"_type": "Image"} for kind in _kinds(dataset)}
    told = {"huggingface": json.dumps({"info": {"features": features, "license": dataset.spec.licence}})}
    return pa.schema([*images, pa.field("objects", OBJECTS), *plain], metadata=told)


def _row(dataset: Dataset, folder: Path, record: SampleRecord) -> dict[str, Any]:
    boxes = boxes_of(dataset, record)
    return {
        **row_of(record),
        **{KEYS[kind]: _image(folder / record.file(kind)) for kind in _kinds(dataset)},
        "objects": {
            "bbox": [each["bbox"] for each in boxes],
            "category": [dataset.spec.boxes.index(each["label"]) for each in boxes],
            "path": [each["region"] for each in boxes],
        },
    }


def _kinds(dataset: Dataset) -> list[str]:
    return [*LAYERS, *(FLOW if dataset.spec.clip.flow else ())]


def _image(file: Path) -> dict[str, Any]:
    return {"bytes": file.read_bytes(), "path": file.name}
