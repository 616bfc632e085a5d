"""Joint values on record: a driver's commands and reports, written down, and a driver that gives the reports again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import TextTable, finite_number
from rigs.atomic_files import atomic_file
from tracking.protocols import MirrorDriver, MirrorReport

COMMAND, REPORT = "command", "report"
JOINT_COLUMNS = (("q1_deg", "q2_deg"), ("q1_estimated_deg", "q2_estimated_deg"))
"""Names that the joints may have in a file: in a record or a table of your own, and in the log of a dive or track."""

MOST_PROBLEMS = 10
"""Rows that are named when many are wrong."""

RECORD_SCHEMA = pa.schema(
    [
        pa.field("time_s", pa.float64(), metadata={"unit": "s", "description": "on the loop's clock"}),
        pa.field("event", pa.string(), metadata={"unit": "", "description": "command or report"}),
        pa.field("q1_deg", pa.float64(), metadata={"unit": "deg", "description": "pan asked for or reported"}),
        pa.field("q2_deg", pa.float64(), metadata={"unit": "deg", "description": "tilt asked for or reported"}),
    ]
)


class RecordingMirrors:
    """Another driver, with a record of every command and every report.

    Parameters
    ----------
    driver : MirrorDriver
    """

    def __init__(self, driver: MirrorDriver):
        self._driver = driver
        self._rows: list[tuple[float, str, float, float]] = []

    def command(self, q: FloatArray, time_s: float) -> None:
        """Hand a command on; it is recorded when the driver has taken it."""
        self._driver.command(q, time_s)
        self._record(time_s, COMMAND, q)

    def report(self, time_s: float) -> MirrorReport:
        """Report of the driver."""
        report = self._driver.report(time_s)
        self._record(report.time_s, REPORT, report.q)
        return report

    def table(self) -> pa.Table:
        """The record: one row an event, in the order in which they happened."""
        columns = [list(column) for column in zip(*self._rows, strict=True)] or [[] for _ in RECORD_SCHEMA]
        return pa.table(columns, schema=RECORD_SCHEMA)

    def save(self, path: Path) -> None:
        """Write the record as CSV or Parquet, by the name's ending; `ValueError` for another one."""
        writers = {".csv": pyarrow.csv.write_csv, ".parquet": pyarrow.parquet.write_table}
        if path.suffix.lower() not in writers:
            raise ValueError(f"{path}: expected a name that ends in .csv or .parquet")
        with atomic_file(path) as partial:
            writers[path.suffix.lower()](self.table(), partial)

    def _record(self, time_s: float, event: str, q: FloatArray) -> None:
        q1_deg, q2_deg = np.degrees(q)
        self._rows.append((time_s, event, float(q1_deg), float(q2_deg)))


class ReplayedMirrors:
    """Joints as they were: reports them again, between two samples on a straight line, and obeys no command.

    Parameters
    ----------
    time_s : array, shape (n,)
        Ascending, at least one.
    q : array, shape (n, 2)
        Radians. A single sample holds forever: mirrors that do not move.

    Raises
    ------
    ValueError
        When the times do not ascend, or something is not finite.
    """

    def __init__(self, time_s: ArrayLike, q: ArrayLike):
        self._time_s = np.asarray(time_s, dtype=np.float64)
        self._q = np.asarray(q, dtype=np.float64)
        if self._time_s.ndim != 1 or len(self._time_s) == 0 or self._q.shape != (len(self._time_s), 2):
            raise ValueError(f"expected times (n,) and joints (n, 2), got {self._time_s.shape} and {self._q.shape}")
        if not (np.isfinite(self._time_s).all() and np.isfinite(self._q).all()):
            raise ValueError("expected finite times and joints")
        if (np.diff(self._time_s) <= 0).any():
            row = int(np.argmax(np.diff(self._time_s) <= 0)) + 1
            raise ValueError(f"expected ascending times, got {self._time_s[row]:g} s after {self._time_s[row - 1]:g} s")
        # One sample may be missing at either end: images and joints are rarely sampled at the same moments.
        self._slack_s = float(np.median(np.diff(self._time_s))) if len(self._time_s) > 1 else math.inf

    @classmethod
    def from_file(cls, path: Path) -> Self:
        """Read a record, a dive's or track's log (Parquet), or a table of your own (CSV: time_s, q1_deg, q2_deg).

        Raises
        ------
        ValueError
            With everything that is wrong with the file.
        """
        columns = _read_columns(path)
        names = next((pair for pair in JOINT_COLUMNS if set(pair) <= columns.keys()), None)
        if names is None or "time_s" not in columns:
            raise ValueError(f"{path}: expected columns time_s, q1_deg and q2_deg, got {', '.join(columns)}")
        events = columns.get("event", [REPORT] * len(columns["time_s"]))
        rows = [number for number, event in enumerate(events) if event == REPORT]
        problems: list[str] = []
        time_s, q1_deg, q2_deg = (_numbers(columns, name, rows, problems) for name in ("time_s", *names))
        if problems:
            more = [f"and {len(problems) - MOST_PROBLEMS} more"] if len(problems) > MOST_PROBLEMS else []
            count = f"{path}: {len(problems)} problem{'s' if len(problems) > 1 else ''}"
            raise ValueError("\n  ".join([count, *problems[:MOST_PROBLEMS], *more]))
        if not time_s:
            raise ValueError(f"{path}: expected at least one row of joints, got none")
        try:
            return cls(time_s, np.radians(np.column_stack([q1_deg, q2_deg])))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    def command(self, q: FloatArray, time_s: float) -> None:
        """Nothing: what is recorded has been."""

    def report(self, time_s: float) -> MirrorReport:
        """Joints at a time.

        Raises
        ------
        ValueError
            For a time further before the first or behind the last sample than two samples are apart.
        """
        first, last = float(self._time_s[0]), float(self._time_s[-1])
        if not first - self._slack_s <= time_s <= last + self._slack_s:
            raise ValueError(
                f"expected a time from {first:g} to {last:g} s, for which there are joints, got {time_s:g} s"
            )
        q = np.array([np.interp(time_s, self._time_s, column) for column in self._q.T])
        return MirrorReport(q=q, time_s=time_s, measured=False)


def _read_columns(path: Path) -> Mapping[str, Sequence[Any]]:
    """Columns by name; those of a CSV as text."""
    if path.suffix.lower() == ".parquet":
        try:
            file = pyarrow.parquet.ParquetFile(path)
        except pa.ArrowInvalid:
            raise ValueError(f"{path}: expected a Parquet file, got something else") from None
        with file:
            wanted = {"time_s", "event", *(name for pair in JOINT_COLUMNS for name in pair)}
            names = [name for name in file.schema_arrow.names if name in wanted]
            columns: dict[str, Sequence[Any]] = file.read(names).to_pydict()
            return columns
    table = TextTable.read(path)
    return {name: [row[n] if n < len(row) else "" for _, row in table.lines] for n, name in enumerate(table.names)}


def _numbers(columns: Mapping[str, Sequence[Any]], name: str, rows: Sequence[int], problems: list[str]) -> list[float]:
    """Numbers of some rows of a column; what is not a finite number is added to the problems."""
    numbers = []
    for row in rows:
        value = columns[name][row]
        number = finite_number(str(value))
        if math.isnan(number):
            problems.append(f"row {row + 1}, {name}: expected a finite number, got {value!r}")
        numbers.append(number)
    return numbers
