"""Light as mathematics on arrays: cameras, ports, mirrors, the optical train, gaze kinematics, water.

The names below are the public ones; they are loaded when they are first asked for, because the first array chooses a
backend and loads Dr.Jit.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from optics.camera import FisheyeCamera, PinholeCamera
    from optics.layout import Layout
    from optics.mirror import PlaneMirror
    from optics.ports.port import DomePort, FlatPort, NoPort
    from optics.status import Region, Status
    from optics.train import Image, OpticalTrain, Rays

HOMES = {
    "DomePort": "optics.ports.port",
    "FisheyeCamera": "optics.camera",
    "FlatPort": "optics.ports.port",
    "Image": "optics.train",
    "Layout": "optics.layout",
    "NoPort": "optics.ports.port",
    "OpticalTrain": "optics.train",
    "PinholeCamera": "optics.camera",
    "PlaneMirror": "optics.mirror",
    "Rays": "optics.train",
    "Region": "optics.status",
    "Status": "optics.status",
}

__all__ = [
    "DomePort",
    "FisheyeCamera",
    "FlatPort",
    "Image",
    "Layout",
    "NoPort",
    "OpticalTrain",
    "PinholeCamera",
    "PlaneMirror",
    "Rays",
    "Region",
    "Status",
]


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(HOMES[name]), name)
