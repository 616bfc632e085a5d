"""Rendered dives: a robot, a target and the closed loop between them on a simulated clock, with ground truth."""

from tracking.dives.log import read_log
from tracking.dives.runner import DiveStoppedError, run_dive
from tracking.dives.specification import Dive, DiveError, preset_names

__all__ = ["Dive", "DiveError", "DiveStoppedError", "preset_names", "read_log", "run_dive"]
