"""What a design of a search may not do, for many designs at once: each constraint by name, with the room it leaves.

These are the conditions of `optics.feasibility.feasibility` that depend on the free numbers, a little on the safe
side (M2 by the sphere it turns in, plates by their true distance and not by sampled points), so that thousands of
designs can be thrown out before anything is traced. The designs that are handed out pass
`optics.feasibility.feasibility` itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.feasibility.envelope import box_distance, hull_distance, port_distance
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.search.objectives import (
    M1_HEIGHT,
    M1_WIDTH,
    M2_HEIGHT,
    M2_WIDTH,
    PARAMETERS,
    design_of,
    outlines_of,
    rig_with,
    swept_radius_m,
)
from rigs import ParametricHull, Rig

PLATE_SAMPLES = 9
"""Points along each side of M1's faces: 10 mm apart on 80 mm, so that a corner of port or hull goes at most 0.3 mm
deeper than seen where it is rounded by 40 mm."""

BINDING_MM = 1.0
"""A constraint binds where it leaves less room than this."""

ROOM = "room to turn"
CONSTRAINTS = (
    "M1 clear of the port",
    "M1 clear of the hull",
    f"{ROOM}: M2 clear of M1",
    f"{ROOM}: M2 clear of the port",
    f"{ROOM}: M2 clear of the hull",
    "M1 on the printer bed",
    "M2 on the printer bed",
    "M1 thicker than half its side",
    "M2 thicker than half its side",
)
"""Names of the columns of `rooms_mm`."""


def rooms_mm(rig: Rig, designs: FloatArray) -> FloatArray:
    """Room that each constraint leaves, negative where it is violated.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    designs : array, shape (n, 6)

    Returns
    -------
    array, shape (n, len(CONSTRAINTS))
        Millimetres; infinite where a constraint does not exist, as a user's own hull file says nothing here.
    """
    gaze = rig.require_gaze()
    layout = Layout.from_rig(rig)
    # Orientations do not depend on the design; M1's own frame is entered through its centre.
    turn_m1 = layout.camera_from_m1.rotation
    m1_centre = designs[:, :1] * np.array([0.0, 0.0, 1e-3])
    m2_centre = m1_centre + designs[:, 1:2] * layout.fold_direction / 1000
    plate = _plate_points(rig, designs)
    on_m1 = turn_m1.apply(plate.reshape(-1, 3)).reshape(plate.shape) + m1_centre[:, np.newaxis]
    radius = swept_radius_m(rig, designs)
    half = np.stack(
        [
            designs[:, M1_WIDTH] / 2000,
            designs[:, M1_HEIGHT] / 2000,
            np.full(len(designs), gaze.fold_mirror.thickness_mm / 2000),
        ],
        axis=1,
    )
    middle = turn_m1.inv().apply(m2_centre - m1_centre) + np.array([0, 0, gaze.fold_mirror.thickness_mm / 2000])
    rooms = [
        port_distance(rig, on_m1).min(axis=1),
        _hull_distance(rig, layout, on_m1).min(axis=1),
        box_distance(middle, half) - radius,
        port_distance(rig, m2_centre) - radius,
        _hull_distance(rig, layout, m2_centre) - radius,
    ]
    bed = sorted(gaze.mount.printer_bed_mm)
    sides = [np.sort(designs[:, columns], axis=1) for columns in ([M1_WIDTH, M1_HEIGHT], [M2_WIDTH, M2_HEIGHT])]
    # A tray is thin: it may lie on any face of the printer's volume.
    beds = [np.minimum(bed[1] - side[:, 0], bed[2] - side[:, 1]) for side in sides]
    thicknesses = (gaze.fold_mirror.thickness_mm, gaze.gaze_mirror.thickness_mm)
    thin = [side[:, 0] / 2 - thickness for side, thickness in zip(sides, thicknesses, strict=True)]
    return np.stack([1000 * room for room in rooms] + beds + thin, axis=1)


def binding(rig: Rig, design: FloatArray, low: FloatArray, high: FloatArray) -> list[str]:
    """What holds a design where it is: constraints with less than `BINDING_MM` to spare, and bounds it lies on."""
    rooms = rooms_mm(rig, design[np.newaxis])[0]
    held = [name for name, room in zip(CONSTRAINTS, rooms, strict=True) if room < BINDING_MM]
    for (section, key), value, least, most in zip(PARAMETERS, design, low, high, strict=True):
        for name, bound in (("smallest", least), ("largest", most)):
            if abs(value - bound) < BINDING_MM:
                held.append(f"{name} {section}.{key}")
    return held


def bounds_around(rig: Rig, factor: float) -> tuple[FloatArray, FloatArray]:
    """Bounds of a search: the rig's own numbers divided and multiplied by a factor, shape (6,) each."""
    if not (np.isfinite(factor) and factor > 1):
        raise ValueError(f"expected a factor above 1 between the rig's numbers and their bounds, got {factor}")
    own = design_of(rig)
    return np.ceil(own / factor * 10) / 10, np.floor(own * factor * 10) / 10


def violated(rooms: FloatArray) -> NDArray[np.bool_]:
    """Which constraints are violated, shape as `rooms`; touching is allowed, to a nanometre."""
    return np.asarray(rooms < -1e-6)


def first_problem(rig: Rig, design: FloatArray) -> str:
    """First thing that `optics.feasibility.feasibility` finds wrong with a design, empty when it is in order."""
    from optics.feasibility.feasibility import feasibility_problems  # noqa: PLC0415  (it compiles kernels: only when asked)

    problems = feasibility_problems(rig_with(rig, design))
    return str(problems[0]) if problems else ""


def _hull_distance(rig: Rig, layout: Layout, points_m: FloatArray) -> FloatArray:
    """Distance of points of the camera frame from the hull; infinite from a hull file."""
    if not isinstance(rig.require_gaze().hull, ParametricHull):
        return np.full(points_m.shape[:-1], np.inf)
    in_body = layout.body_from_camera.apply(points_m.reshape(-1, 3)).reshape(points_m.shape)
    return hull_distance(rig, in_body)


def _plate_points(rig: Rig, designs: FloatArray) -> FloatArray:
    """Points on both faces of M1, its own frame, metres; shape (n, points, 3)."""
    steps = np.linspace(-0.5, 0.5, PLATE_SAMPLES)
    x, y, z = (
        grid.ravel() for grid in np.meshgrid(steps, steps, [0.0, -rig.require_gaze().fold_mirror.thickness_mm / 1000])
    )
    outline, _ = outlines_of(rig, designs[:, np.newaxis])
    points = np.empty((len(designs), len(x), 3))
    points[..., 0], points[..., 1] = outline.drawn_in(2 * outline.half_width * x, 2 * outline.half_height * y)
    points[..., 2] = z
    return points
