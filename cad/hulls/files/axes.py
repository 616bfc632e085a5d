"""Which axes of a hull's file are forward and up: as given, as its format says, or by its shape, with the reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from cad.hulls.files.found import FoundHull
from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors

AXES = tuple(f"{sign}{letter}" for letter in "xyz" for sign in "+-")
SAMPLES = 4000
MIRRORED = 0.5
"""A side is the lateral one when it is this much more alike to its mirror image than the other."""
AS_LONG = 0.95
"""Sides that differ by less than this are as long as each other."""
END = 0.1
"""Share of the length that counts as an end of it."""
FULLER = 1.25
"""How much wider an end has to be than the other, to be taken for the nose."""
CORE = 40.0
"""Percentile of the distance from the axis that is an end's width: fins and antennas lie above it."""


@dataclass(frozen=True, kw_only=True)
class HullAxes:
    """Axes of a file that are the robot's forward and up, and why.

    Attributes
    ----------
    forward, up : str
        Such as ``+x``.
    forward_because, up_because : str
        The reason.
    """

    forward: str
    up: str
    forward_because: str
    up_because: str

    @property
    def body_from_file(self) -> FloatArray:
        """Rotation from the file's axes to the body's: x forward, y left, z up, shape (3, 3)."""
        forward, up = axis_vector(self.forward), axis_vector(self.up)
        return np.array([forward, np.cross(up, forward), up])


def axis_vector(axis: str) -> FloatArray:
    """Unit vector of an axis such as ``-y``; raises `ValueError` for anything else."""
    if axis not in AXES:
        raise ValueError(f"axis {axis!r}: expected {', '.join(AXES)}")
    return np.asarray((1.0 if axis[0] == "+" else -1.0) * np.eye(3)["xyz".index(axis[1])])


def axis_problems(forward: str | None, up: str | None) -> list[str]:
    """What is wrong with axes that are given, each in a sentence."""
    wrong = [
        f"--{name} {axis}: expected {', '.join(AXES)}"
        for name, axis in (("forward", forward), ("up", up))
        if axis is not None and axis not in AXES
    ]
    if not wrong and forward is not None and up is not None and forward[1] == up[1]:
        wrong.append(f"--forward {forward} and --up {up}: expected two different axes")
    return wrong


def choose_axes(found: FoundHull, *, forward: str | None = None, up: str | None = None) -> HullAxes:
    """Forward and up of a hull's file.

    What is given counts; `axis_problems` must have nothing against it. Then what the format says, unless the vehicle
    would stand on end. Then the shape: the longest side is the length, the nose is the fuller end; of the other two
    sides the one whose mirror image is more like the shape is the width; with no difference z is up.
    """
    points = _surface_points(found)
    upward, up_because = (up, "as given") if up is not None else _said_up(found, forward)
    length, length_because = _length(found, forward, upward)
    if upward is None:
        upward, shape_because = _up_by_shape(points, length)
        up_because = f"{up_because}{shape_because}"
    elif up is None:
        up_because += _doubt_of_up(points, length, upward)
    if forward is not None:
        ahead, ahead_because = forward, "as given"
    else:
        ahead, nose_because = _nose(points, length)
        ahead_because = f"{length_because}; {nose_because}"
        if found.forward is not None and found.forward[1] == length:
            doubt = f"; the fuller end is {ahead}" if ahead != found.forward else ""
            longest, _ = _longest(found, upward)
            if longest != length:
                doubt = f"; but {longest} is the longest side: --forward +{longest} or -{longest} if that is the length"
            ahead, ahead_because = found.forward, f"by the convention of the format (REP 103){doubt}"
    return HullAxes(forward=ahead, up=upward, forward_because=ahead_because, up_because=up_because)


def _said_up(found: FoundHull, forward: str | None) -> tuple[str | None, str]:
    """Up as the format says, or nothing and what speaks against it."""
    if found.up is None or (forward is not None and forward[1] == found.up[1]):
        return None, ""
    sides = found.size
    height = sides["xyz".index(found.up[1])]
    if not found.has_frame and height * AS_LONG > np.sort(sides)[-2]:
        return None, f"the file says {found.up}, but its longest side would stand on end; "
    return found.up, "by the convention of the format (REP 103)" if found.has_frame else "the file says so"


def _length(found: FoundHull, forward: str | None, up: str | None) -> tuple[str, str]:
    """Letter of the axis along the vehicle."""
    if forward is not None:
        return forward[1], "as given"
    if found.forward is not None and (up is None or up[1] != found.forward[1]):
        return found.forward[1], "by the convention of the format (REP 103)"
    return _longest(found, up)


def _longest(found: FoundHull, up: str | None) -> tuple[str, str]:
    """Letter of the longest side across up, x before y before z where sides are as long, and that in words."""
    lengths = {letter: side for letter, side in zip("xyz", found.size, strict=True) if up is None or letter != up[1]}
    longest = max(lengths.values())
    first = next(letter for letter, side in lengths.items() if side >= AS_LONG * longest)
    alone = sum(side >= AS_LONG * longest for side in lengths.values()) == 1
    level = "" if up is None else " of the level ones"
    because = f"{first} is the longest side{level}" if alone else f"no side{level} is the longest, {first} comes first"
    return first, because


def _up_by_shape(points: FloatArray, length: str) -> tuple[str, str]:
    """Up among the two axes across the length: the one whose mirror image is less like the shape."""
    across = [letter for letter in "xyz" if letter != length]
    lateral = _lateral_by_shape(points, across)
    if lateral is not None:
        return f"+{_other(across, lateral)}", f"left and right are mirror images along {lateral}"
    upward = across[-1]
    return f"+{upward}", f"the shape does not say, {upward} by default"


def _lateral_by_shape(points: FloatArray, across: list[str]) -> str | None:
    """The one of two axes along which the shape is like its mirror image, if it is not along the other as well."""
    unlike = {letter: _unlike_its_mirror_image(points, "xyz".index(letter)) for letter in across}
    lateral = min(across, key=lambda letter: unlike[letter])
    return lateral if unlike[lateral] <= MIRRORED * unlike[_other(across, lateral)] else None


def _other(pair: list[str], one: str) -> str:
    return next(letter for letter in pair if letter != one)


def _doubt_of_up(points: FloatArray, length: str, upward: str) -> str:
    """What the shape says against the file's axis for up: programs write y up without turning what they write."""
    lateral = _lateral_by_shape(points, [letter for letter in "xyz" if letter != length])
    if lateral != upward[1]:
        return ""
    other = next(letter for letter in "xyz" if letter not in (length, lateral))
    return f"; but left and right are mirror images along {lateral}: --up +{other} if the file was not turned for it"


def _nose(points: FloatArray, length: str) -> tuple[str, str]:
    along = points[:, "xyz".index(length)]
    across = points[:, ["xyz".index(letter) for letter in "xyz" if letter != length]]
    radius = np.linalg.norm(across - np.median(across, axis=0), axis=1)
    low, high = along.min(), along.max()
    reach = END * (high - low)
    back, front = (np.percentile(radius[end], CORE) for end in (along < low + reach, along > high - reach))
    if front > FULLER * back:
        return f"+{length}", "that end is the fuller one"
    if back > FULLER * front:
        return f"-{length}", "that end is the fuller one"
    return f"+{length}", f"both ends are alike, --forward -{length} turns it"


def _unlike_its_mirror_image(points: FloatArray, axis: int) -> float:
    """Mean distance from the points' mirror images to the points, as a share of the largest side."""
    middle = (points[:, axis].min() + points[:, axis].max()) / 2
    mirrored = points.copy()
    mirrored[:, axis] = 2 * middle - mirrored[:, axis]
    distances, _ = KDTree(points).query(mirrored)
    return float(distances.mean() / np.ptp(points, axis=0).max())


def _surface_points(found: FoundHull) -> FloatArray:
    """Points spread over the surface by its area, shape (n, 3)."""
    rng = np.random.default_rng(0)
    corners = found.vertices[found.faces]
    across = double_area_vectors(corners)
    areas = np.cumsum(np.linalg.norm(across, axis=1), dtype=np.float64)
    chosen = np.searchsorted(areas, rng.random(SAMPLES) * areas[-1]).clip(0, len(areas) - 1)
    u, v = rng.random((2, SAMPLES, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    first, second, third = np.asarray(corners[chosen], dtype=np.float64).transpose(1, 0, 2)
    return np.asarray(first + u * (second - first) + v * (third - first))
