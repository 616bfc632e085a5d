"""The log of a dive: one row an image, each column with its unit and what it means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from optics.kernels.arrays import FloatArray
from tracking.records import Step

LOG = "log.parquet"

ROWS_PER_GROUP = 4096
"""Fixed, so that a log's bytes do not tell how it was put together."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Column:
    """Name, type, unit and meaning of a column."""

    name: str
    kind: pa.DataType
    unit: str
    description: str


def _numbers(unit: str, **described: str) -> list[Column]:
    return [Column(name, pa.float64(), unit, text) for name, text in described.items()]


def _counts(unit: str, **described: str) -> list[Column]:
    return [Column(name, pa.int32(), unit, text) for name, text in described.items()]


OVER_MIRROR = "crop of the true corners, nan where no part of the target would lie over the gaze mirror"

COLUMNS = (
    *_counts("1", frame="number of the image"),
    *_numbers("s", time_s="middle of the middle row's exposure", exposure_s="exposure time of a row"),
    *_numbers("dB", gain_db="analogue gain"),
    Column("mode", pa.string(), "", "state of figure 12 in which the command was decided"),
    *_numbers(
        "deg",
        q1_command_deg="pan asked for after this image",
        q2_command_deg="tilt asked for after this image",
        q1_estimated_deg="pan with which the loop read this image",
        q2_estimated_deg="tilt with which the loop read this image",
        q1_true_deg="true pan at the image's time",
        q2_true_deg="true tilt at the image's time",
        q1_first_row_deg="true pan in the middle of the first row's exposure",
        q2_first_row_deg="true tilt in the middle of the first row's exposure",
        q1_last_row_deg="true pan in the middle of the last row's exposure",
        q2_last_row_deg="true tilt in the middle of the last row's exposure",
    ),
    Column("beyond_reach", pa.bool_(), "", "whether the loop takes the target to be beyond the joints' reach"),
    Column("detected", pa.bool_(), "", "whether the detector found a blob"),
    *_counts("1", blobs="blobs that passed the filters"),
    *_numbers(
        "px",
        blob_area_px="area of the blobs together; crop",
        centroid_x_px="centroid of the blobs (eq. 7), to the right; crop, nan without a blob",
        centroid_y_px="centroid of the blobs, down; crop, nan without a blob",
        predicted_x_px="where the filter expects the target, to the right; crop, nan where it does not know",
        predicted_y_px="where the filter expects the target, down; crop, nan where it does not know",
        error_x_px="error that is controlled (eqs. 11, 12), to the right; crop, nan without one",
        error_y_px="error that is controlled, down; crop, nan without one",
    ),
    *_numbers(
        "deg",
        true_azimuth_deg="azimuth of the target's centre from the gaze mirror's centre, to the left; body frame",
        true_elevation_deg="elevation of the target's centre from the gaze mirror's centre; body frame",
    ),
    *_numbers("m", target_distance_m="from the gaze mirror's centre to the target's centre"),
    *_numbers(
        "deg",
        gaze_azimuth_deg="azimuth of the true optical axis after both mirrors; body frame",
        gaze_elevation_deg="elevation of the true optical axis after both mirrors; body frame",
        gaze_error_deg="angle between the true axis and the direction from the virtual camera's centre to the target",
        estimated_azimuth_deg="azimuth of the target as the loop estimates; body frame, nan where it does not know",
        estimated_elevation_deg="elevation of the target as the loop estimates; body frame, nan where it does not know",
    ),
    *_numbers(
        "px",
        true_x_px=f"target's centre through the exact train, to the right; {OVER_MIRROR}",
        true_y_px=f"target's centre through the exact train, down; {OVER_MIRROR}",
    ),
    *_counts("px", target_visible_px="pixels of the camera's image that show the target over the gaze mirror"),
    *_numbers("px", target_full_px="those it would have if nothing hid it and the mirror had no edge"),
    *_counts(
        "px",
        detector_true_px="pixels of the loop's crop that show the target",
        detector_found_px="pixels of the detector's mask",
        detector_both_px="pixels of the crop that are in both",
    ),
    Column(
        "detected_thing", pa.string(), "", "what most of the detector's mask shows: target, decoy, world, robot, water"
    ),
    *_numbers("1", saturated_fraction="share of the crop's pixels with a channel at 255"),
    Column("cause_of_loss", pa.string(), "", "why the target was not found; empty where it was"),
)

SCHEMA = pa.schema(
    [
        pa.field(column.name, column.kind, metadata={"unit": column.unit, "description": column.description})
        for column in COLUMNS
    ]
)


def loop_columns(step: Step, q_true: FloatArray) -> Row:
    """Columns of what the loop saw, thought and did, beside the true joints, radians, shape (2,)."""
    area = sum(blob.area_px for blob in step.detection.blobs)
    row: Row = {"time_s": step.time_s, "mode": str(step.mode)}
    for name, q in (("command", step.q_command), ("estimated", step.q_estimated), ("true", q_true)):
        row |= joint_columns(name, q)
    row |= {
        "beyond_reach": step.beyond_reach,
        "detected": bool(step.detection.blobs),
        "blobs": len(step.detection.blobs),
        "blob_area_px": float(area),
    }
    for name, point in (
        ("centroid", step.detection.centroid_px),
        ("predicted", step.predicted_px),
        ("error", step.error_px),
    ):
        row[f"{name}_x_px"], row[f"{name}_y_px"] = (np.nan, np.nan) if point is None else map(float, point)
    azimuth, elevation = np.nan, np.nan
    if step.target_direction is not None:
        x, y, z = step.target_direction.tolist()
        azimuth, elevation = np.degrees([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))]).tolist()
    return row | {"estimated_azimuth_deg": azimuth, "estimated_elevation_deg": elevation}


def joint_columns(name: str, q: FloatArray) -> Row:
    """Columns of both joints, radians, shape (2,)."""
    return {f"{joint}_{name}_deg": angle for joint, angle in zip(("q1", "q2"), np.degrees(q).tolist(), strict=True)}


def table_of(rows: Sequence[Row]) -> pa.Table:
    """Rows as a table; `ValueError` when one lacks a column or has one too many."""
    names = {column.name for column in COLUMNS}
    for row in rows:
        if row.keys() != names:
            raise ValueError(f"expected the columns of a log, got a difference in {sorted(row.keys() ^ names)}")
    return pa.Table.from_pylist(list(rows), schema=SCHEMA)


def write_table(table: pa.Table, path: Path, *, about: dict[str, str] | None = None) -> None:
    """Write a table as Parquet; equal tables give equal bytes. `about` goes into the file's metadata."""
    pq.write_table(
        table.replace_schema_metadata(about or {}),
        path,
        row_group_size=ROWS_PER_GROUP,
        compression="zstd",
        write_page_checksum=True,
    )


def read_log(folder: str | Path) -> pa.Table:
    """Log of a dive's folder; units and descriptions are in the metadata of its fields.

    Raises
    ------
    FileNotFoundError
        When the folder holds no finished dive.
    ValueError
        When the file cannot be read as Parquet.
    """
    path = Path(folder) / LOG
    if not path.is_file():
        raise FileNotFoundError(f"{folder}: expected a finished dive, found no {LOG}")
    try:
        return pq.read_table(path, page_checksum_verification=True)
    except (pa.ArrowException, OSError) as error:
        # Damaged pages come as OSError too, but without the number of an error of the system.
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise ValueError(f"{path}: expected the log of a dive, as Parquet, got a damaged file: {error}") from error
