"""Everything that one dive's log is judged by."""

from __future__ import annotations

import pyarrow as pa

from dives.metrics.detector import DETECTOR_DEFINITIONS, detector_metrics
from dives.metrics.frames import Frames
from dives.metrics.holding import HOLDING_DEFINITIONS, holding_metrics
from dives.metrics.latency import LATENCY_DEFINITIONS, latency_metrics
from dives.metrics.pointing import POINTING_DEFINITIONS, pointing_metrics

DEFINITIONS = HOLDING_DEFINITIONS | POINTING_DEFINITIONS | DETECTOR_DEFINITIONS | LATENCY_DEFINITIONS
"""What each key of `dive_metrics` means; its unit is the key's last part, none for counts and fractions."""


def dive_metrics(table: pa.Table) -> dict[str, object]:
    """Judge a dive by its log.

    Parameters
    ----------
    table : pyarrow.Table
        One row a frame, columns as `dives.metrics.frames` names them; others are not looked at.

    Returns
    -------
    dict
        The keys of `DEFINITIONS`, in their order: plain numbers, and None where a quantity is not defined (JSON knows
        no nan), such as the error of a target that was never acquired.

    Raises
    ------
    ValueError
        With every column that is missing or of another kind; for a log without frames, or whose times do not rise.
    """
    frames = Frames.of(table)
    return {
        **holding_metrics(frames),
        **pointing_metrics(frames),
        **detector_metrics(frames),
        **latency_metrics(frames),
    }
