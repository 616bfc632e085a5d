"""The robot's side: it finds the target in the gaze mirror's image and turns the mirror after it.

It runs on a robot's computer, without anything that renders or models solids. The public names are loaded when they
are first asked for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
