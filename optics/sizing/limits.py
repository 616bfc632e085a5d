"""What keeps a request for mirrors from being met, and how much of the window or of the range would fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.feasibility.envelope import HullDistance
from optics.feasibility.feasibility import feasibility_problems
from optics.kernels.arrays import FloatArray
from optics.sizing.footprint import Extents, Footprint, centred_extents
from optics.sizing.gaze_range import GazeRange, Grid, Interval, pairs
from optics.sizing.window import Window
from optics.train import OpticalTrain, Rays
from rigs import Rig

RAYS_PER_SIDE = 24
"""Samples along each side of the window: straight sides need only their ends, refraction bends them slightly."""

ROUNDING_MM = 0.5
"""Mirrors are cut to this."""

BISECTIONS = 8
"""Halvings in search of the largest window that fits: to 1/256 of it."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """What the mirrors are wanted to pass.

    Parameters
    ----------
    window : Window
        Part of the image.
    gaze : GazeRange
    margin_m : float
        Added all around: how far the cut plate and its seat may be off, and the holder's lip.
    angle_tolerance : float
        Radians by which camera, M1 and M2 each may be turned from where they should be.
    """

    window: Window
    gaze: GazeRange
    margin_m: float = 0.002
    angle_tolerance: float = float(np.radians(0.25))

    def __post_init__(self) -> None:
        for name in ("margin_m", "angle_tolerance"):
            value = getattr(self, name)
            if not 0 <= value < np.inf:
                raise ValueError(f"expected {name} of at least 0, got {value}")


@dataclass(frozen=True, kw_only=True)
class Binding:
    """What keeps a request from being met: a constraint by name, and a sentence with numbers."""

    constraint: str
    message: str


def with_mirrors(rig: Rig, m1_m: tuple[float, float], m2_m: tuple[float, float]) -> Rig:
    """A rig with mirrors of other sizes (width, height in metres), rounded up to 0.5 mm.

    A plate's sides are kept above twice its thickness.
    """
    gaze, changes = rig.require_gaze(), {}
    for name, size in (("fold_mirror", m1_m), ("gaze_mirror", m2_m)):
        plate = getattr(gaze, name)
        # A nanometre of arithmetic does not ask for another half millimetre.
        sides = [float(np.ceil(1000 * side / ROUNDING_MM - 1e-6) * ROUNDING_MM) for side in size]
        width, height = (max(side, 2 * plate.thickness_mm + ROUNDING_MM) for side in sides)
        changes[name] = {"width_mm": width, "height_mm": height}
    return rig.with_gaze(**changes)


def larger_than_bed(rig: Rig) -> list[Binding]:
    """Mirrors whose trays the rig's printer has no room for."""
    gaze = rig.require_gaze()
    bed = sorted(gaze.mount.printer_bed_mm)
    found = []
    for name, plate in (("M1", gaze.fold_mirror), ("M2", gaze.gaze_mirror)):
        short, long = sorted((plate.width_mm, plate.height_mm))
        # A tray is thin: it may lie on any face of the printer's volume.
        if short > bed[1] or long > bed[2]:
            message = (
                f"{name} of {plate.width_mm:g} x {plate.height_mm:g} mm needs a tray larger than the "
                f"{bed[2]:g} x {bed[1]:g} mm that mount.printer_bed_mm has room for"
            )
            found.append(Binding(constraint="printer bed", message=message))
    return found


def out_of_room(rig: Rig, hull: HullDistance | None = None) -> list[Binding]:
    """What mirrors of a rig's sizes run into: port, hull, each other; `hull` as for `feasibility_problems`."""
    return [
        # What is wrong elsewhere in the file stays wrong whatever the mirrors' sizes.
        Binding(constraint="clearance" if "_mirror." in problem.place else "rig file", message=str(problem))
        for problem in feasibility_problems(rig, hull)
    ]


def out_of_reach(grid: Grid, gaze: GazeRange) -> list[Binding]:
    """How much of a range the joints reach, when it is not all of it."""
    if grid.reached.all():
        return []
    share = grid.reached.mean()
    first, second = gaze.names
    message = (
        f"the joints reach {share:.0%} of the wanted range of {first} and {second}: "
        f"look at joints.pan and joints.tilt, or ask for less"
    )
    return [Binding(constraint="joint range", message=message)]


def cut_by_port(train: OpticalTrain, window: Window, boundary: Rays) -> list[Binding]:
    """How much of a window the port lets through, when the rays of its boundary say that it is not all of it."""
    if boundary.passed.all():
        return []
    inner = train.trace(window.cells(64, 48))
    message = f"the port lets {np.mean(inner.passed):.1%} of the window through: look at port.aperture_diameter_mm"
    return [Binding(constraint="port aperture", message=message)]


def grazing(on_m1: Footprint, on_m2: Footprint, gaze: GazeRange, grid: Grid) -> list[Binding]:
    """Rays that run along a mirror or away from it: there the footprint grows without bound."""
    found = []
    if not on_m1.front.all():
        message = (
            f"{np.mean(~on_m1.front):.0%} of the window's edge never hits M1: rays more than 45 degrees from the "
            f"optical axis towards the fold run along M1 or away from it, whatever its size"
        )
        found.append(Binding(constraint="grazing incidence on M1", message=message))
    elif not on_m2.front.all():
        second = pairs(grid.first, grid.second)[1][grid.reached]
        whole = on_m2.front.all(axis=1)
        worst = np.degrees(second[~whole])
        message = (
            f"at {np.mean(~whole):.0%} of the poses ({gaze.names[1]} {worst.min():.1f} to {worst.max():.1f} deg among "
            f"them) part of the window runs along M2 or away from it, so that no size would do"
        )
        found.append(Binding(constraint="grazing incidence on M2", message=message))
    return found


def largest_window(
    rig: Rig, train: OpticalTrain, request: Request, grid: Grid, hull: HullDistance | None = None
) -> float:
    """Largest factor on the window at which everything fits, 0 when none does; found by bisection."""
    if not grid.reached.all():
        return 0.0

    def fits(factor: float) -> bool:
        rays = train.trace(request.window.scaled(factor).boundary(RAYS_PER_SIDE))
        return bool(rays.passed.all()) and _fits(rig, _centred(rig, request, rays, grid.q1, grid.q2), hull)

    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def longest_range(
    rig: Rig, request: Request, rays: Rays | None, grid: Grid, hull: HullDistance | None = None
) -> Interval | None:
    """Longest run of the grid's second values that fits with the whole window.

    A mirror is smallest where light falls on it most steeply, and grows to both sides: the values whose mirrors stay
    below some size are one run around that. The largest such size is found by bisection.
    """
    rows: NDArray[np.bool_] = np.all(grid.reached.reshape(len(grid.second), -1), axis=1)
    if rays is None or not rows.any():
        return None
    extents = [
        _centred(rig, request, rays, q1, q2) if row else None
        for row, q1, q2 in zip(rows, *(q.reshape(len(rows), -1) for q in (grid.q1, grid.q2)), strict=True)
    ]
    m2 = np.array([extent.m2_m[0] if extent else (np.inf, np.inf) for extent in extents])
    m1 = next(extent.m1_m for extent in extents if extent)
    demand = np.hypot(*m2.T)
    best = int(demand.argmin())
    levels = np.unique(demand[np.isfinite(demand)])

    def run(level: float) -> slice:
        start = stop = best
        while start > 0 and demand[start - 1] <= level:
            start -= 1
        while stop < len(demand) - 1 and demand[stop + 1] <= level:
            stop += 1
        return slice(start, stop + 1)

    low, high = -1, len(levels)
    while high - low > 1:
        middle = (low + high) // 2
        needed = Extents(m1_m=m1, m2_m=m2[run(levels[middle])].max(axis=0, keepdims=True))
        low, high = (middle, high) if _fits(rig, needed, hull) else (low, middle)
    if low < 0:
        return None
    values = grid.second[run(levels[low])]
    return float(values[0]), float(values[-1])


def _centred(rig: Rig, request: Request, rays: Rays, q1: FloatArray, q2: FloatArray) -> Extents:
    gaze = rig.require_gaze()
    return centred_extents(
        rig,
        rays,
        d1_m=np.array([gaze.fold_mirror.distance_mm / 1000]),
        d2_m=np.array([gaze.gaze_mirror.distance_mm / 1000]),
        q1=q1,
        q2=q2,
        margin_m=request.margin_m,
        angle_tolerance=request.angle_tolerance,
    )


def _fits(rig: Rig, extents: Extents, hull: HullDistance | None) -> bool:
    if not (np.isfinite(extents.m1_m).all() and np.isfinite(extents.m2_m).all()):
        return False
    (m1,), (m2,) = (2 * extents.m1_m, 2 * extents.m2_m)
    sized = with_mirrors(rig, tuple(m1), tuple(m2))
    return not (larger_than_bed(sized) or out_of_room(sized, hull))
