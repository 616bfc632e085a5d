"""How large a target is in the crop and how it looked, which tells of a blob what its colours do not."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from statistics import median
from typing import Any

from tracking.estimation.track_record import FADED
from tracking.perception import ACQUIRED_LOG_ODDS
from tracking.perception.appearance import AS_LARGE, REMEMBERED_S
from tracking.records import Blob

OUTGROWN = 3.0
"""Times the target's area, as it was and may have grown since, beyond which a blob is the target in one piece with
something else, even if it looks like it still: of that, nothing but the other thing may be left."""

NEARER_PER_S = 0.5
"""Share of its distance by which a target comes nearer in a second at most: its area goes with the inverse square."""

AREAS = 30
"""Last ones of which the median is usual: pieces of it, and of it with something else, are fewer."""

ANOTHER_SIZE = 1.35
"""Times as large or as small as usual, from which an image shows a part of the target, or more than it. By other joint
values it shrinks by 1.28 in a tenth of a second at most, over the zenith as fast as tilt can turn."""

PALER_SHARE = 0.5
"""Of the log odds that most images of a lost target had, below which a candidate is paler than it would be: in the ten
seconds after 13 losses of targets that had 4 and more, 2 of 55 images of them had less than half, and 60 of 66 images
of what else a search stopped for, mostly grey balls in turbid water."""

MOST_REMEMBERED = 3.0
"""Log odds at most that a thing as large as a lost target has beforehand: what is plainly another thing stays one."""


def likeliest(blobs: Iterable[Blob]) -> tuple[Blob, ...]:
    """Which blobs look most like the target: one, or all of a detector that does not weigh and may find it in pieces.

    Of one that looks like no target what has its own colours, or before the light the silhouette: what else has any
    colour there is a rim or a spot of it.
    """
    every = tuple(blobs)
    most = max((blob.log_odds for blob in every), default=math.inf)
    if most < ACQUIRED_LOG_ODDS:
        for told in ("recalled", "silhouette"):
            if told_by := tuple(blob for blob in every if getattr(blob, told)):
                return told_by
    return tuple(blob for blob in every if blob.log_odds == most)


class TargetLook:
    """Size and looks of what is followed, or was lost."""

    def __init__(self) -> None:
        self._own_px2: float | None = None
        self._areas_px2: deque[float] = deque(maxlen=AREAS)
        self._log_odds: deque[float] = deque(maxlen=AREAS)
        self._lost: tuple[float, float, float, float] | None = None

    @property
    def usual_px2(self) -> float:
        """Area that most images showed; of nothing, zero."""
        return median(self._areas_px2) if self._areas_px2 else 0.0

    @property
    def whole_px2(self) -> float:
        """Area when no edge cut it; of nothing, zero. What showed only a part of it last time was found in pieces."""
        return max(self._areas_px2[-1], self.usual_px2) if self._areas_px2 else 0.0

    @property
    def usual_log_odds(self) -> float:
        """Natural logarithm of the odds that most images had by contrast; of nothing, zero."""
        return median(self._log_odds) if self._log_odds else 0.0

    def note(self, blob: Blob, *, whole: bool, interval_s: float, swallowed_s: float) -> float:
        """Note how large the target is, and how it looks.

        Parameters
        ----------
        blob : Blob
            That was taken for it.
        whole : bool
            Whether no edge cuts it.
        interval_s : float
            Since the image before.
        swallowed_s : float
            For how long it may have been swallowed by something larger, before this image.

        Returns
        -------
        float
            The same after it.
        """
        if self.has_outgrown(blob):
            return swallowed_s + interval_s
        if whole:
            self._areas_px2.append(blob.area_px)
            if swallowed_s == 0 and math.isfinite(blob.log_odds) and not (blob.recalled or blob.silhouette):
                self._log_odds.append(blob.log_odds)
        if blob.log_odds >= ACQUIRED_LOG_ODDS:
            self._own_px2 = blob.area_px if whole else self._own_px2
            return 0.0
        if blob.recalled:
            # Its own colours tell where it may be, and not that the other thing is gone.
            return swallowed_s
        if swallowed_s > 0:
            return swallowed_s + interval_s
        if self._own_px2 is not None and whole:
            nearer_px2 = self._own_px2 * math.exp(2 * NEARER_PER_S * interval_s)
            self._own_px2 = max(self._own_px2, min(blob.area_px, nearer_px2))
        return 0.0

    def miss(self, interval_s: float) -> None:
        """Note an image without the target, which may come nearer meanwhile."""
        if self._own_px2 is not None:
            self._own_px2 *= math.exp(2 * NEARER_PER_S * interval_s)

    def has_another_size(self, blob: Blob) -> bool:
        """Whether a blob that no edge cuts shows a part of the target, or more than it; of nothing known, not."""
        larger, smaller = max(blob.area_px, self.usual_px2), min(blob.area_px, self.usual_px2)
        return smaller > 0 and larger > ANOTHER_SIZE * smaller

    def has_outgrown(self, blob: Blob) -> bool:
        """Whether a blob is much larger than the target, as it usually was and as it was when it looked like it."""
        return self._own_px2 is not None and blob.area_px > OUTGROWN * max(self._own_px2, self.usual_px2)

    def may_be_silhouette(self, blob: Blob, *, cut: bool) -> bool:
        """Whether a dark thing is about as large as the target was, or an edge cuts what would be."""
        no_larger, no_smaller = self._compared(blob.area_px, self.usual_px2)
        return no_larger and (no_smaller or cut)

    def lose(self, contrast: float | None, time_s: float) -> None:
        """Remember how what is lost looked: its mean log odds by contrast, None of what was not the target."""
        lacked = 0.0 if contrast is None else ACQUIRED_LOG_ODDS - (contrast - FADED)
        usual = 0.0 if contrast is None else self.usual_log_odds
        self._lost = (min(max(lacked, 0.0), MOST_REMEMBERED), self.usual_px2, usual, time_s)

    def is_paler_than_lost(self, blob: Blob, time_s: float) -> bool:
        """Whether a blob looks far less like the target than one that was lost not long ago."""
        if self._lost is None or blob.silhouette or blob.recalled:
            return False
        *_, usual, lost_s = self._lost
        return time_s - lost_s <= REMEMBERED_S and blob.log_odds < PALER_SHARE * usual

    def remembered(self, blob: Blob, time_s: float, *, followed: bool) -> Blob:
        """A blob with what its size tells of it while a target is sought, or followed again, that was lost when pale.

        What looked no more like the target than even for as long as it was followed would never be acquired again: a
        thing that is as large as it, so soon after, has the odds beforehand that its looks lack.
        """
        if self._lost is None or blob.silhouette or blob.recalled:
            return blob
        prior, area_px2, _, lost_s = self._lost
        if not followed and time_s - lost_s > REMEMBERED_S:
            self._lost = None
            return blob
        if not all(self._compared(blob.area_px, area_px2)):
            return blob
        return replace(blob, log_odds=max(min(blob.log_odds + prior, ACQUIRED_LOG_ODDS), blob.log_odds))

    def forget(self) -> None:
        """What is seen next may be of any size."""
        self._own_px2 = None
        self._areas_px2.clear()
        self._log_odds.clear()

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "own_px2": self._own_px2,
            "areas_px2": list(self._areas_px2),
            "log_odds": list(self._log_odds),
            "lost": self._lost,
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._own_px2 = snapshot["own_px2"]
        self._areas_px2, self._log_odds = (deque(snapshot[name], maxlen=AREAS) for name in ("areas_px2", "log_odds"))
        self._lost = None if snapshot["lost"] is None else tuple(snapshot["lost"])

    @staticmethod
    def _compared(area_px: float, usual_px2: float) -> tuple[bool, bool]:
        """Whether an area is no more than twice, and no less than half of another."""
        return area_px < AS_LARGE * usual_px2, AS_LARGE * area_px > usual_px2
