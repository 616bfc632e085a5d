"""Which key of the rig file to change when two parts are in each other's way."""

from __future__ import annotations

HOLDS_M1 = ("fold_", "stow_")
OF_BASE = ("gimbal_base", "base_flange_screw")


def key_to_change(first: str, second: str) -> str:
    """Key for two parts that intersect, by their names; the first part's name where no number of the rig is at fault.

    What turns with M2 is in the hull or in what holds M1: M2's distance. What holds M1 is in the hull: M1's distance.
    The base is in the hull or in the way of what turns: its anchor. The flange's screws are in the servo of the hinge:
    the flange's anchor, which goes further back.
    """
    holds_m1 = [name for name in (first, second) if name.startswith(HOLDS_M1)]
    if len(holds_m1) == 2:
        return "mount.fold_anchor_mm" if "stow_servo" in holds_m1 else first
    names = {first, second}
    if any(name.startswith(OF_BASE) for name in names):
        return "mount.base_anchor_mm"
    if holds_m1 and "hull" in names:
        return "fold_mirror.distance_mm"
    return "gaze_mirror.distance_mm" if holds_m1 or "hull" in names else first
