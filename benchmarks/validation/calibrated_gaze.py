"""The gaze of calibrated rigs beside that of the rigs that they were simulated with; ends with 1 beyond the limit."""

from __future__ import annotations

import statistics
import sys

from dives.calibration.session_study import SESSIONS, session_study
from rigs import Rig

RIGS, POSES = 12, 12
LIMIT_DEG = 0.1
"""Of the worst rig."""


def main() -> int:
    """Calibrate rigs from boards in known places and the mirror's corners, and print how far their gaze is off."""
    study = session_study(Rig.load("aqua2"), seeds=range(RIGS), pose_counts=(POSES,), sessions=SESSIONS[-1:])
    off_deg = [outcome.after.gaze_deg for outcome in study.outcomes]
    worst_deg = max(off_deg)
    print(f"difference: {statistics.median(off_deg):.3f}° (worst rig {worst_deg:.3f}°)")
    return 0 if worst_deg <= LIMIT_DEG else 1


if __name__ == "__main__":
    sys.exit(main())
