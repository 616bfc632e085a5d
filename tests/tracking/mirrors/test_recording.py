"""Joints on record: everything is written down, and comes back from CSV, Parquet, a log, a table of one's own."""

from __future__ import annotations

import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from rigs import Rig
from tracking.mirrors.recording import RecordingMirrors, ReplayedMirrors
from tracking.mirrors.simulated import SimulatedMirrors

DEGREES_AND_BACK = 1e-15
"""Radians: one rounding each way of angles below 1."""


@pytest.fixture
def recorded():
    mirrors = RecordingMirrors(SimulatedMirrors.from_rig(Rig.load("aqua2"), seed=2))
    for k in range(30):
        mirrors.report(k / 30)
        mirrors.command(np.array([0.3 * math.sin(k / 5), 0.2]), k / 30 + 0.01)
    return mirrors


def test_every_event_is_a_row_in_its_order(recorded):
    table = recorded.table()
    assert table["event"].to_pylist() == ["report", "command"] * 30
    assert table["time_s"].to_pylist() == [time_s for k in range(30) for time_s in (k / 30, k / 30 + 0.01)]
    assert table["q2_deg"].to_pylist()[1] == pytest.approx(math.degrees(0.2))
    assert table.schema.field("q1_deg").metadata == {b"unit": b"deg", b"description": b"pan asked for or reported"}


def test_the_driver_sees_what_it_would_have_seen(recorded):
    plain = SimulatedMirrors.from_rig(Rig.load("aqua2"), seed=2)
    reports = []
    for k in range(30):
        reports.append(np.degrees(plain.report(k / 30).q).tolist())
        plain.command(np.array([0.3 * math.sin(k / 5), 0.2]), k / 30 + 0.01)
    table = recorded.table().filter(pa.compute.field("event") == "report")
    assert np.column_stack([table["q1_deg"], table["q2_deg"]]).tolist() == reports


@pytest.mark.parametrize("name", ["joints.csv", "joints.parquet"])
def test_a_saved_record_is_replayed(recorded, tmp_path, name):
    recorded.save(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    again = ReplayedMirrors.from_file(tmp_path / name)
    plain = SimulatedMirrors.from_rig(Rig.load("aqua2"), seed=2)
    for k in range(30):
        report = again.report(k / 30)
        np.testing.assert_allclose(report.q, plain.report(k / 30).q, atol=DEGREES_AND_BACK)
        assert not report.measured
        plain.command(np.array([0.3 * math.sin(k / 5), 0.2]), k / 30 + 0.01)
    # Commands stand in the record between the reports, and are no samples.
    halfway = (again.report(1 / 30).q + again.report(2 / 30).q) / 2
    np.testing.assert_allclose(again.report(1.5 / 30).q, halfway, atol=DEGREES_AND_BACK)


def test_between_two_samples_the_joints_run_straight():
    mirrors = ReplayedMirrors([1.0, 2.0, 4.0], [[0.0, 1.0], [0.5, 1.0], [0.1, 0.0]])
    np.testing.assert_allclose(mirrors.report(1.5).q, [0.25, 1.0])
    np.testing.assert_allclose(mirrors.report(3.0).q, [0.3, 0.5])
    mirrors.command(np.array([1.0, 1.0]), 3.0)
    np.testing.assert_allclose(mirrors.report(3.0).q, [0.3, 0.5])


def test_one_sample_missing_at_an_end_is_held_and_more_is_named():
    mirrors = ReplayedMirrors([1.0, 2.0], [[0.1, 0.2], [0.3, 0.4]])
    assert mirrors.report(0.5).q.tolist() == [0.1, 0.2]
    assert mirrors.report(2.9).q.tolist() == [0.3, 0.4]
    with pytest.raises(ValueError, match=r"expected a time from 1 to 2 s, for which there are joints, got 3\.1 s"):
        mirrors.report(3.1)


def test_a_single_sample_stands_for_mirrors_that_do_not_move():
    mirrors = ReplayedMirrors([0.0], [[0.1, 0.2]])
    assert mirrors.report(1e6).q.tolist() == [0.1, 0.2]


def test_a_log_gives_the_estimated_joints(tmp_path):
    columns = {"frame": [0, 1], "time_s": [0.0, 1.0], "q1_estimated_deg": [0.0, 10.0], "q2_estimated_deg": [0.0, -10.0]}
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "log.parquet")
    mirrors = ReplayedMirrors.from_file(tmp_path / "log.parquet")
    np.testing.assert_allclose(np.degrees(mirrors.report(0.5).q), [5.0, -5.0])


def test_a_table_of_ones_own_may_have_other_columns(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("time_s, note, q1_deg, q2_deg\n0, start, 10, 20\n1, , 11, 21\n")
    np.testing.assert_allclose(np.degrees(ReplayedMirrors.from_file(path).report(0.5).q), [10.5, 20.5])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"q\.csv: expected a line of column names, got nothing"),
        ("time_s,q1_deg\n0,1\n", "expected columns time_s, q1_deg and q2_deg, got time_s, q1_deg"),
        ("time_s,q1_deg,q2_deg\n", "expected at least one row of joints, got none"),
        ("time_s,q1_deg,q2_deg\n0,nan,1\n1,2,x\n", r"(?s)2 problems.*row 1, q1_deg.*'nan'.*row 2, q2_deg.*'x'"),
        ("time_s,q1_deg,q2_deg\n0,1\n", "row 1, q2_deg: expected a finite number, got ''"),
        ("time_s,q1_deg,q2_deg\n1,0,0\n1,0,0\n", "expected ascending times, got 1 s after 1 s"),
        ("time_s,q1_deg,q2_deg\n" + "0,nan,0\n" * 30, "and 20 more"),
    ],
)
def test_what_is_wrong_with_a_file_is_named(tmp_path, text, message):
    path = tmp_path / "q.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        ReplayedMirrors.from_file(path)


def test_what_is_not_a_table_is_named(tmp_path, recorded):
    for name, message in [("q.csv", "expected text in UTF-8"), ("q.parquet", "expected a Parquet file")]:
        (tmp_path / name).write_bytes(b"\xff\xfe\x00" * 10)
        with pytest.raises(ValueError, match=message):
            ReplayedMirrors.from_file(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        ReplayedMirrors.from_file(tmp_path / "missing.parquet")
    with pytest.raises(ValueError, match=r"q\.txt: expected a name that ends in \.csv or \.parquet"):
        recorded.save(tmp_path / "q.txt")
    with pytest.raises(ValueError, match=r"expected times \(n,\) and joints \(n, 2\), got \(2,\) and \(3, 2\)"):
        ReplayedMirrors([0.0, 1.0], np.zeros((3, 2)))
