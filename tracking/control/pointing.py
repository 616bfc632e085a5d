"""Which joint values to ask for, so that the gaze is on a moving direction when the servos get there.

Tilt turns the gaze twice as fast as pan does, and without a singularity: at any pan angle it can be left to follow the
direction as closely as its half circle allows. What has to be planned is pan. There are two pan angles from which the
gaze is exact, over the front and over the zenith, half a turn apart; near the zenith both run faster than any servo,
and where the limits leave only one of them pan must be turned round, which takes seconds.

So pan is planned by dynamic programming (Bellman 1957) over the time that a servo needs for its whole range, with the
direction extrapolated: on a grid of pan angles, what will be lost of the view from there on when pan moves as well as
it can. While an exact angle is as good as the best plan, to within a margin that keeps the mirror from changing its
mind, it is taken. Else the plan is: to let a target pass beside the zenith without following it round, to turn round in
time, to wait at a limit. A direction out of reach is followed by the nearest gaze within the limits.

A target that is not seen is not planned for: where it will be in two seconds is a guess, and a mirror that has turned
round for it does not see it come back. Only where this way does not show the place that it is expected in, and another
pan angle will by the time that pan has got there, is there nothing to lose: so a target that goes round the robot is
met again behind it, over the other half of the tilt. It must have been seen to go past the joints' end
(`tracking.control.gaze_follower`): one that the detector lost in the middle of the view, as before the sun, is waited
for. Nor is a target that is in view left for where it will be.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from optics.gaze.jacobian import NO_AZIMUTH
from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from tracking.estimation.bearing import Bearing
from tracking.estimation.gimbal import TURN, Gimbal

PAN_NODES = 32
"""Of the plan: 5 degrees apart for the paper's servos, half of what a crop sees to one side."""

NODES_PER_STEP = 3
"""That pan moves in one step of the plan."""

IN_REACH = np.ones(2 * NODES_PER_STEP + 1, dtype=np.uint8)
"""Nodes about one from which pan gets to it in one step."""

STEPS = 12
"""Of the plan: 36 nodes, more than the whole range."""

MARGIN = 0.2
"""By which a plan must be better than an exact angle, in steps with the target out of view. The grid alone makes up to
0.05 of difference: half the distance of its nodes is a quarter of the half view, squared."""

OUT_OF_VIEW_SLOPE = 1e-3
"""Of the loss beyond the view, where it is 1: of two ways to lose the target the nearer one is better."""

PAST_THE_END = 0.15
"""Loss of the view, 0.4 of the half view off; half the distance of the plan's nodes makes 0.06."""


class Pointing:
    """Keeps the gaze on a bearing.

    Parameters
    ----------
    gimbal : Gimbal
    speeds : JointSpeeds
        The servos'.
    half_view : float
        Angle from the axis at which a target leaves the view, radians.
    """

    def __init__(self, gimbal: Gimbal, speeds: JointSpeeds, half_view: float):
        self._gimbal, self._half_view = gimbal, half_view
        self._pan_limits, tilt_limits = gimbal.limits(0), gimbal.limits(1)
        self._elevations = (2 * tilt_limits[0], 2 * tilt_limits[1])
        self._nodes = np.linspace(*self._pan_limits, PAN_NODES)
        self._speeds = speeds
        self._most = NODES_PER_STEP * float(self._nodes[1] - self._nodes[0])
        self._times_s = self._most / speeds.pan * np.arange(1, STEPS + 1)

    def command(
        self, bearing: Bearing, ahead_s: float, q: FloatArray, *, seen: bool = True, left: bool = False
    ) -> FloatArray:
        """Joint values to ask for, shape (2,), radians.

        Parameters
        ----------
        bearing : Bearing
            Of the target now.
        ahead_s : float
            When the gaze is to be on it. Pointing at where the target will be is the feed-forward of its rate.
        q : array, shape (2,)
            Joint values now.
        seen : bool
            Whether the target is in the last image.
        left : bool
            Whether one that is not had gone past the joints' end (`past_the_end`): then it may be met on another way.
        """
        pan_now, tilt_now = self._gimbal.angles(q)
        pan_now = min(max(pan_now, self._pan_limits[0]), self._pan_limits[1])
        there = self._gimbal.in_gimbal(bearing.after(ahead_s).direction)
        level = (float(there[0]), float(there[1]))
        if seen:
            later = self._gimbal.in_gimbal(bearing.directions_after(self._times_s.tolist()))
            pan = self._kept_in_view(self._pan(level, later, pan_now), level, later[0], pan_now)
        else:
            near = min(self._exact_pans(level, pan_now), key=lambda exact: abs(exact - pan_now))
            pan = self._met_again(bearing, ahead_s, (pan_now, tilt_now), near) if left else near
        # Tilt follows from the pan that will be reached, which may still be on its way.
        most = self._speeds.pan * ahead_s
        reached = min(max(pan, pan_now - most), pan_now + most)
        if not seen and reached != pan and self._losses(there[np.newaxis], np.array([reached]))[0, 0] >= 1:
            # Nothing is to be seen on the way, and both servos arrive sooner when both go there at once.
            arrival = self._arrivals(bearing, ahead_s, (pan_now, tilt_now), np.array([pan]))
            there, reached = self._gimbal.in_gimbal(bearing.directions_after(arrival.tolist()))[0], pan
        return self._gimbal.joint_values(pan, float(self._tilts(there[np.newaxis], np.array([reached]))[0]))

    def beyond_reach(self, direction: FloatArray) -> bool:
        """Whether no gaze within the limits has a direction, a unit vector of the body frame, in its view."""
        return bool(self._losses(self._gimbal.in_gimbal(direction)[np.newaxis], self._nodes).min() >= 1)

    def past_the_end(self, direction: FloatArray) -> bool:
        """Whether the nearest gaze within the limits leaves a direction, a unit vector, well off the view's middle."""
        return bool(self._losses(self._gimbal.in_gimbal(direction)[np.newaxis], self._nodes).min() > PAST_THE_END)

    def _pan(self, level: tuple[float, float], later: FloatArray, pan_now: float) -> float:
        """Pan angle to ask for, radians."""
        losses = self._losses(later, self._nodes)
        least = losses[-1]
        for loss in losses[-2::-1]:
            least = loss + cv2.erode(least, IN_REACH).ravel()
        in_reach = np.abs(self._nodes - pan_now) <= self._most
        best = int(np.argmin(np.where(in_reach, least, np.inf)))
        soon_pans = self._exact_pans((later[0, 0], later[0, 1]), pan_now)
        for exact in self._exact_pans(level, pan_now):
            soon = min((abs(pan - exact), pan) for pan in soon_pans)[1]
            reachable = max(abs(exact - pan_now), abs(soon - pan_now)) <= self._most
            if reachable and np.interp(soon, self._nodes, least) <= least[best] + MARGIN:
                return exact
        return float(self._nodes[best])

    def _kept_in_view(self, pan: float, level: tuple[float, float], soon: FloatArray, pan_now: float) -> float:
        """Pan angle to ask for of a target in view: not one that takes it out of view while another keeps it."""
        near = min(self._exact_pans(level, pan_now), key=lambda exact: abs(exact - pan_now))
        reached = [pan_now + min(max(each - pan_now, -self._most), self._most) for each in (pan, near)]
        loss, kept = self._losses(soon[np.newaxis], np.array(reached))[0]
        return near if kept < 1 <= loss else pan

    def _met_again(self, bearing: Bearing, ahead_s: float, now: tuple[float, float], near: float) -> float:
        """Pan angle to ask for while the target is not seen: the nearest one, or where it will come in view.

        `now` are pan and tilt.
        """
        pans = np.append(self._nodes, near)
        arrivals_s = self._arrivals(bearing, ahead_s, now, pans)
        later = self._gimbal.in_gimbal(bearing.directions_after(arrivals_s.tolist()))
        met = np.minimum(self._losses(later, pans).diagonal(), 1.0)
        best = int(np.argmin(met))
        waiting = self._losses(later[best : best + 1], pans[-1:])[0, 0]
        return float(pans[best]) if met[best] < min(met[-1], waiting, 1.0) - MARGIN else near

    def _arrivals(self, bearing: Bearing, ahead_s: float, now: tuple[float, float], pans: FloatArray) -> FloatArray:
        """Times at which both servos can have the gaze on a bearing from pan angles, shape (n,), seconds.

        Tilt has to go where the target will be then: by the time at which pan is there, to begin with.
        """
        pan_s = np.maximum(np.abs(pans - now[0]) / self._speeds.pan, ahead_s)
        then = self._gimbal.in_gimbal(bearing.directions_after(pan_s.tolist()))
        return np.maximum(pan_s, np.abs(self._tilts(then, pans) - now[1]) / self._speeds.tilt)

    def _tilts(self, directions: FloatArray, pans: FloatArray) -> FloatArray:
        """Tilts within the limits, shape (n,), nearest to directions in the gimbal's frame, (n, 3), from n pans."""
        elevations = np.arctan2(directions[:, 2], directions[:, 0] * np.cos(pans) + directions[:, 1] * np.sin(pans))
        middle = (self._elevations[0] + self._elevations[1]) / 2
        return np.array([_within(each, self._elevations, middle) / 2 for each in elevations.tolist()])

    def _losses(self, directions: FloatArray, pans: FloatArray) -> FloatArray:
        """What is lost of the view, shape (n, m), for directions in the gimbal's frame, shape (n, 3), and m pans.

        The square of the angle from the direction to the nearest gaze, 1 at the view's edge and hardly more beyond.
        """
        lost = (self._gimbal.off_gaze(directions, pans) / self._half_view) ** 2
        return np.asarray(np.minimum(lost, 1 + OUT_OF_VIEW_SLOPE * lost))

    def _exact_pans(self, level: tuple[float, float], near: float) -> tuple[float, float]:
        """Pan angles within the limits that look along a direction, over the front and over the zenith."""
        x, y = level
        if math.hypot(x, y) < NO_AZIMUTH:
            return near, near
        azimuth = math.atan2(y, x)
        return _within(azimuth, self._pan_limits, near), _within(azimuth + math.pi, self._pan_limits, near)


def _within(angle: float, limits: tuple[float, float], near: float) -> float:
    """The whole turns away from `angle` that lies between limits and nearest to `near`; else the nearer limit."""
    lowest, highest = limits
    nearest = angle + TURN * round((near - angle) / TURN)
    for candidate in (nearest, nearest - TURN, nearest + TURN):
        if lowest <= candidate <= highest:
            return candidate
    beyond = [abs(math.remainder(angle - limit, TURN)) for limit in limits]
    return lowest if beyond[0] < beyond[1] else highest
