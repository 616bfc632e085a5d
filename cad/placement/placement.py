"""Placement: a hull and a camera in, a rig that builds out, with the reason for each choice.

Candidates are ranked on a grid of distances; the best are then asked of the parts themselves (does the bracket stand,
does the base, do the turning parts clear the hull), and the first that pass are built and checked as a whole.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import islice

import manifold3d
import numpy as np
import trimesh

from cad.assembly.assembly import build_assembly
from cad.checks.kept_checks import kept_checks
from cad.parts.bracket.bracket_placement import bracket_placement
from cad.parts.clearance_envelope import envelope_margins_mm
from cad.parts.flange import FLANGE_WIDTH_MM
from cad.parts.gimbal_base import base_placement, flange_seat
from cad.parts.gimbal_dimensions import GimbalDimensions
from cad.placement.candidates import Candidate, Shortfalls
from cad.placement.fold_frame import (
    BASE_ANCHOR,
    CAMERA,
    DESIGN_KEYS,
    DIRECTION,
    FOLD_ANCHOR,
    PLACED_KEYS,
    looking_ahead,
    rig_of,
)
from cad.placement.mirror_table import FIELD
from cad.placement.ranking import Ranking, manifold_of
from cad.placement.wanted import Wanted, default_request, easier
from optics.feasibility.feasibility import feasibility_problems
from optics.layout import Layout
from optics.sizing.limits import Request
from rigs import Rig

ASKED, BUILT = 40, 4
"""Candidates whose parts are asked, and mounts that are built, before giving up."""
STAGES = (
    "M1 clear",
    "M1 on",
    "M1 thicker",
    "room to turn",
    "M2 on",
    "M2 thicker",
    "a nose",
    "M1's cell",
    "M2 clear",
    "the yoke",
    "a seat for the bracket",
    "the bracket's roof",
    "a seat for the base",
    "the base's column",
)
"""How the conditions begin, in the order in which they are asked; after them come those of parts and mount."""

Log = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A rig whose camera, mirrors and anchors were found for its hull.

    Attributes
    ----------
    rig : Rig
    reasons : dict of str to str
        For each key that was decided, why it has its value.
    rejected : tuple of str
        What turned other candidates away, the most frequent first, one sentence each.
    """

    rig: Rig
    reasons: dict[str, str]
    rejected: tuple[str, ...]


def place(
    rig: Rig,
    hull: trimesh.Trimesh,
    *,
    pinned: Collection[str] = (),
    request: Request | None = None,
    log: Log = lambda line: None,
) -> Placement:
    """Place camera, mirrors and anchors on a rig's hull.

    Parameters
    ----------
    rig : Rig
        With mirrors: its camera, port, joints, servos and mount are kept, `PLACED_KEYS` are chosen again.
    hull : Trimesh
        Closed surface of its hull, body frame, millimetres (`cad.hulls.hull.file_hull_solid`).
    pinned : collection of str
        Those of `PLACED_KEYS` that stay as the rig has them.
    request : Request, optional
        What the mirrors are sized for, azimuth and elevation as of a camera that looks along the body's x;
        `default_request` by default.
    log : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        When nothing fits; the message names the condition that binds, and what would fit.
    """
    unknown = sorted(set(pinned) - set(PLACED_KEYS))
    if unknown:
        raise ValueError(f"expected pinned keys among {', '.join(PLACED_KEYS)}, got {', '.join(unknown)}")
    wanted = Wanted(pinned=frozenset(pinned), request=request or default_request(rig))
    short = Shortfalls()
    log("placing: looking for places ...")
    ranking = Ranking(rig, hull, wanted, short)
    body, failed = manifold_of(hull), list[str]()
    for direction, candidate in islice(ranking, ASKED):
        placed = rig_of(rig, candidate, direction, pinned)
        problem, apart_mm = _refusal(placed, body), 0.0
        if not problem:
            log(f"placing: building mount {len(failed) + 1} ...")
            problem, apart_mm = _problem(placed, log), FLANGE_WIDTH_MM / 2
            if not problem:
                reasons = _reasons(candidate, direction, wanted)
                return Placement(rig=placed, reasons=reasons, rejected=_sentences(short))
            log(f"placing: turned away, {problem}")
            failed.append(problem)
        short.note(problem)
        for end in ("fold", "base"):
            if _is_of(end, problem):
                ranking.refuse(direction, getattr(candidate, end).point_mm, problem, apart_mm)
        if len(failed) == BUILT:
            break
    raise ValueError(_nothing_fits(rig, hull, wanted, short, failed=failed, log=log))


def _refusal(rig: Rig, hull: manifold3d.Manifold) -> str:
    """Why the parts themselves refuse a candidate, empty when they do not."""
    problems = feasibility_problems(rig)
    if problems:
        return str(problems[0])
    layout = Layout.from_rig(rig)
    try:
        bracket_placement(rig, layout)
        flange_seat(rig, base_placement(GimbalDimensions.from_rig(rig), layout))
    except ValueError as error:
        return str(error)
    margins = envelope_margins_mm(rig, hull)
    worst = min(margins, key=lambda name: margins[name])
    return worst if margins[worst] < 0 else ""


def _problem(rig: Rig, log: Log) -> str:
    """First problem of the mount as it is built, by every check but the slicer's; empty when there is none."""
    try:
        checks = kept_checks(build_assembly(rig), log=lambda line: log(f"placing: {line}"), until_problem=True)
    except ValueError as error:
        return str(error)
    return str(checks.problems[0]) if checks.problems else ""


def _is_of(end: str, problem: str) -> bool:
    """Whether a problem is of what stands at an anchor: then another mount on the same seat has it too."""
    names = {
        "fold": ("fold_bracket", "fold_flange", "fold_anchor"),
        "base": ("gimbal_base", "base_flange", "base_anchor"),
    }
    return any(name in problem for name in names[end])


def _reasons(candidate: Candidate, direction: str, wanted: Wanted) -> dict[str, str]:
    """Why each decided key has its value."""
    width, height = wanted.request.window.size_px
    other = "below" if direction == "down" else "above"
    reasons = {
        CAMERA: f"{candidate.site.behind_nose_mm:.0f} mm behind the hull's foremost point, the port proud of the skin",
        DIRECTION: f"M2 turns {other} the camera; the hull hides {candidate.hidden:.0%} of all directions from it",
        DESIGN_KEYS[0]: "the least cost of arms, light path and what the hull hides, M1's cell clear of port and hull",
        DESIGN_KEYS[1]: "likewise, the turning mirror clear of hull and M1",
        DESIGN_KEYS[2]: f"M1 passes {FIELD:.0%} of the image's sides; beside it the camera looks straight ahead",
        DESIGN_KEYS[3]: "likewise",
        DESIGN_KEYS[4]: f"M2 passes {width:.0f} x {height:.0f} px over the range of gazes",
        DESIGN_KEYS[5]: "likewise",
        FOLD_ANCHOR: f"the nearest seat that holds a flange: the bracket reaches {candidate.fold_arm_mm:.0f} mm",
        BASE_ANCHOR: f"the nearest seat that holds a flange: the base reaches {candidate.base_arm_mm:.0f} mm",
    }
    return {key: reason for key, reason in reasons.items() if key not in wanted.pinned}


def _sentences(short: Shortfalls) -> tuple[str, ...]:
    """What turned candidates away, the most frequent first."""
    ordered = sorted(short.found.items(), key=lambda item: -item[1][0])
    return tuple(
        f"{condition}: {count} turned away"
        + (f", the nearest lacked {_lack_text(least)}" if np.isfinite(least) else "")
        for condition, (count, least) in ordered
    )


def _nothing_fits(
    rig: Rig, hull: trimesh.Trimesh, wanted: Wanted, short: Shortfalls, *, failed: Sequence[str], log: Log
) -> str:
    """What binds, and the nearest thing that would fit; `failed` says why mounts were turned away as built."""
    if failed:
        ((binding, count),) = Counter(failed).most_common(1)
        lacking = " that were built"
    else:
        binding = max(short.found, key=lambda condition: (_stage(condition), -np.nan_to_num(short.found[condition][1])))
        count, least = short.found[binding]
        lacking = f", by {_lack_text(least)} at best" if np.isfinite(least) else ""
    found = f"expected a hull with room for a mount, found none: {binding} turned away the last {count}{lacking}"
    for words, other, changed in easier(rig, wanted):
        if _would_fit(other, hull, changed, build=bool(failed), log=log):
            return f"{found}; there is room {words}"
    view = "" if rig.camera == looking_ahead(rig).camera else ", another view (new: --look)"
    return f"{found}; try another {CAMERA} (new: --camera-mm){view} or other axes of the hull (new: --forward, --up)"


def _would_fit(rig: Rig, hull: trimesh.Trimesh, wanted: Wanted, *, build: bool, log: Log) -> bool:
    """Whether the parts let a candidate stand, and the cheapest of these passes as it is built, where that is asked."""
    body = manifold_of(hull)
    for direction, candidate in Ranking(rig, hull, wanted, Shortfalls()).found[:ASKED]:
        placed = rig_of(rig, candidate, direction, wanted.pinned)
        if not _refusal(placed, body):
            return not build or not _problem(placed, log)
    return False


def _lack_text(lack_mm: float) -> str:
    return f"{lack_mm:.0f} mm" if lack_mm >= 1 else "less than 1 mm"


def _stage(condition: str) -> int:
    """How far a candidate came that a condition turned away."""
    known = [number for number, name in enumerate(STAGES) if condition.startswith(name)]
    return known[0] if known else len(STAGES)
