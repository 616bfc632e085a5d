"""Placement: a hull and a camera in, a rig that builds out, with the reason for each choice.

Candidates are ranked on a grid of distances; the best are then asked of the parts themselves (does the bracket stand,
does the base, do the turning parts clear the hull), and the first that pass are built and checked as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from cad.assembly.assembly import build_assembly
from cad.checks.kept_checks import kept_checks
from cad.parts.bracket.bracket_placement import bracket_placement
from cad.parts.clearance_envelope import envelope_margins_mm
from cad.parts.gimbal_base import base_placement, flange_seat
from cad.parts.gimbal_dimensions import GimbalDimensions
from cad.placement.camera_sites import camera_sites, pinned_site, port_ahead_mm
from cad.placement.candidates import BASE_REACH_MM, FOLD_REACH_MM, Candidate, Shortfalls, candidates, mirror_shapes
from cad.placement.fold_frame import (
    BASE_ANCHOR,
    CAMERA,
    DESIGN_KEYS,
    DIRECTION,
    FOLD_ANCHOR,
    PLACED_KEYS,
    facing,
    looking_ahead,
    pinned_seats,
    rig_of,
    turn_of,
    turned,
    with_pinned,
)
from cad.placement.hull_field import HullField, hull_field
from cad.placement.mirror_table import D1_MM, D2_MM, FIELD, mirror_table
from cad.placement.seats import SeatFinder
from cad.placement.wanted import Wanted, default_request, easier
from optics.feasibility.feasibility import feasibility_problems
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.sizing.limits import Request
from rigs import Rig

ASKED, BUILT = 40, 4
"""Candidates whose parts are asked, and mounts that are built, before giving up."""
SIDES_MM = 330.0
"""How far beside the camera's plane the hull is looked at."""
ASLANT_DEG = 1.0
"""A view further than this from the hull's plane of symmetry does not lie in it."""
FOREMOST_MM = 1.0
"""What of a hull is this near to its foremost point in the view is foremost too, as the whole of a flat side."""
UPWARDS_MM = 30.0
"""What a fold up costs, in millimetres of arm: a vehicle is lifted, and stands in the air, by its top."""
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
    ranked = _ranked(rig, hull, wanted, short)
    body = _manifold(hull)
    built = 0
    failed: set[tuple[str, str, tuple[float, float, float]]] = set()
    for direction, candidate in ranked[:ASKED]:
        seats = {(direction, end, getattr(candidate, end).point_mm) for end in ("fold", "base")}
        if seats & failed:
            continue
        placed = rig_of(rig, candidate, direction, pinned)
        refusal = _refusal(placed, body)
        if refusal:
            short.note(refusal)
            continue
        built += 1
        log(f"placing: building mount {built} ...")
        problem = _problem(placed, log)
        if problem is None:
            reasons = _reasons(candidate, direction, wanted)
            return Placement(rig=placed, reasons=reasons, rejected=_sentences(short))
        log(f"placing: turned away, {problem}")
        short.note(problem)
        failed |= {seat for seat in seats if _is_of(seat[1], problem)}
        if built == BUILT:
            break
    raise ValueError(_nothing_fits(rig, hull, wanted, short))


def _ranked(rig: Rig, hull: trimesh.Trimesh, wanted: Wanted, short: Shortfalls) -> list[tuple[str, Candidate]]:
    """Candidates of both fold directions, the cheapest first."""
    directions = [rig.require_gaze().fold_mirror.direction] if DIRECTION in wanted.pinned else ["down", "up"]
    found = [
        (direction, candidate)
        for direction in directions
        for candidate in _of_direction(rig, hull, direction, wanted, short)
    ]
    return sorted(found, key=lambda item: round(item[1].cost_mm + (UPWARDS_MM if item[0] == "up" else 0.0), 3))


def _of_direction(
    rig: Rig, hull: trimesh.Trimesh, direction: str, wanted: Wanted, short: Shortfalls
) -> Iterator[Candidate]:
    fold_from_body, folding = turn_of(rig, direction).inv(), facing(looking_ahead(rig), direction)
    table = mirror_table(folding, wanted.request)
    for condition, missing in table.rejected.items():
        short.note(condition, missing)
    designs = with_pinned(rig, table.designs, wanted.pinned)
    if not len(designs):
        return
    shapes = mirror_shapes(folding, designs)
    vertices = fold_from_body.apply(np.asarray(hull.vertices))
    in_fold = trimesh.Trimesh(vertices, hull.faces, process=False)
    position = turned(rig.camera.position_mm, fold_from_body)
    y = position[1] if CAMERA in wanted.pinned else _plane_mm(vertices, fold_from_body)
    port = position[0] + port_ahead_mm(rig) if CAMERA in wanted.pinned else np.inf
    space = _space(in_fold, y, port)
    finder = SeatFinder(
        solid=in_fold,
        space=space,
        pinned=pinned_seats(rig, wanted.pinned, fold_from_body),
        lean_deg=float(np.degrees(np.arccos(min(abs(fold_from_body.apply([0.0, 0.0, 1.0])[2]), 1.0)))),
    )
    sites = [pinned_site(rig, position)] if CAMERA in wanted.pinned else camera_sites(rig, space, y)
    if not sites:
        short.note("a nose in the plane of symmetry for the camera's port")
    for site in sites:
        yield from candidates(site, shapes, finder, short)


def _plane_mm(vertices: FloatArray, fold_from_body: Rotation) -> float:
    """Plane of one y in which the camera goes: of symmetry, or where a hull is foremost that is looked at aslant.

    That of symmetry is y = 0 where the hull's box is about that.
    """
    if abs(fold_from_body.apply([0.0, 1.0, 0.0])[1]) < np.cos(np.radians(ASLANT_DEG)):
        foremost = vertices[:, 0] > vertices[:, 0].max() - FOREMOST_MM
        return round(float(vertices[foremost, 1].mean()), 1)
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    middle = float(low + high) / 2
    return 0.0 if abs(middle) < 0.02 * (high - low) else round(middle, 1)


def _space(hull: trimesh.Trimesh, y_mm: float, port_mm: float) -> HullField:
    """Distances around the front of a hull, as far as arms and mirrors reach.

    The camera is in the plane of `y_mm`, its port at `port_mm` along x, or wherever the hull ends.
    """
    vertices = np.asarray(hull.vertices)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    reach = max(FOLD_REACH_MM, BASE_REACH_MM)
    ahead = float(D1_MM.max()) + SIDES_MM / 2
    rear = max(low[0] - 50, min(high[0], port_mm) - reach - 50)
    return hull_field(
        _manifold(hull),
        np.array([rear, max(low[1] - 50, y_mm - SIDES_MM), low[2] - D2_MM.max() / 2]),
        np.array([high[0] + ahead, min(high[1] + 50, y_mm + SIDES_MM), high[2] + 80]),
    )


def _manifold(surface: trimesh.Trimesh) -> manifold3d.Manifold:
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(surface.vertices, dtype=np.float64),
            np.ascontiguousarray(surface.faces, dtype=np.uint64),
        )
    )


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


def _problem(rig: Rig, log: Log) -> str | None:
    """First problem of the mount as it is built, by every check but the slicer's."""
    try:
        checks = kept_checks(build_assembly(rig), log=lambda line: log(f"placing: {line}"), until_problem=True)
    except ValueError as error:
        return str(error)
    return str(checks.problems[0]) if checks.problems else None


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


def _nothing_fits(rig: Rig, hull: trimesh.Trimesh, wanted: Wanted, short: Shortfalls) -> str:
    """What binds, and the nearest thing that would fit."""
    binding = max(short.found, key=lambda condition: (_stage(condition), -np.nan_to_num(short.found[condition][1])))
    count, least = short.found[binding]
    lacking = f", by {_lack_text(least)} at best" if np.isfinite(least) else ""
    found = f"expected a hull with room for a mount, found none: {binding} turned away the last {count}{lacking}"
    for words, other, changed in easier(rig, wanted):
        ranked = _ranked(other, hull, changed, Shortfalls())
        body = _manifold(hull)
        if any(not _refusal(rig_of(other, item, way, changed.pinned), body) for way, item in ranked[:ASKED]):
            return f"{found}; there is room {words}"
    view = "" if rig.camera == looking_ahead(rig).camera else ", another view (new: --look)"
    return f"{found}; try another {CAMERA} (new: --camera-mm){view} or other axes of the hull (new: --forward, --up)"


def _lack_text(lack_mm: float) -> str:
    return f"{lack_mm:.0f} mm" if lack_mm >= 1 else "less than 1 mm"


def _stage(condition: str) -> int:
    """How far a candidate came that a condition turned away."""
    known = [number for number, name in enumerate(STAGES) if condition.startswith(name)]
    return known[0] if known else len(STAGES)
