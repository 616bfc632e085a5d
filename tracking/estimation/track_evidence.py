"""Whether what is followed is the target, from the odds of what was taken for it; and what was found not to be.

What is *trusted* (`tracking.estimation.track_record`) is believed when its looks fade, as before the sun, for as long
as its contrast alone is above even. Dropped is

- what is not trusted within its probation, overhead apart, or falls below even before;
- what is seen in less than a third of the images that should show it;
- what stands still and has another size in every second image;
- what stands still and has not looked plainly like the target soon, trusted or not: a reef has round brown things, and
  one of them would be followed for good. Sooner, if something is seen beside it that does look like the target;
- what stays where it was first seen, of a target that is known to swim;
- what was in one piece with something larger, as a target is that passes it, and does not look like the target soon.

Its direction is remembered as clutter: the search does not end there again. What was above even still, or was not seen
again before it could be judged, is clutter for a shorter time. But a candidate that looked plainly like the target for
a few images and then got away, as past a joint's end or behind the mount, is sought where it can have gone.

A thing that moves with the robot, as its mount, keeps its direction in the body's frame, and what stands around a
hovering robot nearly does; where an attitude sensor tells how the robot turns, directions are steady ones, and what
stands around it keeps its own. A robot that swims on leaves clutter behind, so it is forgotten.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from optics.kernels.arrays import FloatArray
from tracking.estimation.clutter import Clutter
from tracking.estimation.track_record import AT_ONCE_LOG_ODDS, JUDGED_S, TrackRecord

PROBATION_S, AT_LEISURE_S = 1.5, 1.0
"""How long it may be followed without being trusted, and the age from which it needs to be above even alone."""

PLAIN_LOG_ODDS, PLAIN_S = 4.0, 3.0
"""Of the mean by contrast and outline, which what stands still must have had once to be followed for longer, where a
target would have, times `TrackEvidence.plain`. After 2.5 s, in water that leaves a target its colour (arena and point
to point), 54 tracks of targets had 4.2 or more, 14 corals and rocks 2.0 to 2.7. By contrast alone a ball of 300 pixels
had 3.6; a black one has 2.9, and is as round as the target. In turbid water, which leaves 0.65 of that colour, 16
tracks of targets had 2.7 or more after 3 s."""

SOON_LOG_ODDS, SOON_S = 3.0, 1.5
"""And what must have been had of it sooner by what is trusted: after this time 61 tracks of targets had 3.4 or more, 15
corals and rocks 2.0 to 2.7; in turbid water 26 tracks of targets 2.2 or more."""

PROMISING_LOG_ODDS, PROMISING_S = 2.5, 0.2
"""Of the mean by all marks, and for how long a candidate must have been seen that is sought when it gets away before it
can be judged: of a reef's red things, seen past a hull's edge, some look like the target in one image or two."""

OUTSHONE_S = 0.2
"""For which something else must have looked like the target beside what has not: a few images, as for a candidate."""

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

LEAST_SHARE = 1 / 3
"""Of the images that should show it, those that must."""

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
class TrackEvidence(TrackRecord):
    """Odds of what is followed, and the clutter.

    Attributes
    ----------
    plain : float
        How plainly a target looks like one sooner or later, of how it does in clear water, from 0 to 1: nothing is
        dropped for being pale where the water leaves none of its colour.
    least_speed_m_per_s : float, optional
        At which the target swims at least, before a robot that hovers; None where that is not known.
    clutter : Clutter
    """

    plain: float = 1.0
    least_speed_m_per_s: float | None = None
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
        return super().snapshot() | {"clutter": self.clutter.snapshot()}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        super().restore(snapshot)
        self.clutter.restore(snapshot["clutter"])
