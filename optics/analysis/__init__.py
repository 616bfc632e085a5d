"""What a rig can see: the view of a pose, and the sphere that all poses together cover."""

from optics.analysis.coverage import Coverage, coverage
from optics.analysis.fate import Fate
from optics.analysis.gaze_range import GazeRange
from optics.analysis.limits import Request
from optics.analysis.sizing import Sizing, size_mirrors
from optics.analysis.trade_off import TradeOff, trade_off
from optics.analysis.usable_fov import UsableFov, usable_fov
from optics.analysis.window import Window, centred_window, field_of_view_window, fraction_window

__all__ = [
    "Coverage",
    "Fate",
    "GazeRange",
    "Request",
    "Sizing",
    "TradeOff",
    "UsableFov",
    "Window",
    "centred_window",
    "coverage",
    "field_of_view_window",
    "fraction_window",
    "size_mirrors",
    "trade_off",
    "usable_fov",
]
