"""How often the size of what is followed jumps from an image to the next: pieces of something, now one and now another.

Something ragged is found as this piece and as that. A ball's size does not jump.
"""

from __future__ import annotations

from dataclasses import dataclass

JUMP, LEAST_JUMPS, FEWEST_COMPARED = 1.35, 0.5, 30
"""Times as large or as small from an image to the next, share of the images in which that makes what stands still a
thing of pieces, and how many must have been compared. Of 198 tracks of targets (presets, arena, point to point) 197 had
less than 0.36, six of one coral, found as pieces of 552 to 17,088 pixels, 0.57 to 0.8."""


@dataclass
class SizeJumps:
    """Sizes of what is followed, an image at a time.

    Attributes
    ----------
    area_px : float, optional
        In the last image, in which nothing cut it; None where something did, or it was not seen.
    compared, jumps : int
        Images in which its area was known as it was in the image before, and those in which it was another.
    """

    area_px: float | None = None
    compared: int = 0
    jumps: int = 0

    @property
    def often(self) -> bool:
        """Whether it is another in every second image."""
        return self.compared >= FEWEST_COMPARED and self.jumps > LEAST_JUMPS * self.compared

    def note(self, area_px: float | None) -> None:
        """Note how large it was in the last image, in pixels of the crop; None where something cut or hid it."""
        if area_px is not None and self.area_px is not None:
            self.compared += 1
            self.jumps += not 1 / JUMP <= area_px / self.area_px <= JUMP
        self.area_px = area_px
