"""In which order the mount is put together, and which way each piece comes from; found from the solids.

Small bought pieces belong to the first step at which all that they touch is there. A direction is one along which a
piece can be drawn out without meeting what is there already.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import manifold3d
import numpy as np
import trimesh
from build123d import Plane

from cad.assembly.assembly import Assembly, Part
from cad.export.robot.convex import closed_body
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, Role

TOUCH_M = 0.00025
"""Pieces this near to each other touch: a designed fit is 0.2 mm."""
NEAR_M = 0.005
"""Parts further apart than this have nothing to do with each other."""
SWEEP_STEPS = 8
NEW_OVERLAP_M3 = 20e-9
"""What rounding of curved fits may add to an intersection while a piece is drawn out of its seat."""
PRESSED = ("insert", "bush")
"""Words in the catalogue name of what is pressed into a printed part before anything else."""
BEYOND_M = 0.02
"""How far a piece is drawn beyond what it comes out of."""
FURTHEST_M = 0.16


@dataclass(frozen=True, kw_only=True)
class Move:
    """Pieces that come in together, and where they come from.

    Attributes
    ----------
    names : tuple of str
    shift_m : array, shape (3,)
        From their place to where they are shown; body frame.
    """

    names: tuple[str, ...]
    shift_m: FloatArray


@dataclass(frozen=True, kw_only=True)
class Step:
    """One step of the assembly.

    Attributes
    ----------
    title : str
        What to do, as a sentence.
    present : tuple of str
        Parts that are there already, as far as this step needs them.
    moves : tuple of Move
        What is added.
    """

    title: str
    present: tuple[str, ...]
    moves: tuple[Move, ...]

    @property
    def added(self) -> tuple[str, ...]:
        """Names of all parts that come in."""
        return tuple(name for move in self.moves for name in move.names)


@dataclass
class _Bench:
    """What has been put together so far."""

    assembly: Assembly
    parts: dict[str, Part]
    bodies: dict[str, manifold3d.Manifold]
    clusters: list[set[str]]
    loose: dict[str, set[str]] = field(default_factory=dict)
    """Small pieces that are not used yet, and the other parts that each needs."""

    def cluster_of(self, name: str) -> set[str]:
        return next(cluster for cluster in self.clusters if name in cluster)


def assembly_steps(assembly: Assembly) -> list[Step]:
    """Steps that put every part of a mount in its place, each part once; the hull is there from the beginning."""
    bench = _bench(assembly)
    printed = [part.name for part in assembly.parts if part.printed]
    steps = [step for name in printed for step in _press(bench, name)]
    for part in assembly.parts:
        if part.role in {Role.SERVO, Role.MIRROR}:
            steps.append(_fit(bench, part.name, _nearest_host(bench, part)))
    swinging = [name for name in printed if bench.parts[name].stows]
    turning = [name for group in (Group.TILT, Group.PAN) for name in printed if bench.parts[name].group is group]
    steps += [_join(bench, name) for name in [*swinging, *turning]]
    hull = next(part.name for part in assembly.parts if part.role is Role.HULL)
    steps += [_bolt(bench, cluster, hull) for cluster in [c for c in bench.clusters if hull not in c]]
    return steps


def _bench(assembly: Assembly) -> _Bench:
    parts = {part.name: part for part in assembly.parts}
    bodies = {
        name: closed_body(part.mesh).transform(assembly.pose(part, 0.0, 0.0).as_matrix()[:3])
        for name, part in parts.items()
    }
    clusters = [{name} for name, part in parts.items() if part.printed or part.role is Role.HULL]
    bench = _Bench(assembly=assembly, parts=parts, bodies=bodies, clusters=clusters)
    bench.loose = _loose(parts, bodies)
    return bench


def _loose(parts: dict[str, Part], bodies: dict[str, manifold3d.Manifold]) -> dict[str, set[str]]:
    """Small pieces, each with the parts that must be there before it can go in.

    Those are the parts it touches; where small pieces make a stack (screw, washer, sleeve), those of the whole stack.
    An insert or a bush counts for the part it is pressed into.
    """
    small = [name for name, part in parts.items() if _small(part)]
    large = [name for name in parts if name not in small]
    touched = {name: {other for other in large if _touch(bodies[name], bodies[other])} for name in small}
    for name in filter(lambda name: _pressed(parts[name]), small):
        touched[name] = {_pressed_into(name, parts, bodies)}
    driven = [name for name in small if not _pressed(parts[name])]
    needed: dict[str, set[str]] = {}
    for stack in _stacks(driven, bodies):
        beside = [
            name for name in small if _pressed(parts[name]) and any(_touch(bodies[name], bodies[n]) for n in stack)
        ]
        needs = set[str]().union(*(touched[name] for name in [*stack, *beside]))
        needed |= dict.fromkeys(stack, needs)
    return {name: needed.get(name, touched[name]) for name in small}


def _pressed_into(name: str, parts: dict[str, Part], bodies: dict[str, manifold3d.Manifold]) -> str:
    """Printed part of the same group that an insert or bush is nearest to: some holes are drawn with play."""
    hosts = [other for other, part in parts.items() if part.printed and part.group is parts[name].group]
    near = [other for other in hosts if _boxes_meet(bodies[name], bodies[other], NEAR_M)]
    return min(near or hosts, key=lambda other: float(bodies[name].min_gap(bodies[other], NEAR_M)))


def _stacks(names: Sequence[str], bodies: dict[str, manifold3d.Manifold]) -> list[list[str]]:
    """Small pieces that touch each other, directly or through others."""
    stacks: list[list[str]] = []
    for name in names:
        meets = [stack for stack in stacks if any(_touch(bodies[name], bodies[other]) for other in stack)]
        stacks = [stack for stack in stacks if stack not in meets]
        stacks.append([other for stack in meets for other in stack] + [name])
    return stacks


def _pressed(part: Part) -> bool:
    return any(word in part.catalogue.lower() for word in PRESSED)


def _small(part: Part) -> bool:
    return not part.printed and part.role not in {Role.HULL, Role.SERVO, Role.MIRROR}


def _touch(first: manifold3d.Manifold, second: manifold3d.Manifold) -> bool:
    return _boxes_meet(first, second, TOUCH_M) and bool(first.min_gap(second, TOUCH_M) < TOUCH_M)


def _box(body: manifold3d.Manifold) -> tuple[FloatArray, FloatArray]:
    bounds = np.array(body.bounding_box())
    return bounds[:3], bounds[3:]


def _press(bench: _Bench, host: str) -> list[Step]:
    """Inserts and bushes that touch only this printed part."""
    names = [
        name
        for name, touched in bench.loose.items()
        if _pressed(bench.parts[name]) and bench.parts[name].group is bench.parts[host].group and host in touched
    ]
    if not names:
        return []
    moves = _outwards(bench, names, {host})
    bench.cluster_of(host).update(names)
    return [Step(title=f"Press into the {_words(host)}: {_listed(bench, names)}", present=(host,), moves=moves)]


def _nearest_host(bench: _Bench, part: Part) -> str:
    """Printed part of the same group that a servo or mirror is nearest to."""
    hosts = [name for name, other in bench.parts.items() if other.printed and other.group is part.group]
    hosts = hosts or [name for name, other in bench.parts.items() if other.printed]
    return min(hosts, key=lambda name: _gap(bench, [part.name], [name]))


def _fit(bench: _Bench, name: str, host: str) -> Step:
    cluster = bench.cluster_of(host)
    present = tuple(sorted(cluster))
    moves = _bring(bench, {name}, cluster)
    cluster.add(name)
    small = _now_held(bench, cluster)
    moves = (*moves, *_outwards(bench, small, cluster, after=moves))
    cluster.update(small)
    return Step(
        title=f"Fit the {_words(name)} to the {_words(host)}{_with(bench, small)}", present=present, moves=moves
    )


def _join(bench: _Bench, name: str) -> Step:
    """Bring what turns to what carries it: the nearest of the other clusters, the hull apart."""
    inner = bench.cluster_of(name)
    others = [c for c in bench.clusters if c is not inner and not any(_is_hull(bench, n) for n in c)]
    group = Group.PAN if bench.parts[name].group is Group.TILT else Group.FIXED
    others = [c for c in others if any(bench.parts[n].group is group for n in c)]
    outer = min(others, key=lambda cluster: _gap(bench, inner, cluster))
    host = next(n for n in bench.parts if n in outer and bench.parts[n].printed)
    present = tuple(sorted(outer))
    moves = _bring(bench, inner, outer)
    outer |= inner
    bench.clusters.remove(inner)
    small = _now_held(bench, outer)
    moves = (*moves, *_outwards(bench, small, outer, after=moves))
    outer.update(small)
    return Step(
        title=f"Join the {_words(name)} to the {_words(host)}{_with(bench, small)}", present=present, moves=moves
    )


def _bolt(bench: _Bench, cluster: set[str], hull: str) -> Step:
    """Bring a finished cluster to the hull, with all that is left over and touches it."""
    name = next(n for n in bench.parts if n in cluster and bench.parts[n].printed)
    base = bench.cluster_of(hull)
    present = tuple(sorted(base))
    # From above or below, wherever the hull lets it.
    moves = _bring(bench, cluster, {hull}, shortest_first=False)
    base |= cluster
    bench.clusters.remove(cluster)
    last = len(bench.clusters) == 1
    small = sorted(bench.loose) if last else _now_held(bench, base)
    moves = (*moves, *_outwards(bench, small, base, after=moves))
    base.update(small)
    return Step(title=f"Fasten the {_words(name)} to the hull{_with(bench, small)}", present=present, moves=moves)


def _is_hull(bench: _Bench, name: str) -> bool:
    return bench.parts[name].role is Role.HULL


def _gap(bench: _Bench, first: Iterable[str], second: Iterable[str]) -> float:
    """Smallest gap between parts of two sets, metres, as far as it is below `NEAR_M`."""
    pairs = [(bench.bodies[a], bench.bodies[b]) for a in first for b in second]
    return min((float(a.min_gap(b, NEAR_M)) for a, b in pairs if _boxes_meet(a, b, NEAR_M)), default=NEAR_M)


def _now_held(bench: _Bench, cluster: set[str]) -> list[str]:
    """Loose pieces all of whose neighbours are in a cluster."""
    return [name for name, touched in bench.loose.items() if touched and touched <= cluster]


def _bring(bench: _Bench, names: set[str], present: set[str], *, shortest_first: bool = True) -> tuple[Move, ...]:
    """Move of parts from where they can be seen to their place, along a direction that is free."""
    moving = [bench.bodies[name] for name in sorted(names)]
    still = [bench.bodies[name] for name in sorted(present)]
    before = _shared(moving, still)
    best = (np.inf, np.zeros(3))
    ways = [(min(_way_out(moving, still, direction), FURTHEST_M), direction) for direction in _directions(bench, names)]
    if shortest_first:
        ways.sort(key=lambda way: round(way[0], 6))
    for distance, direction in ways:
        shift = direction * distance
        met = 0.0
        for share in np.linspace(0, 1, SWEEP_STEPS + 1)[1:]:
            drawn = [body.translate(tuple(shift * share)) for body in moving]
            met = max(met, _shared(drawn, still) - before)
            if met > best[0]:
                break
        if met < NEW_OVERLAP_M3:
            return (Move(names=_ordered(bench, names), shift_m=shift),)
        if met < best[0]:
            best = (met, shift)
    return (Move(names=_ordered(bench, names), shift_m=best[1]),)


def _shared(first: Sequence[manifold3d.Manifold], second: Sequence[manifold3d.Manifold]) -> float:
    """Volume that two sets of bodies share, m³; bodies whose boxes are apart cost nothing."""
    return sum((float((a ^ b).volume()) for a in first for b in second if _boxes_meet(a, b)), 0.0)


def _boxes_meet(first: manifold3d.Manifold, second: manifold3d.Manifold, margin_m: float = 0.0) -> bool:
    (low, high), (other_low, other_high) = _box(first), _box(second)
    return bool((low <= other_high + margin_m).all() and (other_low <= high + margin_m).all())


def _directions(bench: _Bench, names: set[str]) -> list[FloatArray]:
    """Axes to try: those of the frame of the first part, the vertical ones first, and of M1 for the fold mirror."""
    part = bench.parts[_ordered(bench, names)[0]]
    frames = [bench.assembly.pose(part, 0.0, 0.0)]
    if part.role is Role.MIRROR and part.group is Group.FIXED:
        frames = [bench.assembly.layout.body_from_m1]
    axes = [axis for frame in frames for axis in frame.rotation.as_matrix().T[[2, 1, 0]]]
    return [np.asarray(sign * axis) for axis in axes for sign in (1.0, -1.0)]


def _way_out(
    moving: Sequence[manifold3d.Manifold], still: Sequence[manifold3d.Manifold], direction: FloatArray
) -> float:
    """Distance along a direction after which the boxes of two bodies are apart, metres."""
    near = min(float((_corners(body) @ direction).min()) for body in moving)
    far = max(float((_corners(body) @ direction).max()) for body in still)
    return max(far - near, 0.0) + BEYOND_M


def _corners(body: manifold3d.Manifold) -> FloatArray:
    low, high = _box(body)
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _outwards(bench: _Bench, names: Sequence[str], present: set[str], after: Sequence[Move] = ()) -> tuple[Move, ...]:
    """Small pieces come along the axis they are driven in by: z of their own frame points out of the hole."""
    carried = {name: move.shift_m for move in after for name in move.names}
    moves = []
    for name in names:
        part = bench.parts[name]
        axis = np.zeros(3)
        if not isinstance(part.solid, trimesh.Trimesh):
            own = np.array(tuple(Plane(part.solid.location).z_dir))
            axis = bench.assembly.pose(part, 0.0, 0.0).rotation.apply(own)
        low, high = _box(bench.bodies[name])
        length = float(np.abs(axis) @ (high - low))
        touched = bench.loose.pop(name) & present
        along = [carried[other] for other in sorted(touched) if other in carried]
        shift = axis * (length + BEYOND_M)
        # What sits in a piece that has been drawn out, or goes in through it, is drawn out with it, and then further.
        if along and (touched <= carried.keys() or along[0] @ axis > 0.5 * np.linalg.norm(along[0])):
            shift = shift + along[0]
        moves.append(Move(names=(name,), shift_m=shift))
    return tuple(moves)


def _ordered(bench: _Bench, names: Iterable[str]) -> tuple[str, ...]:
    """Names in the order of the assembly."""
    wanted = set(names)
    return tuple(name for name in bench.parts if name in wanted)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _listed(bench: _Bench, names: Sequence[str]) -> str:
    counts = Counter(bench.parts[name].catalogue for name in names)
    return "; ".join(f"{count} x {catalogue}" for catalogue, count in sorted(counts.items()))


def _with(bench: _Bench, names: Sequence[str]) -> str:
    return f", with {_listed(bench, names)}" if names else ""
