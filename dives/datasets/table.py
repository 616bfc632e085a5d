"""The table of a data set: a row for each sample, what is a number or a word in columns of its own."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from dives.datasets.dataset import Dataset
from dives.datasets.files import RECORDS, TABLE, file_name
from dives.datasets.grid import SCENE_KEYS, distributions
from dives.datasets.record import SampleRecord
from optics.status import Region
from rigs.atomic_files import atomic_file

ROWS_A_GROUP = 1000
"""Rows that are in memory at once."""

PLAIN = ("index", "split", "clip", "frame", "rig", "time_s", "width_px", "height_px")
"""Keys of a record that are columns as they are."""

NUMBER, MATRIX = pa.float64(), pa.list_(pa.float64(), 16)


def schema(dataset: Dataset) -> pa.Schema:
    """Columns of a set's table."""
    drawn = ("joints.q1_deg", "joints.q2_deg", *distributions(dataset.spec))
    return pa.schema(
        [
            ("index", pa.int64()),
            ("split", pa.string()),
            ("clip", pa.int64()),
            ("frame", pa.int32()),
            ("image", pa.string()),
            ("rig", pa.string()),
            ("scene", pa.int32()),
            *((key, _scene_type(dataset, key)) for key in SCENE_KEYS),
            *((key, NUMBER) for key in dict.fromkeys(drawn)),
            ("time_s", NUMBER),
            ("width_px", pa.int32()),
            ("height_px", pa.int32()),
            *((f"camera.{name}_px", NUMBER) for name in ("fx", "fy", "cx", "cy")),
            *((f"gaze.{name}_deg", NUMBER) for name in ("azimuth", "elevation", "roll")),
            ("exposure.time_ms", NUMBER),
            ("exposure.gain_db", NUMBER),
            *((f"path_px.{region.name.lower()}", pa.int32()) for region in Region),
            ("target.u_px", NUMBER),
            ("target.v_px", NUMBER),
            ("target.pixels", pa.int32()),
            ("target.visible_fraction", NUMBER),
            ("world_from_body", MATRIX),
            ("world_from_target", MATRIX),
            ("bytes", pa.int64()),
            ("record_sha256", pa.string()),
        ]
    )


def write_table(dataset: Dataset, folder: Path, indices: Sequence[int]) -> None:
    """Write `samples.parquet` of samples that are there."""
    columns = schema(dataset)
    with atomic_file(folder / TABLE) as partial, pq.ParquetWriter(partial, columns) as writer:
        for rows in _groups(rows_of(folder, indices)):
            writer.write_table(pa.Table.from_pylist(rows, schema=columns))


def rows_of(folder: Path, indices: Iterable[int]) -> Iterator[dict[str, Any]]:
    """Rows of samples; of an absent number there is no key."""
    for index in indices:
        content = (folder / file_name(RECORDS, index)).read_bytes()
        yield row_of(SampleRecord.of_json(content)) | {"record_sha256": hashlib.sha256(content).hexdigest()}


def _groups(rows: Iterable[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    group: list[dict[str, Any]] = []
    for row in rows:
        group.append(row)
        if len(group) == ROWS_A_GROUP:
            yield group
            group = []
    yield group


def row_of(record: SampleRecord) -> dict[str, Any]:
    """Row of a record, but for the record's own digest."""
    (fx, _, cx), (_, fy, cy), _ = record.camera_matrix
    scene = dict(record.scene)
    target = [each for each in record.annotations if each["label"] == "target"]
    largest: dict[str, Any] = max(target, key=lambda each: each["area"], default={})
    u, v = record.target_px or (None, None)
    return {
        **{name: getattr(record, name) for name in PLAIN},
        "image": record.file("images"),
        "scene": scene.pop("number"),
        **scene,
        **record.drawn,
        **{f"camera.{name}_px": value for name, value in zip(("fx", "fy", "cx", "cy"), (fx, fy, cx, cy), strict=True)},
        **{f"gaze.{key}_deg": value for key, value in (record.gaze_deg or {}).items()},
        **{f"exposure.{key}": value for key, value in (record.exposure or {}).items()},
        **{f"path_px.{key}": value for key, value in record.path_px.items()},
        "target.u_px": u,
        "target.v_px": v,
        "target.pixels": sum(each["area"] for each in target),
        "target.visible_fraction": largest.get("visible_fraction"),
        "world_from_body": _flat(record.world_from_body),
        "world_from_target": _flat(record.world_from_target),
        "bytes": sum(each.bytes for each in record.files.values()),
    }


def _flat(matrix: list[list[float]] | None) -> list[float] | None:
    return None if matrix is None else [value for row in matrix for value in row]


def _scene_type(dataset: Dataset, key: str) -> pa.DataType:
    known = {bool: pa.bool_(), int: pa.int64(), float: pa.float64()}
    return known.get(type(dataset.grid.scenes[key][0]), pa.string())
