"""What the images of what is followed have shown of it: how it looked, for how long, how often, and beside what.

One image's odds are those of a guess. What is followed is seen many times, but images of a thing that stands still are
nearly the same, so that their odds do not add up: their mean is kept. Contrast, outline and whether it has moved count
together until the mean has been that of a target for a while: then it is *trusted*. What that comes to is decided by
`tracking.estimation.track_evidence`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from optics.kernels.arrays import FloatArray
from tracking.estimation.own_motion import OwnMotion
from tracking.estimation.size_jumps import SizeJumps
from tracking.perception import ACQUIRED_LOG_ODDS

MEMORY_S, LONGEST_MEMORY_S, AGED = 0.5, 4.0, 5.0
"""Over which odds are averaged, exponentially: from the first to the second, a fifth of the time for which a thing has
been seen. What was followed for long without a gap is still the same thing when its looks fade."""

MOST_LOG_ODDS = 3.0
"""That one image's contrast counts for, more or less: a lucky one does not outweigh ten others."""

MOVED_LOG_ODDS = 2.0
"""That having moved counts for; decoys drift as well."""

TRUSTED_LOG_ODDS = 1.0
"""Of the mean, from which what is followed is taken for the target."""

TRUSTED_S = 0.5
"""How long it must have been followed to be trusted."""

AT_ONCE_LOG_ODDS = 3.0
"""That a candidate of one image needs to be tracked, and what is seen beside it to look like the target."""

MOST_PLAIN, MOST_OUTLINE = 5.0, 0.5
"""That one image's contrast and outline count for in `plainness`, more or less."""

OVERHEAD_RAD = math.radians(20.0)
"""Elevation from which a target need not look plainly like one; it is taken among the steady axes, as of a robot that
swims level. Before the bright surface a ball shows its dark side: one 31 to 37 degrees up had 2. Nor are there corals:
of 386 s in which dives followed something of a world 2 were so high."""

PALER = 3.0
"""Log odds by contrast by which something else must look more like the target than what has become paler than one that
is acquired: a grey ball that hides a target is followed in its place with 1 to 1.8, and the target, come out beside it,
has 4 to 7."""

OUTDONE = 6.0
"""Log odds by contrast by which something must look more like the target than what stands still has ever done: a round
coral has 4.5 at most, and a target that passes before it 27."""

ROUND_LOG_ODDS = 1.0
"""Of the outline, from which an area is that of the whole ball: one that touches another thing in the view had -1.5 to
0.3, and 2 before (2107)."""

GAP_S, FADED = 0.2, 1.0
"""What comes into view after a gap, and has by so much less log odds by contrast, may be another thing."""

JUDGED_S = 0.3
"""After which it may fall below even: the first images of a target are smeared, or show its edge."""

SHARE_MEMORY_S = 1.0
"""Over which the share of images is averaged that show what they should."""


@dataclass
class TrackRecord:
    """What was seen of a track, and the means over it.

    Attributes
    ----------
    contrast, together : float, optional
        Mean natural logarithm of the odds, by contrast alone and with outline and motion; None while nothing is
        followed.
    plainness, clearest : float, optional
        The first, of which single images count for more; and the most that it has been since it could be judged.
    age_s, level_s : float
        Time in which it was seen, and in which it was seen not overhead.
    share : float
        Of the images that should show it, those that did.
    trusted : bool
    whole : bool
        Whether an image has shown all of it.
    outshone_s : float
        For how long something else has looked like the target beside it.
    paler_s : float
        And for how long so much more so, since it has become pale or was never plain.
    outdone : bool
        Whether something else has looked so much more like the target than it ever did that it is likelier to be that.
    swallowed_s : float
        For how long it has not looked like the target since it was in one piece with something larger.
    silhouette_s : float
        For how long it has been told by its darkness alone.
    recalled_s : float
        For how long it has been told by its own colours alone.
    untold_s : float
        Since contrast told it last, whether it was seen or not.
    motion : OwnMotion
    sizes : SizeJumps
    """

    contrast: float | None = None
    together: float | None = None
    plainness: float | None = None
    clearest: float | None = None
    age_s: float = 0.0
    level_s: float = 0.0
    share: float = 1.0
    trusted: bool = False
    whole: bool = False
    outshone_s: float = 0.0
    paler_s: float = 0.0
    outdone: bool = False
    swallowed_s: float = 0.0
    silhouette_s: float = 0.0
    recalled_s: float = 0.0
    untold_s: float = 0.0
    motion: OwnMotion = field(default_factory=OwnMotion)
    sizes: SizeJumps = field(default_factory=SizeJumps)

    def update(
        self,
        contrast: float,
        outline: float | None,
        direction: FloatArray,
        interval_s: float,
        area_px2: float | None = None,
    ) -> None:
        """Take in one more image of what was taken for the target.

        Parameters
        ----------
        contrast : float
            Log odds of the detector; infinite ones are no guess.
        outline : float, optional
            Log odds of its outline; None where an edge cuts it and hides what that is like.
        direction : array, shape (3,)
            Unit vector, steady axes.
        interval_s : float
            Since the image before.
        area_px2 : float, optional
            Pixels of the crop; None where that is not known.
        """
        self.recalled_s = self.untold_s = 0.0
        round_px2 = area_px2 if outline is not None and outline >= ROUND_LOG_ODDS else None
        moved = self.motion.note(direction, interval_s, round_px2)
        counted = _bounded(contrast, MOST_LOG_ODDS)
        memory_s = min(max(MEMORY_S, self.age_s / AGED), LONGEST_MEMORY_S)
        self.contrast = _averaged(self.contrast, counted, interval_s / memory_s)
        marks = (outline or 0.0) + MOVED_LOG_ODDS * moved
        self.together = _averaged(self.together, counted + marks, interval_s / memory_s)
        self.share = _averaged(self.share, 1.0, interval_s / SHARE_MEMORY_S)
        self.age_s += interval_s
        self.level_s += interval_s * (not is_overhead(direction))
        plainness = _bounded(contrast, MOST_PLAIN) + _bounded(outline or 0.0, MOST_OUTLINE)
        self.plainness = _averaged(self.plainness, plainness, interval_s / memory_s)
        if self.age_s > JUDGED_S:
            self.clearest = self.plainness if self.clearest is None else max(self.clearest, self.plainness)
        self.whole = self.whole or outline is not None
        self.trusted = self.trusted or (self.age_s >= TRUSTED_S and self.together >= TRUSTED_LOG_ODDS)

    def note_silhouette(self, interval_s: float, *, dark: bool) -> None:
        """Note whether its darkness alone told it in the last image."""
        self.silhouette_s = self.silhouette_s + interval_s if dark else 0.0

    def recall(self, interval_s: float) -> None:
        """Take in an image in which its own colours told it: what it is they do not tell."""
        self.sizes.note(None)
        self.share = _averaged(self.share, 1.0, interval_s / SHARE_MEMORY_S)
        self.recalled_s += interval_s
        self.untold_s += interval_s

    def note_other(self, log_odds: float, interval_s: float) -> None:
        """Take in how much the likeliest other thing in the last image looks like the target, by contrast."""
        if log_odds < AT_ONCE_LOG_ODDS or self.contrast is None:
            return
        self.outshone_s += interval_s
        outdone = self.is_outdone_by(log_odds)
        paler = outdone or self.contrast < min(ACQUIRED_LOG_ODDS, log_odds - PALER)
        self.outdone = self.outdone or outdone
        self.paler_s = self.paler_s + interval_s if paler else 0.0

    def miss(self, interval_s: float, *, shown: bool) -> None:
        """Take in an image without it, which should show it or not; what is seen next to it has not moved there."""
        self.motion.interrupt()
        self.sizes.note(None)
        self.untold_s += interval_s
        if shown:
            self.share = _averaged(self.share, 0.0, interval_s / SHARE_MEMORY_S)

    def is_another(self, contrast: float, gap_s: float) -> bool:
        """Whether what is seen after a gap looks less like the target than what was followed before it."""
        return self.contrast is not None and gap_s >= GAP_S and contrast < self.contrast - FADED

    def is_outdone_by(self, log_odds: float) -> bool:
        """Whether something looks so much more like the target than what stands still and was never plain."""
        if self.motion.moved or self.clearest is None or self.clearest >= MOST_PLAIN:
            return False
        return log_odds >= self.clearest + OUTDONE

    def begin_again(self) -> None:
        """What is seen next may be another thing than what was followed: it has to be trusted first."""
        self.contrast = self.together = self.plainness = self.clearest = None
        self.motion, self.sizes = OwnMotion(), SizeJumps()
        self.age_s, self.level_s, self.share = 0.0, 0.0, 1.0
        self.trusted = self.whole = self.outdone = False
        self.outshone_s = self.paler_s = self.swallowed_s = self.silhouette_s = self.recalled_s = self.untold_s = 0.0

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        numbers = {name: getattr(self, name) for name in NUMBERS}
        return numbers | {"motion": self.motion.snapshot(), "sizes": asdict(self.sizes)}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        for name in NUMBERS:
            setattr(self, name, snapshot[name])
        self.motion = OwnMotion.restored(snapshot["motion"])
        self.sizes = SizeJumps(**snapshot["sizes"])


NUMBERS = tuple(each.name for each in fields(TrackRecord) if each.name not in ("motion", "sizes"))
"""Attributes that are plain numbers."""


def is_overhead(direction: FloatArray) -> bool:
    """Whether a direction, a unit vector in steady axes, is so high that things stand before the bright surface."""
    return bool(direction[2] >= math.sin(OVERHEAD_RAD))


def _bounded(value: float, most: float) -> float:
    return min(max(value, -most), most)


def _averaged(mean: float | None, value: float, times: float) -> float:
    """Exponential average after one more value, `times` of the memory after the one before."""
    return value if mean is None else mean - math.expm1(-times) * (value - mean)
