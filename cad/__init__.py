"""Solids of a mirror gaze in millimetres: hull, fold bracket, gimbal, servos and mirrors, and what is made of them.

The public names are loaded when they are first asked for: the modelling kernel takes seconds to load.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
