"""The log: its columns carry units, and equal rows give equal bytes."""

import numpy as np
import pyarrow as pa
import pytest

from dives.metrics.frames import FLAGS, NUMBERS, TEXT
from tracking.log import COLUMNS, LOG, SCHEMA, loop_columns, read_log, table_of, write_table
from tracking.records import Blob, Detection, Mode, Step

EXAMPLES = {pa.int32(): 1, pa.float64(): 0.5, pa.string(): "track", pa.bool_(): True}


def row(frame):
    return {column.name: EXAMPLES[column.kind] for column in COLUMNS} | {"frame": frame}


def step(**changes):
    blobs = tuple(
        Blob(area_px=area, centroid_px=(0.0, 0.0), box_px=(0, 0, 1, 1), circularity=1.0) for area in (256.0, 156.0)
    )
    detection = Detection(mask=np.zeros((2, 2), np.uint8), blobs=blobs, centroid_px=(3.0, 4.0))
    values = {
        "time_s": 1.5,
        "mode": Mode.TRACK,
        "q_estimated": np.radians([1.0, 2.0]),
        "q_command": np.radians([3.0, 4.0]),
        "corners_px": np.zeros((4, 2)),
        "crop": np.zeros((2, 2, 3), np.uint8),
        "detection": detection,
        "predicted_px": (5.0, 6.0),
        "error_px": (7.0, 8.0),
        "beyond_reach": False,
        "target_direction": np.array([0.0, 1.0, 1.0]) / np.sqrt(2),
    }
    return Step(**(values | changes))


def test_every_column_has_unit_and_description(tmp_path):
    write_table(table_of([row(0)]), tmp_path / LOG)
    table = read_log(tmp_path)
    assert table.column_names == [column.name for column in COLUMNS]
    for field, column in zip(table.schema, COLUMNS, strict=True):
        assert field.metadata == {b"unit": column.unit.encode(), b"description": column.description.encode()}
        assert column.description
        for suffix, unit in (("_deg", "deg"), ("_px", "px"), ("_s", "s"), ("_m", "m"), ("_db", "dB")):
            if column.name.endswith(suffix):
                assert column.unit == unit


def test_what_metrics_read_is_there():
    """The other end of the log: `dives.metrics` names what it needs."""
    assert set(TEXT) | set(FLAGS) | set(NUMBERS) <= set(SCHEMA.names)


def test_columns_of_a_step_are_in_degrees_and_crop_pixels():
    found = loop_columns(step(), np.radians([-1.0, -2.0]))
    expected = {
        "time_s": 1.5,
        "mode": "track",
        "q1_command_deg": 3.0,
        "q2_command_deg": 4.0,
        "q1_estimated_deg": 1.0,
        "q2_estimated_deg": 2.0,
        "q1_true_deg": -1.0,
        "q2_true_deg": -2.0,
        "beyond_reach": False,
        "detected": True,
        "blobs": 2,
        "blob_area_px": 412.0,
        "centroid_x_px": 3.0,
        "centroid_y_px": 4.0,
        "predicted_x_px": 5.0,
        "predicted_y_px": 6.0,
        "error_x_px": 7.0,
        "error_y_px": 8.0,
        "estimated_azimuth_deg": 90.0,
        "estimated_elevation_deg": 45.0,
    }
    assert found == pytest.approx(expected)


def test_what_is_not_known_is_nan():
    nothing = Detection(mask=np.zeros((2, 2), np.uint8), blobs=(), centroid_px=None)
    found = loop_columns(step(detection=nothing, predicted_px=None, error_px=None, target_direction=None), np.zeros(2))
    unknown = {name for name, value in found.items() if isinstance(value, float) and np.isnan(value)}
    assert unknown == {
        *(f"{name}_{axis}_px" for name in ("centroid", "predicted", "error") for axis in "xy"),
        "estimated_azimuth_deg",
        "estimated_elevation_deg",
    }
    assert not found["detected"]


def test_a_row_with_a_column_too_few_or_too_many_is_refused():
    short = row(0)
    del short["blobs"]
    for wrong in (short, row(0) | {"step_ms": 1.0}):
        with pytest.raises(ValueError, match=r"blobs|step_ms"):
            table_of([wrong])


def test_bytes_do_not_tell_the_segments(tmp_path):
    rows = [row(k) for k in range(100)]
    parts = pa.concat_tables([table_of(rows[:33]), table_of(rows[33:60]), table_of(rows[60:])])
    for name, table in (("one", table_of(rows)), ("two", parts)):
        write_table(table, tmp_path / name, about={"identity": "x"})
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


@pytest.mark.parametrize("damage", ["empty", "cut", "page", "text"])
def test_a_damaged_log_is_a_sentence(tmp_path, damage):
    path = tmp_path / LOG
    write_table(table_of([row(k) for k in range(100)]), path)
    whole = path.read_bytes()
    contents = {
        "empty": b"",
        "cut": whole[:1000],
        "page": whole[:4] + bytes(200) + whole[204:],
        "text": b"frame,time_s\n",
    }
    path.write_bytes(contents[damage])
    with pytest.raises(ValueError, match=r"log\.parquet: expected the log of a dive"):
        read_log(tmp_path)


def test_no_finished_dive(tmp_path):
    with pytest.raises(FileNotFoundError, match="finished dive"):
        read_log(tmp_path)
