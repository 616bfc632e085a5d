"""The default loop with one of its parts taken away, or in the paper's place: what that part is good for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from tracking.loop.variants import VARIANTS

DEFAULT = VARIANTS["default"]

TAKEN_AWAY: dict[str, dict[str, Any]] = {
    "contrast": {"contrast": False},
    "appearance": {"appearance": False},
    "robot-mask": {"ignores_robot": False},
    "search-prior": {"likely_first": False},
    "direct-view": {"direct_view": False},
    "lost-target-search": {"rescan": "raster"},
    "exact-corners": {"corners": "interpolated"},
    # The search for a lost target begins at its direction, which the paper's follower does not know.
    "directions": {"law": "paper", "rescan": "raster"},
    "waiting": {"behaviour": replace(DEFAULT.behaviour, unseen_frames=0, wait_frames=0, earned=False)},
    "confirmation": {"behaviour": replace(DEFAULT.behaviour, confirm_frames=1, look_frames=0)},
}
"""Values of `Variant` without a part, by the part's name."""

ABLATIONS = {
    variant.name: variant
    for variant in (
        replace(DEFAULT, name=f"{DEFAULT.name}-without-{part}", **changed) for part, changed in TAKEN_AWAY.items()
    )
}
"""By name, such as "default-without-contrast"."""

LOOPS = VARIANTS | ABLATIONS
"""Every loop that a dive may name."""
