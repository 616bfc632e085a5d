"""Which joint values to ask for, so that the gaze is on a moving direction when the servos get there.

There are two ways to look anywhere, over the front and over the zenith, half a turn of pan apart, and often the limits
leave only one. The target is followed along the way on which the gaze is closer to it over the next seconds, each joint
turning at its servo's speed; the other way must be better by a margin before the pan is turned round. Directions out of
reach are followed by the nearest gaze within the limits.

Near the zenith pan turns the picture rather than the gaze, and may be far from where it should be: the tilt is that of
the pan that will be reached, the nearest gaze on that half circle.
"""

from __future__ import annotations

import math

from optics.gaze_jacobian import NO_AZIMUTH
from optics.gaze_motion import JointSpeeds
from tracking.estimation.direction_filter import Bearing
from tracking.estimation.gimbal import Gimbal
from tracking.protocols import FloatArray

LOOK_AHEAD_S = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0)
"""When two ways are compared: over the time that a servo of 60 degrees/s needs for half a turn."""

MARGIN = math.radians(3.0)
"""By which the mean error over that time must be smaller on the other way: some of a crop's half width."""

TURN = 2 * math.pi
Triple = tuple[float, float, float]


class Pointing:
    """Keeps the gaze on a bearing.

    Parameters
    ----------
    gimbal : Gimbal
    speeds : JointSpeeds
    """

    def __init__(self, gimbal: Gimbal, speeds: JointSpeeds):
        self._gimbal = gimbal
        self._speeds = (speeds.pan, speeds.tilt)
        self._pan, self._twice_tilt = gimbal.limits(0), tuple(2 * end for end in gimbal.limits(1))
        self.over: bool | None = None
        """Whether the gaze goes over the zenith; None before the first command."""

    def command(self, bearing: Bearing, ahead_s: float, q: FloatArray) -> FloatArray:
        """Joint values to ask for, shape (2,), radians.

        Parameters
        ----------
        bearing : Bearing
            Of the target now.
        ahead_s : float
            When the gaze is to be on it. Pointing at where the target will be is the feed-forward of its rate.
        q : array, shape (2,)
            Joint values now.
        """
        pan, tilt = self._gimbal.angles(q)
        start = (pan, 2 * tilt)
        directions = [self._ahead(bearing, seconds) for seconds in LOOK_AHEAD_S]
        errors = [self._mean_error(directions, start, over) for over in (False, True)]
        if self.over is None:
            self.over = errors[True] < errors[False]
        elif errors[not self.over] < errors[self.over] - MARGIN:
            self.over = not self.over
        direction = self._ahead(bearing, ahead_s)
        goal = self._pan_towards(direction, self.over, pan)
        reached = _limited(goal, pan, self._speeds[0] * ahead_s)
        return self._gimbal.joint_values(goal, self._twice_tilt_towards(direction, reached) / 2)

    def forget(self) -> None:
        """Choose the way anew for the next target."""
        self.over = None

    def _ahead(self, bearing: Bearing, seconds: float) -> Triple:
        x, y, z = self._gimbal.in_gimbal(bearing.after(seconds).direction).tolist()
        return x, y, z

    def _mean_error(self, directions: list[Triple], start: tuple[float, float], over: bool) -> float:
        """Mean angle between gaze and target at the look-ahead times, on one of the ways."""
        total = 0.0
        for direction, seconds in zip(directions, LOOK_AHEAD_S, strict=True):
            pan = _limited(self._pan_towards(direction, over, start[0]), start[0], self._speeds[0] * seconds)
            goal = self._twice_tilt_towards(direction, pan)
            total += _angle(direction, pan, _limited(goal, start[1], 2 * self._speeds[1] * seconds))
        return total / len(directions)

    def _pan_towards(self, direction: Triple, over: bool, pan: float) -> float:
        x, y, _ = direction
        if math.hypot(x, y) < NO_AZIMUTH:
            return pan
        return _within(math.atan2(y, x) + (math.pi if over else 0.0), self._pan, pan)

    def _twice_tilt_towards(self, direction: Triple, pan: float) -> float:
        """Elevation, counted on over the zenith, of the nearest gaze at a pan angle."""
        x, y, z = direction
        lowest, highest = self._twice_tilt
        elevation = math.atan2(z, x * math.cos(pan) + y * math.sin(pan))
        return _within(elevation, (lowest, highest), (lowest + highest) / 2)


def _within(angle: float, limits: tuple[float, float], near: float) -> float:
    """The whole turns away from `angle` that lies between limits and nearest to `near`; else the nearer limit."""
    lowest, highest = limits
    nearest = angle + TURN * round((near - angle) / TURN)
    for candidate in (nearest, nearest - TURN, nearest + TURN):
        if lowest <= candidate <= highest:
            return candidate
    beyond = [abs(math.remainder(angle - limit, TURN)) for limit in limits]
    return lowest if beyond[0] < beyond[1] else highest


def _limited(goal: float, start: float, most: float) -> float:
    return min(max(goal, start - most), start + most)


def _angle(direction: Triple, pan: float, twice_tilt: float) -> float:
    """Between a direction and the gaze, radians."""
    x, y, z = direction
    level = math.cos(twice_tilt)
    cosine = x * level * math.cos(pan) + y * level * math.sin(pan) + z * math.sin(twice_tilt)
    return math.acos(min(max(cosine, -1.0), 1.0))
