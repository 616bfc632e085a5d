"""What to change so that a blind patch is seen: one number of the rig at a time, traced again.

A limit of a joint, a side of a mirror, or a distance between camera and mirrors is changed in growing steps, and the
patches' directions alone are traced again with the mirrors of the changed rig. What stands around these is moved and
stretched along (`optics.coverage.openings.moved_parts`), not designed again. A fold mirror on a hinge may swing away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from optics.coverage.blind import patch_cells
from optics.coverage.blockers import Occluders
from optics.coverage.coverage import Coverage, covered_cells, stepped_joints
from optics.coverage.openings.direct_view import seen_directly
from optics.coverage.openings.moved_parts import FOLD, moved_parts
from optics.coverage.sphere import cell_directions, cell_solid_angle_sr
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, PartMesh
from optics.occlusion import Occluder
from rigs import Rig

TURNS_DEG, LENGTHS_MM = (5.0, 10.0, 20.0, 40.0), (10.0, 20.0, 40.0)
"""Steps of a joint's limit, and of a mirror's side or an arm."""
STEP_DEG = 2.0
"""Between joint values, or as the coverage has it when that is coarser."""
OPENED = 0.5
"""Share of a patch from which on a change is said to open it; of those that do, the cheapest is chosen."""
SMALLEST_SHARE = 0.02
"""Of a patch: less is not worth a change."""
LARGEST_PATCHES = 8
PATCH_CELLS = 4
"""Smaller patches are chance, or gaps between poses."""
COARSE_NSIDE, COARSE_STEP_DEG = 32, 4.0
"""Grid on which the whole sphere is compared with and without a change."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """One number of a rig, changed.

    Attributes
    ----------
    key : str
        Of the rig file.
    before, after : float
    unit : str
        Of both: "deg" or "mm".
    rank : int
        How dear it is: 0 a hinge that is there, 1 a joint's limit, 2 a mirror's side, 3 an arm, 4 a hinge to be made.
    rig : Rig
        With the change.
    also : str
        What must give way, in words.
    """

    key: str
    before: float
    after: float
    unit: str
    rank: int
    rig: Rig
    also: str = ""

    @property
    def cost(self) -> tuple[int, float]:
        """By which changes are ordered: by their kind, then by their size."""
        return self.rank, abs(self.after - self.before)


@dataclass(frozen=True, kw_only=True)
class Opening:
    """The cheapest change that opens a blind patch.

    Attributes
    ----------
    patch : int
        Position in `blind_patches`.
    key, before, after, unit, also
        As those of `Change`; `joints.stow` is M1 swung away from before the camera.
    gained_sr : float
        Solid angle of the patch that is then seen.
    share : float
        What this is of the patch.
    net_sr : float
        What the change does to the whole sphere, on a coarser grid; swinging M1 away takes the gaze for that time.
    """

    patch: int
    key: str
    before: float
    after: float
    unit: str
    also: str
    gained_sr: float
    share: float
    net_sr: float


def blind_openings(
    rig: Rig,
    parts: Sequence[PartMesh],
    coverage: Coverage,
    *,
    possible: Callable[[Rig], bool],
    stowed: Sequence[PartMesh] | None = None,
) -> list[Opening]:
    """Find for each of the largest blind patches the cheapest change that opens it, or that opens most of it.

    Parameters
    ----------
    rig, parts
        As the coverage was computed with.
    coverage : Coverage
    possible : callable
        Whether a changed rig can be at all (`optics.feasibility.feasibility`).
    stowed : sequence of PartMesh, optional
        Parts with the fold mirror stowed, of a rig that can; else those that do not belong to it are taken.

    Returns
    -------
    list of Opening
        Those that gain most first; none for a patch that nothing opens without a loss on the whole sphere.
    """
    patches = [cells for cells in patch_cells(coverage)[:LARGEST_PATCHES] if len(cells) >= PATCH_CELLS]
    if not patches:
        return []
    cells, owner = np.concatenate(patches), np.repeat(np.arange(len(patches)), [len(patch) for patch in patches])
    step_deg = max([STEP_DEG, *(_largest_step(values) for values in (coverage.q1_deg, coverage.q2_deg))])
    around = _Surroundings(rig, parts)
    tried = [
        (change, _seen(around, change, step_deg=step_deg, nside=coverage.nside, cells=cells))
        for change in single_changes(rig)
        if possible(change.rig)
    ]
    hinge = rig.require_gaze().joints.stow
    swing = Change(key="joints.stow", before=0.0, after=90.0, unit="deg", rank=4, rig=rig)
    if hinge is not None:
        swing = replace(swing, after=hinge.max_deg, rank=0)
    rest = stowed or [part for part in parts if not part.name.startswith(FOLD)]
    tried.append((swing, seen_directly(rig, rest, cell_directions(coverage.nside)[cells])))
    compared = _WholeSphere(around)
    found = []
    for number, patch in enumerate(patches):
        best = _cheapest([(change, seen[owner == number]) for change, seen in tried], compared)
        if best is not None:
            change, seen = best
            found.append(
                Opening(
                    patch=number,
                    key=change.key,
                    before=change.before,
                    after=change.after,
                    unit=change.unit,
                    also=change.also,
                    gained_sr=float(seen.sum() * cell_solid_angle_sr(coverage.nside)),
                    share=float(seen.sum() / len(patch)),
                    net_sr=compared.net_sr(change),
                )
            )
    return sorted(found, key=lambda opening: -opening.gained_sr)


def single_changes(rig: Rig) -> Iterator[Change]:
    """All changes that are tried, of one number each."""
    gaze = rig.require_gaze()
    for name in ("pan", "tilt"):
        for end, turn in ((end, turn) for end in ("min_deg", "max_deg") for turn in TURNS_DEG):
            yield _turned(rig, name, end, turn)
    for name in ("fold_mirror", "gaze_mirror"):
        for key, rank, signs in (("width_mm", 2, (1,)), ("height_mm", 2, (1,)), ("distance_mm", 3, (-1, 1))):
            before = getattr(getattr(gaze, name), key)
            for after in (before + sign * length for length in LENGTHS_MM for sign in signs):
                if after > 0:
                    changed = rig.with_gaze(**{name: {key: after}})
                    yield Change(key=f"{name}.{key}", before=before, after=after, unit="mm", rank=rank, rig=changed)


def _turned(rig: Rig, name: str, end: str, turn_deg: float) -> Change:
    """One limit of a joint moved outwards; where the servo turns no further, the other limit follows."""
    gaze = rig.require_gaze()
    joint, travel = getattr(gaze.joints, name), getattr(gaze.servos, name).travel_deg
    limits = {"min_deg": joint.min_deg, "max_deg": joint.max_deg}
    limits[end] += turn_deg if end == "max_deg" else -turn_deg
    other = "min_deg" if end == "max_deg" else "max_deg"
    beyond = max(0.0, limits["max_deg"] - limits["min_deg"] - travel)
    limits[other] += beyond if other == "min_deg" else -beyond
    changed = gaze.joints.model_copy(update={name: joint.model_copy(update=limits)})
    return Change(
        key=f"joints.{name}.{end}",
        before=getattr(joint, end),
        after=limits[end],
        unit="deg",
        rank=1,
        rig=rig.with_gaze(joints=changed),
        also=f"{other} = {limits[other]:g}, as the servo turns {travel:g} deg" if beyond else "",
    )


class _Surroundings:
    """What blocks rays around changed rigs; of groups of parts that stay it is made once."""

    def __init__(self, rig: Rig, parts: Sequence[PartMesh]) -> None:
        self.rig, self._parts = rig, parts
        self._own = {group: Occluder.of_group(parts, group) for group in Group}

    def of(self, changed: Rig) -> Occluders:
        """Occluders of all groups beside a changed rig."""
        moved = moved_parts(self._parts, self.rig, changed)
        stay = dict.fromkeys(Group, True)
        for part, own in zip(moved, self._parts, strict=True):
            stay[part.group] &= part is own
        return {group: self._own[group] if stay[group] else Occluder.of_group(moved, group) for group in Group}


def _seen(
    around: _Surroundings, change: Change, *, step_deg: float, nside: int, cells: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which of the cells the changed rig sees; of a wider joint only what it adds is looked at."""
    q1, q2 = stepped_joints(change.rig, step_deg)
    if change.key.startswith("joints.pan"):
        q1 = _beyond(q1, change)
    elif change.key.startswith("joints.tilt"):
        q2 = _beyond(q2, change)
    return covered_cells(change.rig, around.of(change.rig), q1=q1, q2=q2, nside=nside, cells=cells)


def _beyond(values: FloatArray, change: Change) -> FloatArray:
    limit = np.radians(change.before)
    return np.asarray(values[values > limit] if change.after > change.before else values[values < limit])


Tried = tuple[Change, NDArray[np.bool_]]
"""A change, and which of the cells it opens."""


def _cheapest(tried: Sequence[Tried], compared: _WholeSphere) -> Tried | None:
    """The cheapest change that opens a patch, or that which opens most of it; what costs more elsewhere is none."""
    worth = [each for each in tried if each[1].mean() >= SMALLEST_SHARE]
    opens = sorted((each for each in worth if each[1].mean() >= OPENED), key=lambda each: each[0].cost)
    partly = sorted((each for each in worth if each[1].mean() < OPENED), key=lambda each: -each[1].mean())
    return next((each for each in (*opens, *partly) if compared.net_sr(each[0]) >= 0), None)


class _WholeSphere:
    """What changes do to the covered solid angle of the whole sphere."""

    def __init__(self, around: _Surroundings) -> None:
        self._around = around
        self._known: dict[tuple[str, float], float] = {}

    def net_sr(self, change: Change) -> float:
        """Steradians gained, less those lost; none for what no number of the rig is changed for."""
        if change.rig is self._around.rig:
            return 0.0
        return self._covered_sr(change.rig, change.key, change.after) - self._covered_sr(self._around.rig, "", 0.0)

    def _covered_sr(self, rig: Rig, key: str, value: float) -> float:
        if (key, value) not in self._known:
            q1, q2 = stepped_joints(rig, COARSE_STEP_DEG)
            seen = covered_cells(rig, self._around.of(rig), q1=q1, q2=q2, nside=COARSE_NSIDE)
            self._known[key, value] = 4 * np.pi * float(seen.mean())
        return self._known[key, value]


def _largest_step(values_deg: FloatArray) -> float:
    return float(np.diff(values_deg).max(initial=0.0))
