"""Solids of a mirror gaze in millimetres: hull, fold bracket, gimbal, servos and mirrors, and what is made of them.

The public names are loaded when they are first asked for: the modelling kernel takes seconds to load.
"""

import sys

import lazy_loader

from cad.build123d_on_demand import OnDemand

sys.meta_path.insert(0, OnDemand())

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
