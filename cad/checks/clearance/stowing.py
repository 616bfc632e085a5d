"""What of the camera's direct view a stowed fold mirror gives back."""

from __future__ import annotations

import numpy as np

from cad.assembly.assembly import Assembly
from cad.finding import Finding, Sense
from optics.gaze.stowed_view import direct_view_loss
from rigs import Problem

CHECK = "direct view with M1 stowed"
LARGEST_LOSS = 0.1
"""Share of the view. An arm that stays in a corner of it is a choice; one that takes more is a mistake."""
TILTS = 5
"""Steps of the tilt range, with the pan at rest, at which M2 is tried."""


def stowing_findings(assembly: Assembly) -> list[Finding]:
    """Share of the direct view that the mount takes with M1 stowed; nothing for a fold mirror that is fixed.

    M2 is at the tilt, of some, that leaves most of the view, as it would be for the camera to look past the mirrors.
    """
    if assembly.stow is None:
        return []
    meshes = assembly.stowed_meshes
    tilts = assembly.layout.tilt.values(TILTS)
    loss, q2 = min((direct_view_loss(assembly.rig, meshes, q2=float(q2)), float(q2)) for q2 in tilts)
    angle = assembly.stow.max_deg
    problem = Problem(
        place="joints.stow.max_deg",
        value=angle,
        expected=f"an angle that takes at most {LARGEST_LOSS:.0%} of the direct view, not {loss:.1%}",
    )
    return [
        Finding(
            check=CHECK,
            subject=f"M1 at {angle:g} deg",
            figure=100 * loss,
            unit="% of the view",
            limit=100 * LARGEST_LOSS,
            sense=Sense.AT_MOST,
            place=f"q1 = 0.0, q2 = {np.degrees(q2):.1f} deg",
            note="lost to mount, servos and mirrors",
            problem=problem if loss > LARGEST_LOSS else None,
        )
    ]
