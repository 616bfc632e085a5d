"""A dive's log as arrays, and what each of its frames counts as: target visible, found, followed, held."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.records import Mode

BoolArray = NDArray[np.bool_]

FOLLOWING = (Mode.TRACK, Mode.PREDICT)
"""Modes in which the mirrors go after the target."""

TEXT = ("mode", "cause_of_loss", "detected_thing")
FLAGS = ("detected", "beyond_reach")
NUMBERS = (
    "time_s",
    "q1_command_deg",
    "q2_command_deg",
    "q1_true_deg",
    "q2_true_deg",
    "centroid_x_px",
    "centroid_y_px",
    "predicted_x_px",
    "predicted_y_px",
    "error_x_px",
    "error_y_px",
    "true_azimuth_deg",
    "true_elevation_deg",
    "gaze_azimuth_deg",
    "gaze_elevation_deg",
    "gaze_error_deg",
    "estimated_azimuth_deg",
    "estimated_elevation_deg",
    "true_x_px",
    "true_y_px",
    "target_visible_px",
    "detector_true_px",
    "detector_found_px",
    "detector_both_px",
)


@dataclass(frozen=True, kw_only=True)
class Frames:
    """What the metrics need of a log.

    Attributes
    ----------
    numbers : mapping of str to array, shape (n,)
        Columns of `NUMBERS` by name; nan where the log has none.
    mode, cause, thing : arrays of str, shape (n,)
        The last: what most of the detector's mask shows.
    lasts_s : array, shape (n,)
        Time from each frame to the next; the last one lasts as long as the others in the median.
    visible : array, shape (n,)
        Ground truth: at least one pixel of the target is seen over the gaze mirror.
    detected : array, shape (n,)
        The detector found something.
    found : array, shape (n,)
        It found the target: its mask shares at least one pixel of the crop with the target's.
    following : array, shape (n,)
        The loop tracks or predicts.
    beyond_reach : array, shape (n,)
        The loop takes the target to be where the joints do not reach.
    on_target : array, shape (n,)
        What the detector last found was the target: what is tracked is it, and so is what is predicted.
    """

    numbers: Mapping[str, FloatArray]
    mode: NDArray[np.str_]
    cause: NDArray[np.str_]
    thing: NDArray[np.str_]
    lasts_s: FloatArray
    visible: BoolArray
    detected: BoolArray
    found: BoolArray
    following: BoolArray
    beyond_reach: BoolArray
    on_target: BoolArray

    @classmethod
    def of(cls, table: pa.Table) -> Frames:
        """Read a log.

        Raises
        ------
        ValueError
            With every column that is missing or of another kind; for a log without frames, or whose times do not rise.
        """
        _check_columns(table)
        numbers = {name: _number_column(table, name) for name in NUMBERS}
        time_s = numbers["time_s"]
        steps_s = np.diff(time_s)
        if not np.all(np.isfinite(time_s)) or np.any(steps_s <= 0):
            raise ValueError("log: expected times that rise from frame to frame")
        mode, cause, thing = (np.array(table[name].fill_null("").to_pylist(), dtype=np.str_) for name in TEXT)
        detected, beyond = (np.array(table[name].fill_null(False).to_pylist(), dtype=bool) for name in FLAGS)
        found = detected & (numbers["detector_both_px"] > 0)
        return cls(
            numbers=numbers,
            mode=mode,
            cause=cause,
            thing=thing,
            lasts_s=np.append(steps_s, np.median(steps_s) if len(steps_s) else 0.0),
            visible=numbers["target_visible_px"] > 0,
            detected=detected,
            found=found,
            following=np.isin(mode, [str(mode) for mode in FOLLOWING]),
            beyond_reach=beyond,
            on_target=last_detected(detected, found),
        )

    @property
    def time_s(self) -> FloatArray:
        """Times of the frames, shape (n,)."""
        return self.numbers["time_s"]

    @property
    def looking(self) -> BoolArray:
        """The loop looks for the target or follows it: no functional check, shape (n,)."""
        return np.asarray(self.mode != Mode.CHECK)

    @property
    def held(self) -> BoolArray:
        """Target visible while the loop tracks or predicts it and nothing else, shape (n,)."""
        return self.visible & self.following & self.on_target

    @property
    def false_tracking(self) -> BoolArray:
        """The loop tracks or predicts something else than the target, shape (n,)."""
        return self.following & ~self.on_target

    @property
    def followed(self) -> NDArray[np.str_]:
        """What the loop is on while it tracks or predicts, shape (n,): what most of the last detection's mask showed.

        The target where that mask met it, as `held` has it; empty where nothing is followed.
        """
        last = np.maximum.accumulate(np.where(self.detected, np.arange(len(self.thing)), -1))
        thing = np.where(last >= 0, self.thing[last], "")
        thing = np.where(thing == "target", "water", thing)
        return np.where(self.following, np.where(self.on_target, "target", thing), "")

    @property
    def acquired(self) -> int | None:
        """First frame in which the loop tracks and has found the target; None when there is none."""
        first = np.flatnonzero((self.mode == Mode.TRACK) & self.found)
        return int(first[0]) if len(first) else None

    @property
    def after_acquisition(self) -> BoolArray:
        """Frames from the acquisition on, shape (n,)."""
        start = len(self.time_s) if self.acquired is None else self.acquired
        return np.arange(len(self.time_s)) >= start


def last_detected(detected: BoolArray, found: BoolArray) -> BoolArray:
    """Whether the last frame with a detection found the target, shape (n,); false before the first."""
    last = np.maximum.accumulate(np.where(detected, np.arange(len(detected)), -1))
    return np.asarray((last >= 0) & found[last])


def unit_vectors(azimuth_deg: FloatArray, elevation_deg: FloatArray) -> FloatArray:
    """Directions in the body frame, shape (n, 3), from azimuth (to the left) and elevation."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    level = np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=-1)


def share(part: BoolArray, of: BoolArray, weights: FloatArray | None = None) -> float | None:
    """Of what is `of`, how much is `part` too, by weight; None when nothing is."""
    weight = np.ones(len(of)) if weights is None else weights
    whole = float(weight[of].sum())
    return float(weight[of & part].sum()) / whole if whole > 0 else None


def _check_columns(table: pa.Table) -> None:
    problems = list(_column_problems(table))
    if problems:
        raise ValueError("log: " + "; ".join(problems))
    if table.num_rows == 0:
        raise ValueError("log: expected at least one frame, got none")


def _column_problems(table: pa.Table) -> Iterable[str]:
    kinds: dict[str, tuple[str, Any]] = (
        dict.fromkeys(NUMBERS, ("numbers", lambda kind: pa.types.is_floating(kind) or pa.types.is_integer(kind)))
        | dict.fromkeys(FLAGS, ("true or false", pa.types.is_boolean))
        | dict.fromkeys(TEXT, ("text", lambda kind: pa.types.is_string(kind) or pa.types.is_large_string(kind)))
    )
    for name, (expected, is_expected) in kinds.items():
        if name not in table.column_names:
            yield f"{name}: expected a column of {expected}"
        elif not is_expected(table.schema.field(name).type):
            yield f"{name}: expected {expected}, got {table.schema.field(name).type}"


def _number_column(table: pa.Table, name: str) -> FloatArray:
    values = table[name].cast(pa.float64()).fill_null(np.nan)
    return np.asarray(values.to_numpy(zero_copy_only=False), dtype=np.float64)
