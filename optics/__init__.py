"""Light as mathematics on arrays: cameras, ports, mirrors, the optical train, gaze kinematics, water, coverage.

The names below are the public ones; each is loaded when it is first asked for, because the first array chooses a
backend and loads Dr.Jit.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
