"""Appearance: rig and world as a scene under water, rendered as the camera sees it through port and mirrors.

The public names are loaded when they are first asked for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
