"""Dives in simulation: a robot, a target and the closed loop between them on a simulated clock, with ground truth.

The public names are loaded when they are first asked for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
