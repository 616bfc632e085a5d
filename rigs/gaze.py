"""What makes a camera behind a port a mirror gaze: two mirrors, and what turns, carries and holds them."""

from __future__ import annotations

from typing import Literal

from rigs.mounting import Hull, Joints, Mount, Servos
from rigs.section import Positive, Section


class FlatMirror(Section):
    """Front-surface mirror plate.

    `width_mm` and `height_mm` are the sides of the rectangle that its `outline` fills: all of it, the ellipse in it, or
    an octagon, its corners cut at 45 degrees by 0.293 of the shorter side, so that a square becomes a regular one.
    """

    width_mm: Positive
    height_mm: Positive
    thickness_mm: Positive = 3.0
    outline: Literal["rectangle", "octagon", "ellipse"] = "rectangle"

    @property
    def size(self) -> str:
        """Sides and thickness as one writes them, and the outline where it is no rectangle."""
        sides = f"{self.width_mm:g} x {self.height_mm:g} x {self.thickness_mm:g} mm"
        return sides if self.outline == "rectangle" else f"{sides}, {self.outline}"


class FoldMirror(FlatMirror):
    """M1: at 45 degrees on the camera's axis, `distance_mm` (d1) from the pinhole.

    It folds the view down (image-down), as the paper's does, or up. `width_mm` runs along the camera's x, `height_mm`
    along the slope.
    """

    distance_mm: Positive
    direction: Literal["down", "up"] = "down"


class GazeMirror(FlatMirror):
    """M2: on the folded axis, `distance_mm` (d2) from the centre of M1; turned by the two joints.

    `width_mm` runs along the tilt axis. Both joint axes cross at the centre of the reflecting face.
    """

    distance_mm: Positive


class Gaze(Section):
    """Both mirrors, the joints and servos that turn them, the hull that carries them and the mount that holds them.

    A rig has all of these or none. In the rig file they are tables of their own, beside those of camera and port.
    """

    fold_mirror: FoldMirror
    gaze_mirror: GazeMirror
    joints: Joints
    servos: Servos
    hull: Hull
    mount: Mount
