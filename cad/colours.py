"""Colours by which parts are known in every file that has colours."""

from __future__ import annotations

from optics.mesh import Role

COLOURS = {
    "hull": (176, 180, 187),
    "mount": (232, 163, 61),
    "servo": (51, 58, 68),
    "mirror": (200, 225, 240),
    "hardware": (150, 155, 160),
}
"""Red, green and blue, 0 to 255 (sRGB), by the role of a part."""


def colour(role: Role) -> tuple[int, int, int]:
    """Red, green and blue of a role, 0 to 255."""
    return COLOURS[role.value]


def colour_fractions(role: Role) -> tuple[float, float, float]:
    """Red, green and blue of a role, 0 to 1."""
    red, green, blue = COLOURS[role.value]
    return red / 255, green / 255, blue / 255
