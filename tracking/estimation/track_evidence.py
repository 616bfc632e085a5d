"""Whether what is followed is the target, from the odds of what was taken for it; and what was found not to be.

One image's odds are those of a guess: things that look like the target are found among corals. What is followed is seen
many times, but images of a thing that stands still are nearly the same, so that their odds do not add up: their mean is
asked for. Contrast, outline and whether it has moved count together until the mean has been that of a target for a
while: then it is *trusted*, and looks that fade, as before the sun, are believed for as long as its contrast alone is
above even. What never gets there within its probation, overhead apart, what falls below even before, what is seen in
less than a third of the images that should show it, and what stands still and has another size in every second one, is
dropped, and its direction is remembered as clutter: the search does not end there again. So is what is trusted, but
stands still and has not looked plainly like the target soon: a reef has round brown things, and one of them would be
followed for good; sooner, if something is seen beside it that does look like the target. What stays where it was first
seen is no target that is known to swim, whatever it looks like. What was above even still, or was not seen again before
it could be judged, is clutter for a shorter time. But a candidate that looked plainly like the target for a few images
and then got away, as past a joint's end or behind the mount, is sought where it can have gone. A target may be in one
piece with something larger that it passes, and hides it: what then does not look like the target soon is dropped as
well. A thing that moves with the robot, as its mount, keeps its direction in the body's frame, and what stands around a
hovering robot nearly does; where an attitude sensor tells how the robot turns, directions are steady ones, and what
stands around it keeps its own. A robot that swims on leaves clutter behind, so it is forgotten.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from optics.kernels.arrays import FloatArray
from tracking.estimation.clutter import Clutter
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

TRUSTED_S, PROBATION_S = 0.5, 1.5
"""How long it must have been followed to be trusted, and may be followed without."""

AT_ONCE_LOG_ODDS, AT_LEISURE_S = 3.0, 1.0
"""That a candidate of one image needs to be tracked, and the age from which it needs to be above even alone."""

PLAIN_LOG_ODDS, PLAIN_S, MOST_PLAIN, MOST_OUTLINE = 4.0, 3.0, 5.0, 0.5
"""Of the mean by contrast and outline, which what stands still must have had once to be followed for longer, where a
target would have, times `TrackEvidence.plain`; and what one image's contrast and outline count for in it, more or less.
After 2.5 s, in water that leaves a target its colour (arena and point to point), 54 tracks of targets had 4.2 or more,
14 corals and rocks 2.0 to 2.7. By contrast alone a ball of 300 pixels had 3.6; a black one has 2.9, and is as round as
the target. In turbid water, which leaves 0.65 of that colour, 16 tracks of targets had 2.7 or more after 3 s."""

SOON_LOG_ODDS, SOON_S = 3.0, 1.5
"""And what must have been had of it sooner by what is trusted: after this time 61 tracks of targets had 3.4 or more, 15
corals and rocks 2.0 to 2.7; in turbid water 26 tracks of targets 2.2 or more."""

OVERHEAD_RAD = math.radians(20.0)
"""Elevation from which a target need not look plainly like one; it is taken among the steady axes, as of a robot that
swims level. Before the bright surface a ball shows its dark side: one 31 to 37 degrees up had 2. Nor are there corals:
of 386 s in which dives followed something of a world 2 were so high."""

PROMISING_LOG_ODDS, PROMISING_S = 2.5, 0.2
"""Of the mean by all marks, and for how long a candidate must have been seen that is sought when it gets away before it
can be judged: of a reef's red things, seen past a hull's edge, some look like the target in one image or two."""

OUTSHONE_S = 0.2
"""For which something else must have looked like the target beside what has not: a few images, as for a candidate."""

PALER = 3.0
"""Log odds by contrast by which something else must look more like the target than what has become paler than one that
is acquired: a grey ball that hides a target is followed in its place with 1 to 1.8, and the target, come out beside it,
has 4 to 7."""

OUTDONE = 6.0
"""Log odds by contrast by which something must look more like the target than what stands still has ever done: a round
coral has 4.5 at most, and a target that passes before it 27."""

GAP_S, FADED = 0.2, 1.0
"""What comes into view after a gap, and has by so much less log odds by contrast, may be another thing."""

JUDGED_S = 0.3
"""After which it may fall below even: the first images of a target are smeared, or show its edge."""

KNOWN_S = 20.0
"""After which what has been followed all the time is the target, however pale it becomes: it may be lost, but is not
doubted."""

SWALLOWED_S = 2.0
"""For which what was in one piece with something larger may be followed without looking like the target again, even if
it was the target for `KNOWN_S` before."""

SILHOUETTE_S = 10.0
"""For which it may be told by its darkness alone, as before the sun, however long it was the target before; what is
round and overhead (`is_overhead`) for as long as it is, since nothing but a ball is."""

RECALLED_S = 10.0
"""For which it may be told by its own colours alone, as it had them before."""

SHARE_MEMORY_S, LEAST_SHARE = 1.0, 1 / 3
"""Over which the share of images is averaged that show what they should, and the least share of them."""

CLUTTER_S = 30.0
"""How long clutter is remembered: the time of a search of everything within reach."""

UNDECIDED_S = 5.0
"""The same of what was above even when it was dropped, or not seen again before it could be judged: it must not hold
the search again at once, but may be the target."""

CLUTTER_RAD, SWAY_RAD = math.radians(3.0), math.radians(12.0)
"""Within which what was dropped is recognised: twice what a hovering robot sways by; of a robot that sways by more, as
far as it was seen to swing, up to the second, and of a large thing, of which now this part is seen and now that, as far
as it reaches."""


@dataclass
class TrackEvidence:
    """Odds of what is followed, and the clutter.

    Attributes
    ----------
    plain : float
        How plainly a target looks like one sooner or later, of how it does in clear water, from 0 to 1: nothing is
        dropped for being pale where the water leaves none of its colour.
    least_speed_m_per_s : float, optional
        At which the target swims at least, before a robot that hovers; None where that is not known.
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
    clutter : Clutter
    """

    plain: float = 1.0
    least_speed_m_per_s: float | None = None
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
    clutter: Clutter = field(default_factory=Clutter)

    @property
    def doubted(self) -> bool:
        """Whether what is followed is likelier not to be the target."""
        if self.contrast is None or self.together is None:
            return False
        if self._untold or self._stays_pale or self._in_pieces or self._stays_there:
            return True
        if self.trusted and self.age_s >= KNOWN_S:
            return False
        if self.share < LEAST_SHARE:
            return True
        if self.trusted:
            return self.contrast < 0
        return self.level_s > PROBATION_S or (self.age_s > JUDGED_S and self.together < 0)

    @property
    def _untold(self) -> bool:
        """Whether its looks have not told it for too long, but its place, darkness or colours alone, and others' do."""
        too_long = self.silhouette_s > SILHOUETTE_S or self.recalled_s > RECALLED_S or self.swallowed_s > SWALLOWED_S
        return too_long or self.paler_s > OUTSHONE_S

    @property
    def _stays_pale(self) -> bool:
        """Whether it has never looked plainly like the target, and has stood still for so long or been outshone."""
        if not self.plain or self.clearest is None or self.clearest >= PLAIN_LOG_ODDS * self.plain:
            return False
        patience_s = SOON_S if self.trusted and self.clearest < SOON_LOG_ODDS * self.plain else PLAIN_S
        return self.outshone_s > OUTSHONE_S or (not self.motion.moved and self.level_s > patience_s)

    @property
    def _in_pieces(self) -> bool:
        """Whether its size is another in every second image.

        Not of what has moved, which no coral does before a hovering robot: a ball that hardly stands out is found in
        pieces, too.
        """
        return self.sizes.often and not self.motion.moved

    @property
    def _stays_there(self) -> bool:
        """Whether it is still where it was first seen, and the target would have swum on."""
        return self.least_speed_m_per_s is not None and self.motion.stays(self.least_speed_m_per_s)

    @property
    def _below_even(self) -> bool:
        """Whether contrast, or all marks together, speak against it, too few images showed it, or its size jumps."""
        assert self.contrast is not None and self.together is not None  # something is followed
        if self.share < LEAST_SHARE or self._in_pieces:
            return True
        return self.contrast < 0 or (not self.trusted and self.together < 0)

    @property
    def likely(self) -> bool:
        """Whether a candidate may be tracked: the less is asked of it the longer it has been seen.

        What comes in over the edge of the view has no outline yet: it is a candidate until all of it is seen, until it
        is trusted as it is, or for as long as anything else is asked for more than even odds.
        """
        if self.together is None or self.trusted:
            return True
        asked = AT_ONCE_LOG_ODDS * max(1 - self.age_s / AT_LEISURE_S, 0.0)
        return (self.whole or asked == 0) and self.together >= asked

    @property
    def promising(self) -> bool:
        """Whether it has looked plainly like the target in more images than a lucky few."""
        return self.age_s > PROMISING_S and self.together is not None and self.together >= PROMISING_LOG_ODDS

    @property
    def probability(self) -> float:
        """That what is dropped is the target for all that: by its odds, where nothing else speaks against it.

        In 72 dives of the arena six things were dropped after 0.7 to 1.2 s, of which four were the target. What never
        looks plainly like one, or comes in pieces where targets look plain, has none.
        """
        if self.together is None or self.age_s <= JUDGED_S:
            return 0.0
        if self._untold or self._stays_pale or self._stays_there or self.outdone or (self._in_pieces and self.plain):
            return 0.0
        return 1 / (1 + math.exp(-self.together))

    def update(
        self,
        contrast: float,
        outline: float | None,
        direction: FloatArray,
        interval_s: float,
        usual_px2: float = 0.0,
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
        usual_px2 : float
            Area that most of the last images showed, pixels of the crop; zero where that is not known.
        """
        self.recalled_s = self.untold_s = 0.0
        moved = self.motion.note(direction, interval_s, usual_px2)
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

    def drop(self, direction: FloatArray, time_s: float, radius_rad: float = 0.0) -> None:
        """What is followed is not the target, or was not found again: remember where it is, and how far it reaches."""
        for_long = self._below_even or self._stays_pale or self._stays_there or self.outdone
        lasting_s = CLUTTER_S if for_long else UNDECIDED_S
        # What it is paler than is beside it, and no clutter.
        swung_rad = 0.0 if self.paler_s > OUTSHONE_S else min(self.motion.swing_rad, SWAY_RAD)
        within_rad = max(CLUTTER_RAD, swung_rad, radius_rad)
        if self._stays_there:
            # At any time it may be where the robot's sway takes it, about the middle of where it has been.
            direction, within_rad = self.motion.middle, max(SWAY_RAD, radius_rad)
        self.clutter.add(direction, within_rad, time_s + lasting_s)
        self.begin_again()

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        plain = {name: getattr(self, name) for name in self._plain_state()}
        return plain | {
            "motion": self.motion.snapshot(),
            "sizes": asdict(self.sizes),
            "clutter": self.clutter.snapshot(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        for name in self._plain_state():
            setattr(self, name, snapshot[name])
        self.motion = OwnMotion.restored(snapshot["motion"])
        self.sizes = SizeJumps(**snapshot["sizes"])
        self.clutter.restore(snapshot["clutter"])

    def _plain_state(self) -> list[str]:
        """Names of the attributes that change and are plain numbers."""
        others = ("plain", "least_speed_m_per_s", "motion", "sizes", "clutter")
        return [each.name for each in fields(self) if each.name not in others]


def is_overhead(direction: FloatArray) -> bool:
    """Whether a direction, a unit vector in steady axes, is so high that things stand before the bright surface."""
    return bool(direction[2] >= math.sin(OVERHEAD_RAD))


def _bounded(value: float, most: float) -> float:
    return min(max(value, -most), most)


def _averaged(mean: float | None, value: float, times: float) -> float:
    """Exponential average after one more value, `times` of the memory after the one before."""
    return value if mean is None else mean - math.expm1(-times) * (value - mean)
