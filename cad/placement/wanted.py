"""What is asked of a placement, and what could be asked instead where nothing fits."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from cad.placement.fold_frame import looking_ahead
from optics.sizing.gaze_range import GazeRange
from optics.sizing.limits import Request
from optics.sizing.window import fraction_window
from optics.train import OpticalTrain
from rigs import Rig

WINDOW = 0.2
"""Of the image's sides, as `mirrorgaze size` by itself."""


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What is asked of a placement: keys that stay, and what the mirrors are sized for."""

    pinned: Collection[str]
    request: Request


def default_request(rig: Rig) -> Request:
    """What mirrors are sized for when nobody says: the middle fifth of the image over a wide range about its view."""
    gaze = GazeRange.about_view(looking_ahead(rig).camera)
    return Request(window=fraction_window(OpticalTrain.bare(rig).camera, WINDOW), gaze=gaze)


def easier(rig: Rig, wanted: Wanted) -> Iterator[tuple[str, Rig, Wanted]]:
    """What could be asked for instead, the smallest concession first."""
    for key in sorted(wanted.pinned):
        yield f"without {key} pinned", rig, replace(wanted, pinned=frozenset(wanted.pinned) - {key})
    yield from _plainer_views(rig, wanted)
    low, high = wanted.request.gaze.second
    half = replace(wanted.request.gaze, second=(low / 2, high / 2))
    request = replace(wanted.request, gaze=half)
    span = f"{np.degrees(low / 2):g} to {np.degrees(high / 2):g}"
    yield f"for a gaze over elevations of {span} degrees only", rig, replace(wanted, request=request)
    bed = tuple(2 * side for side in rig.require_gaze().mount.printer_bed_mm)
    larger = rig.with_gaze(mount={"printer_bed_mm": bed})
    yield f"with a printer of {bed[0]:g} x {bed[1]:g} x {bed[2]:g} mm (mount.printer_bed_mm)", larger, wanted


def _plainer_views(rig: Rig, wanted: Wanted) -> Iterator[tuple[str, Rig, Wanted]]:
    """The camera turned less: each angle half as large, then none."""
    for key in ("roll_deg", "pitch_deg", "yaw_deg"):
        angle = getattr(rig.camera, key)
        for value in (angle / 2, 0.0) if angle else ():
            camera = rig.camera.model_copy(update={key: value})
            yield f"with camera.{key} = {value:g}", rig.model_copy(update={"camera": camera}), wanted
