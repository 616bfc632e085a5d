"""What a rig can see: the view of a pose, and the sphere that all poses together cover."""

from optics.analysis.coverage import Coverage, coverage
from optics.analysis.fate import Fate
from optics.analysis.usable_fov import UsableFov, usable_fov

__all__ = ["Coverage", "Fate", "UsableFov", "coverage", "usable_fov"]
