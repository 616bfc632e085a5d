"""What happened to a ray, and what a pixel looks at: values, not exceptions."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Outcome of one ray or of one projected point."""

    OK = 0
    INVALID_INPUT = 1
    """The input was not finite."""
    OUTSIDE_CAMERA_MODEL = 2
    """The pixel or direction lies beyond what the camera model can invert or represent."""
    MISSED_PORT = 3
    """The ray leaves the camera outside the port's aperture: it sees the inside of the housing."""
    TOTAL_REFLECTION = 4
    MISSED_M1 = 5
    MISSED_M2 = 6
    BACK_OF_MIRROR = 7
    """The ray reaches a mirror from behind, or the point lies behind the last mirror."""
    BLOCKED_BY_HULL = 8
    BLOCKED_BY_MOUNT = 9
    NOT_CONVERGED = 10
    """The projection's root was not found to its tolerance."""
    OUTSIDE_IMAGE = 11
    """The point projects beyond the image's edge."""
    INSIDE_HOUSING = 12
    """The point is not in the water: it lies inside the port or behind it."""


class Region(IntEnum):
    """What a pixel looks at (figure 8 of the paper)."""

    HOUSING = 0
    """The inside of the housing: the ray misses the port."""
    DIRECT = 1
    """Straight into the water, past both mirrors."""
    FOLD = 2
    """Through the fold mirror only."""
    GAZE = 3
    """Through both mirrors: the useful view."""
