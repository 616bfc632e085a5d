"""Dives in simulation: a robot, a target and the closed loop between them on a simulated clock, with ground truth."""

from dives.dive import Dive, DiveError, preset_names
from dives.runner import DiveStoppedError, run_dive
from tracking.log import read_log

__all__ = ["Dive", "DiveError", "DiveStoppedError", "preset_names", "read_log", "run_dive"]
