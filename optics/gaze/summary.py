"""One gaze in numbers that people read: degrees, millimetres, seconds."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.gaze.jacobian import NO_AZIMUTH, angle_jacobian, manipulability
from optics.gaze.kinematics import faces_light, forward_gaze, virtual_centre
from optics.gaze.motion import JointSpeeds, gaze_speed, joint_solutions, move_time, nearest_solution
from optics.layout import Layout
from rigs import Rig

REST = (0.0, 0.0)
"""Where the mirrors start: the gaze straight ahead."""


def gaze_at(rig: Rig, *, q1_deg: float, q2_deg: float, start_deg: tuple[float, float] = REST) -> dict[str, Any]:
    """Gaze of joint values within the limits, its Jacobian, and the time to get there from `start_deg`.

    `jacobian` is d(azimuth, elevation)/d(q1, q2), None where there is no azimuth; `condition` that of the direction's
    Jacobian, None where pan does not turn the gaze; `faces_light` whether M2 does not show its back.
    """
    layout, speeds = Layout.from_rig(rig), JointSpeeds.from_rig(rig)
    q = np.radians([q1_deg, q2_deg])
    layout.check_joints(*q)
    seen = forward_gaze(layout, *q)
    jacobian = angle_jacobian(layout, *q)
    turned = float(manipulability(layout, q[1]))
    return {
        "q1_deg": q1_deg,
        "q2_deg": q2_deg,
        "azimuth_deg": float(np.degrees(seen.azimuth)),
        "elevation_deg": float(np.degrees(seen.elevation)),
        "roll_deg": float(np.degrees(seen.roll)),
        "faces_light": bool(faces_light(layout, q[1])),
        "time_s": float(move_time(speeds, np.radians(start_deg), q)),
        "virtual_centre_mm": (1000 * virtual_centre(layout, *q)).tolist(),
        "gaze_speed_deg_per_s": np.degrees(gaze_speed(layout, speeds, q[1])).tolist(),
        "jacobian": [[float(value) if np.isfinite(value) else None for value in row] for row in jacobian],
        "condition": max(2, turned) / min(2, turned) if turned > NO_AZIMUTH else None,
    }


def gaze_towards(
    rig: Rig, *, azimuth_deg: float, elevation_deg: float, q1_deg: float = REST[0], q2_deg: float = REST[1]
) -> dict[str, Any]:
    """As `gaze_at`, for the joint values that look somewhere and are reached first, with `solutions`: all of them."""
    layout, speeds = Layout.from_rig(rig), JointSpeeds.from_rig(rig)
    start = np.radians([q1_deg, q2_deg])
    layout.check_joints(*start)
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    chosen = np.degrees(nearest_solution(layout, speeds, azimuth, elevation, start))
    solutions = [
        {
            "q1_deg": float(np.degrees(q[0])),
            "q2_deg": float(np.degrees(q[1])),
            "faces_light": bool(faces_light(layout, q[1])),
            "time_s": float(move_time(speeds, start, q)),
        }
        for q in joint_solutions(layout, azimuth, elevation, start)
    ]
    report = gaze_at(rig, q1_deg=float(chosen[0]), q2_deg=float(chosen[1]), start_deg=(q1_deg, q2_deg))
    return {"solutions": solutions, **report}
