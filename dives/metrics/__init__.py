"""What a dive's log says about the loop: how well it held the target, what it lost it to, and how fast it answers."""

from dives.metrics.causes import Cause, cause_of_loss
from dives.metrics.summary import DEFINITIONS, dive_metrics

__all__ = ["DEFINITIONS", "Cause", "cause_of_loss", "dive_metrics"]
