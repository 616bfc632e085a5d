"""The gaze by hand: the camera's image is clicked and dragged, and the joints follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from importlib.resources import files

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.status import Region
from studio.controller import Studio
from studio.results import View

POINTED = "/pointed"
"""Where the page's script tells what the pointer does."""
STILL_SHARE = 0.01
"""Of the image's sides: a pointer that goes less far clicks."""
STYLE = '<style>img[src^="blob:"]{touch-action:none;user-select:none;cursor:grab}</style>'


@dataclass
class Hold:
    """What a pointer holds: from which page, where it began, what it pointed at, through what, and whether it moved."""

    page: str
    begin: FloatArray
    direction: FloatArray
    region: Region
    moved: bool = False


class Hand:
    """What pointers on the image make of the joints.

    What M2 shows is dragged: it stays under the pointer. Where the camera sees the water past the mirrors, or through
    M1 alone, there is nothing to drag, and the gaze goes to where the pointer points. A click turns the gaze there too.

    Parameters
    ----------
    studio : Studio

    Attributes
    ----------
    view : View, optional
        The image that is shown.
    """

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self.view: View | None = None
        self._hold: Hold | None = None

    def take(self, told: Mapping[str, str]) -> bool:
        """Take what a page tells; whether the joints move for it."""
        share = np.array([float(told["x"]), float(told["y"])])
        phase, page = told["phase"], told["page"]
        if phase == "down":
            self._hold = self._held(page, share)
            return False
        hold = self._hold
        if hold is None or hold.page != page:
            return False
        hold.moved |= bool(np.abs(share - hold.begin).max() > STILL_SHARE)
        if phase == "move":
            return hold.moved and self._dragged(hold, share)
        self._hold = None
        return phase == "up" and not hold.moved and self._studio.look_towards(hold.direction)

    def _held(self, page: str, share: FloatArray) -> Hold | None:
        """What is at a place of the image; None where the inside of the housing is, or no image yet."""
        view = self.view
        if view is None:
            return None
        region = Region(view.region[self._cell(view, share)])
        request = view.request
        q1, q2 = (float(q) for q in np.radians([request.q1_deg, request.q2_deg]))
        seen = view.sights.seen(Layout.from_rig(request.rig), self._pixel(view, share), region, q1, q2)
        if region == Region.HOUSING or np.isnan(seen).any():
            return None
        return Hold(page=page, begin=share, direction=seen, region=region)

    def _dragged(self, hold: Hold, share: FloatArray) -> bool:
        assert self.view is not None
        sight = self.view.sights.at(self._pixel(self.view, share))
        if np.isnan(sight).any():
            return False
        if hold.region == Region.GAZE:
            return self._studio.show_at(hold.direction, sight)
        now = self._held(hold.page, share)
        return now is not None and now.region == hold.region and self._studio.look_towards(now.direction)

    @staticmethod
    def _pixel(view: View, share: FloatArray) -> FloatArray:
        """Pixel of the rig's camera at a place of the image."""
        camera = view.request.rig.camera
        return share * (camera.width_px, camera.height_px) - 0.5

    @staticmethod
    def _cell(view: View, share: FloatArray) -> tuple[int, int]:
        """Row and column of the image at a place of it."""
        height, width = view.region.shape
        column, row = np.clip((share * (width, height)).astype(int), 0, (width - 1, height - 1))
        return int(row), int(column)


def pointing_html() -> str:
    """HTML that watches the pointer on the page's images."""
    script = files("studio.panels").joinpath("pointing.js").read_text(encoding="utf-8")
    # A script that is put into a page does not run; what an image does that cannot be loaded does.
    return f'{STYLE}<img hidden alt="" src="data:," onerror="{escape(script)}">'
