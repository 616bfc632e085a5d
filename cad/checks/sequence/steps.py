"""In which order the mount is put together, on which path each piece comes in, and whether its screws turn then.

The order is that of `docs/explanation/mount.md`: each servo after what sits on its horn, M2 after both, then onto the
hull. Small bought pieces belong to the first step at which all that they touch is there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from cad.assembly.assembly import Assembly
from cad.checks.sequence.bench import Bench, is_pressed
from cad.checks.sequence.lines import Surface, free_travel_mm
from cad.checks.sequence.removal_paths import BEYOND_MM, removal_path
from cad.checks.sequence.screw_keys import Screw, is_screw, key_blockers, screw_of
from cad.parts.bracket.bracket_joint import FRONT, REAR
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, Role
from rigs import Problem

GIMBAL = (
    ("pan_horn", "yoke"),
    ("yoke", "gimbal_base"),
    ("pan_servo", "gimbal_base"),
    ("tilt_horn", "mirror_holder"),
    ("mirror_holder", "yoke"),
    ("tilt_servo", "yoke"),
    ("gaze_mirror", "mirror_holder"),
    ("gaze_mirror_clip", "mirror_holder"),
)
"""What is put to what, in this order."""
FIXED_BRACKET = (("fold_mirror", "fold_bracket"), ("fold_mirror_clip", "fold_bracket"))
SPLIT_BRACKET = (("fold_mirror", FRONT), ("fold_mirror_clip", FRONT), (FRONT, REAR))
HINGED_BRACKET = (
    ("fold_mirror", "fold_arm"),
    ("fold_mirror_clip", "fold_arm"),
    ("stow_horn", "fold_arm"),
    ("fold_arm", "fold_bracket"),
    ("stow_servo", "fold_bracket"),
)
VERBS = {Role.SERVO: "Fit", Role.MIRROR: "Slide"}


@dataclass(frozen=True, kw_only=True)
class Move:
    """Pieces that come in together, and their path.

    Attributes
    ----------
    names : tuple of str
    path_m : array, shape (k, 3)
        Corners of the removal path from their place outwards, as shifts; body frame. They are shown at the last.
    """

    names: tuple[str, ...]
    path_m: FloatArray

    @property
    def shift_m(self) -> FloatArray:
        """From their place to where they are shown, shape (3,)."""
        return np.asarray(self.path_m[-1])


@dataclass(frozen=True, kw_only=True)
class Drive:
    """A screw that is driven, and what is in the way of the long and of the short arm of its key, if anything is."""

    screw: Screw
    hit: dict[str, str]

    @property
    def problem(self) -> Problem | None:
        """That neither end of the key gets to the screw."""
        if len(self.hit) < 2:
            return None
        words = ", ".join(f"{end} of its key hits {others}" for end, others in self.hit.items())
        return Problem(place=self.screw.name, value=words, expected="access for a hexagon key to the screw's head")


@dataclass(frozen=True, kw_only=True)
class Step:
    """One step of the assembly.

    Attributes
    ----------
    title : str
        What to do, as a sentence.
    part : str
        What is brought, or what small pieces are pressed into.
    present : tuple of str
        Parts that are there already, as far as this step needs them.
    moves : tuple of Move
        What is added.
    driven : tuple of Drive
        Screws that are driven.
    blocked : tuple of Problem
        Pieces that have no removal path.
    """

    title: str
    part: str
    present: tuple[str, ...]
    moves: tuple[Move, ...]
    driven: tuple[Drive, ...]
    blocked: tuple[Problem, ...]

    @property
    def problems(self) -> list[Problem]:
        """Pieces that have no removal path, and screws that no key gets to."""
        return [*self.blocked, *(drive.problem for drive in self.driven if drive.problem is not None)]

    @property
    def added(self) -> tuple[str, ...]:
        """Names of all parts that come in."""
        return tuple(name for move in self.moves for name in move.names)


def assembly_steps(assembly: Assembly) -> list[Step]:
    """Steps that put every part of a mount in its place, each part once; the hull is there from the beginning.

    A piece without a removal path, or a screw that no key gets to, is among the problems of its step.
    """
    bench = Bench.of(assembly)
    hull = next(part.name for part in assembly.parts if part.role is Role.HULL)
    steps = list(chain.from_iterable(_press(bench, part.name) for part in assembly.parts if part.printed))
    for name, host in (*_bracket(assembly), *GIMBAL):
        if name in bench.parts:
            steps.append(_put(bench, name, host))
    for cluster in [cluster for cluster in bench.clusters if hull not in cluster]:
        name = next(name for name in bench.parts if name in cluster and bench.parts[name].printed)
        steps.append(_put(bench, name, hull))
    return steps


def _bracket(assembly: Assembly) -> tuple[tuple[str, str], ...]:
    """What is put to what of all that holds M1."""
    if assembly.stow is not None:
        return HINGED_BRACKET
    return SPLIT_BRACKET if any(part.name == FRONT for part in assembly.parts) else FIXED_BRACKET


def _press(bench: Bench, host: str) -> Iterator[Step]:
    """Inserts and bushings that go into a printed part."""
    names = [name for name in bench.held_by({host}) if is_pressed(bench.parts[name])]
    if names:
        pieces = _Pieces(bench, {host})
        pieces.add(names, bench.cluster_of(host), {})
        yield pieces.step(f"Press into the {_words(host)}: {_listed(bench, names)}", host, (host,))


def _put(bench: Bench, name: str, host: str) -> Step:
    """Bring a part, and what is in one piece with it, to another; then the small pieces that hold it."""
    moving, still = set(bench.cluster_of(name)), set(bench.cluster_of(host))
    pieces = _Pieces(bench, still)
    carried = pieces.bring(name, moving)
    joined = bench.join(name, host)
    small = bench.held_by(joined)
    if bench.parts[host].role is Role.HULL:
        title = _onto_hull(bench, name, moving, small)
    else:
        verb = VERBS.get(bench.parts[name].role, "Join")
        title = f"{verb} the {_words(name)} {'into' if verb == 'Slide' else 'to'} the {_words(host)}"
        if verb == "Slide" and f"{name}_clip" not in bench.parts:
            title += ", onto silicone"
    pieces.add(small, joined, carried)
    extra = f", with {_listed(bench, small)}" if small else ""
    return pieces.step(f"{title}{extra}", name, bench.ordered(still))


def _onto_hull(bench: Bench, name: str, moving: set[str], small: Sequence[str]) -> str:
    """What is done with a part at the hull; bands that go around both ends hold the first one too, a step later."""
    bands = [piece for piece in small or bench.loose if bench.parts[piece].wraps]
    around = {part for band in bands for part in bench.loose[band] if bench.parts[part].printed}
    if not small and around & moving:
        return f"Hold the {_words(name)} to the hull, for the bands of a later step"
    others = [f" and the {_words(part)}" for part in bench.ordered(around - moving)]
    return f"Fasten the {_words(name)}{''.join(others)} to the hull"


class _Pieces:
    """What comes in at one step, one after the other."""

    def __init__(self, bench: Bench, present: set[str]) -> None:
        self.bench, self.present = bench, set(present)
        self.moves: list[Move] = []
        self.driven: list[Drive] = []
        self.blocked: list[Problem] = []

    def step(self, title: str, part: str, present: Sequence[str]) -> Step:
        return Step(
            title=title,
            part=part,
            present=tuple(present),
            moves=tuple(self.moves),
            driven=tuple(self.driven),
            blocked=tuple(self.blocked),
        )

    def bring(self, name: str, moving: set[str]) -> dict[str, FloatArray]:
        """Bring what is in one piece with a part; its shift, by name."""
        bench, directions = self.bench, _directions(self.bench, name)
        surface, still = bench.surface(moving), bench.surface(self.present)
        # To a hull from above or below, wherever it lets it: that is where the bolts are.
        on_hull = any(bench.parts[other].role is Role.HULL for other in self.present)
        path_mm = removal_path(surface, still, directions, shortest=not on_hull)
        if path_mm is None:
            path_mm = np.array([BEYOND_MM * directions[0]])
            self._no_path(name, surface, directions)
        self.moves.append(Move(names=bench.ordered(moving), path_m=path_mm / 1000))
        self.present |= moving
        return dict.fromkeys(moving, path_mm[-1])

    def add(self, names: Sequence[str], cluster: set[str], carried: dict[str, FloatArray]) -> None:
        """Bring small pieces to a cluster along the axes that they are driven in by, in their order."""
        for name in names:
            needs = self.bench.loose.pop(name)
            if self.bench.parts[name].wraps:
                self.moves.append(Move(names=(name,), path_m=np.zeros((1, 3))))
                self.present.add(name)
                continue
            axis, surface = self.bench.axis_of(name), self.bench.surfaces[name]
            path_mm = removal_path(
                surface, self.bench.surface(self.present), [axis], then=_directions(self.bench, name)
            )
            if path_mm is None:
                self._no_path(name, surface, [axis])
            if is_screw(self.bench.parts[name]):
                self._drive(name)
            if path_mm is None or len(path_mm) == 1:
                path_mm = (float(np.ptp(surface.vertices_mm @ axis)) + BEYOND_MM) * axis[np.newaxis]
            # What sits in a piece that has been drawn out, or goes in through it, is shown with it, and then further.
            along = [carried[other] for other in sorted(needs) if other in carried]
            if along and (needs <= carried.keys() or along[0] @ axis > 0.5 * np.linalg.norm(along[0])):
                path_mm = path_mm + along[0]
            self.moves.append(Move(names=(name,), path_m=path_mm / 1000))
            self.present.add(name)
        cluster.update(names)

    def _drive(self, name: str) -> None:
        bench, part = self.bench, self.bench.parts[name]
        pose = bench.assembly.pose(part, 0.0, 0.0).as_matrix()
        bodies = {other: bench.bodies[other] for other in self.present}
        screw = screw_of(part)
        self.driven.append(Drive(screw=screw, hit=key_blockers(screw, pose, bodies)))

    def _no_path(self, name: str, surface: Surface, directions: Sequence[FloatArray]) -> None:
        """Say what is hit first along each direction."""
        first = set()
        for direction in directions:
            free = {
                n: free_travel_mm(surface, self.bench.surfaces[n], direction) for n in self.bench.ordered(self.present)
            }
            first.add(min(free, key=lambda n: free[n]))
        hit = ", ".join(self.bench.ordered(first))
        self.blocked.append(
            Problem(
                place=name,
                value=f"hits {hit} in every direction",
                expected="a removal path of one or two straight moves",
            )
        )


def _directions(bench: Bench, name: str) -> list[FloatArray]:
    """Axes to try, z first: those of the part's frame, of the mount for what is fixed, of M1 for the fold mirror."""
    part, assembly = bench.parts[name], bench.assembly
    frame = assembly.layout.body_from_mount if part.group is Group.FIXED else assembly.pose(part, 0.0, 0.0)
    if name.startswith("fold_mirror") and part.group is Group.FIXED:
        frame = assembly.layout.body_from_m1
    axes = frame.rotation.as_matrix().T[[2, 1, 0]]
    return [np.asarray(sign * axis) for axis in axes for sign in (1.0, -1.0)]


def _words(name: str) -> str:
    return name.replace("_", " ")


def _listed(bench: Bench, names: Sequence[str]) -> str:
    counts = Counter(bench.parts[name].catalogue for name in names)
    return "; ".join(f"{count} x {catalogue}" for catalogue, count in sorted(counts.items()))
