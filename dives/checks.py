"""What is wrong with a dive beyond single values: files and names that do not exist, and paths that cannot be swum."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.spatial.transform import RigidTransform

from dives.named_files import path_files
from dives.paths import begins_s, body_pose, decoy_pose, path_places, target_pose
from dives.specification import DiveSpecification
from dives.trajectories.motions import FromFile, Legs, TargetPath, TravelFromFile
from dives.trajectories.timed_paths import TimedPathError, timed_path
from optics.kernels.arrays import FloatArray
from rigs import Rig
from rigs.documents.problems import Problem
from rigs.section import Section
from scenes.sensor import checked_sensor
from scenes.stage.targets import Ball, TargetShape
from scenes.worlds.catalogue import BUILT_IN
from scenes.worlds.mesh_file import MESH_SUFFIXES
from scenes.worlds.mitsuba_file import MITSUBA_SUFFIX
from tracking.loop.ablations import LOOPS
from tracking.perception.learned import LearnedModel

STEP_M = 0.02
"""A path is looked at so often that the target moves by no more than this in between; a hull is thicker."""

LONGEST_STEP_S = 0.1
"""And never more seldom, since the robot sways as well."""

MOST_STEPS = 100_000


def dive_problems(dive: DiveSpecification) -> list[Problem]:
    """Every problem that one value alone does not show."""
    problems: list[Problem] = []
    rig = _rig(dive, problems)
    shape: TargetShape | None = None
    with collecting(problems, "target.shape", dive.target.shape):
        shape = dive.target.load_shape()
    decoys: dict[int, TargetShape] = {}
    for number, decoy in enumerate(dive.decoys):
        with collecting(problems, f"decoys[{number}].shape", decoy.shape):
            decoys[number] = decoy.load_shape()
    with collecting(problems, "world", dive.world):
        check_world(dive.world)
    if rig is not None and dive.jerlov_type is not None:
        with collecting(problems, "jerlov_type", dive.jerlov_type):
            rig.water.of_type(dive.jerlov_type)
    for key, settings in (("detector", dive.detector_settings), ("offline_detector", dive.offline_settings)):
        with collecting(problems, key, None):
            chosen = settings()
            if chosen is not None and chosen.onnx is not None:
                LearnedModel(chosen.onnx)
    if dive.variant not in LOOPS:
        problems.append(Problem(place="variant", value=dive.variant, expected=f"one of {', '.join(sorted(LOOPS))}"))
    if dive.offline_detector is not None and dive.video not in ("ffv1", "frames"):
        expected = '"ffv1" or "frames", since [offline_detector] needs every image as it was'
        problems.append(Problem(place="video", value=dive.video, expected=expected))
    if isinstance(dive.robot, Legs) and any(dive.robot.points_m[0]):
        expected = "a path that begins at the robot's start, [0, 0, 0]"
        problems.append(Problem(place="robot.points_m[0]", value=list(dive.robot.points_m[0]), expected=expected))
    unreadable = path_file_problems(dive)
    if unreadable:
        return problems + unreadable
    radii: dict[int | None, float] = {None: 0.0 if shape is None else bounding_radius_m(shape)}
    radii |= {number: bounding_radius_m(each) for number, each in decoys.items()}
    return problems + path_problems(dive, rig, radii)


def path_file_problems(dive: DiveSpecification) -> list[Problem]:
    """What is wrong with the files of paths, by line, and with when and where they begin."""
    problems = []
    for whose, file in path_files(dive).items():
        key = "robot.file" if whose == "robot" else f"{whose}.path.file"
        try:
            timed_path(file)
        except TimedPathError as error:
            problems += [
                Problem(
                    place=", ".join(part for part in (f"{key} {Path(file).name}", each.place) if part),
                    value=each.value,
                    expected=each.expected,
                )
                for each in error.problems
            ]
    if problems:
        return problems
    paths: dict[str, Section | None] = {"robot": dive.robot, "target.path": dive.target.path}
    paths |= {f"decoys[{number}].path": decoy.path for number, decoy in enumerate(dive.decoys)}
    for place, path in paths.items():
        if not isinstance(path, FromFile | TravelFromFile):
            continue
        first, last = timed_path(path.file).times_s[[0, -1]].tolist()
        if not first <= begins_s(path) < last:
            expected = f"a time of the file, from {first:g} s on and before {last:g} s"
            problems.append(Problem(place=f"{place}.start_s", value=path.start_s, expected=expected))
        if isinstance(path, FromFile) and path.frame == "map" and not isinstance(dive.robot, TravelFromFile):
            expected = '"start", since the map is the frame of the robot\'s own file, and [robot] has none'
            problems.append(Problem(place=f"{place}.frame", value=path.frame, expected=expected))
    return problems


def path_problems(dive: DiveSpecification, rig: Rig | None, radii_m: Mapping[int | None, float]) -> list[Problem]:
    """Where target, decoys or robot leave the water, and where what swims touches or enters the hull.

    Parameters
    ----------
    dive : Dive
    rig : Rig, optional
        With the hull; None when it cannot be used, and the hull is not asked for.
    radii_m : mapping of int or None to float
        Of balls that hold the target (None) or a decoy, by its number, around its origin.
    """
    times = instants(dive)
    bodies = body_pose(dive, times)
    stated = "target.path" if dive.target.path else "target.position_m"
    swimming = {
        (stated, "target"): (target_pose(dive, times).translation, radii_m[None]),
        **{
            (f"decoys[{number}]", "decoy"): (decoy_pose(dive, decoy, times).translation, radii_m.get(number, 0.0))
            for number, decoy in enumerate(dive.decoys)
        },
    }
    problems = []
    tops = {whose: places[:, 2] + radius for whose, (places, radius) in swimming.items()}
    for (place, what), top in (tops | {("robot", "robot"): bodies.translation[:, 2]}).items():
        above = np.flatnonzero(top >= 0)
        if len(above):
            expected = (
                f"a {what} below the surface; at {times[above[0]]:.2f} s it is {top[above[0]]:.2f} m above "
                f"({_while(times, above)})"
            )
            problems.append(Problem(place=place, value=None, expected=expected))
    if rig is not None and rig.gaze is not None:
        for (place, what), (places, radius) in swimming.items():
            inside = np.flatnonzero(touches_hull(rig, bodies, places, radius))
            if len(inside):
                expected = f"a {what} that keeps off the hull; it touches it or is inside {_while(times, inside)}"
                problems.append(Problem(place=place, value=None, expected=expected))
    return problems


def instants(dive: DiveSpecification) -> FloatArray:
    """Times at which paths are looked at, s: more often where what swims is fast."""
    last = (dive.frames - 1) / dive.frame_rate_hz
    speed = max(_fastest_m_per_s(dive, each.course, last) for each in (dive.target, *dive.decoys))
    step = min(LONGEST_STEP_S, STEP_M / max(speed, 1e-9))
    return np.linspace(0, last, int(np.clip(np.ceil(last / step) + 1, 2, MOST_STEPS)))


def _fastest_m_per_s(dive: DiveSpecification, path: TargetPath, last_s: float) -> float:
    if isinstance(path, Legs):
        return path.speed_m_per_s
    if isinstance(path, FromFile):
        return timed_path(path.file).fastest_m_per_s
    _, velocity = path_places(dive, path, np.linspace(0, last_s, 1000))
    return float(np.linalg.norm(velocity, axis=1).max())


def bounding_radius_m(shape: TargetShape) -> float:
    """Radius of the smallest ball about the target's origin that holds it."""
    if isinstance(shape, Ball):
        return shape.radius_m
    return float(np.linalg.norm(shape.surface.vertices_m, axis=1).max())


def touches_hull(rig: Rig, bodies: RigidTransform, target_m: FloatArray, radius_m: float) -> NDArray[np.bool_]:
    """Whether balls about places in the world, shape (n, 3), touch the hull of robots at as many poses; shape (n,)."""
    from cad.assembly.hull_surface import hull_surface  # noqa: PLC0415
    from cad.hulls.distance import nearest_points  # noqa: PLC0415  (only here, and not light)

    hull = hull_surface(rig)
    seen, vertices = bodies.inv().apply(target_m), np.asarray(hull.vertices) / 1000
    near = ((seen > vertices.min(axis=0) - radius_m) & (seen < vertices.max(axis=0) + radius_m)).all(axis=1)
    touches = np.zeros(len(seen), dtype=bool)
    if near.any():
        touches[near] = nearest_points(hull, 1000 * seen[near]).distance_mm <= 1000 * radius_m
    return touches


def _rig(dive: DiveSpecification, problems: list[Problem]) -> Rig | None:
    """Rig of the dive, when it can be dived with."""
    rig: Rig | None = None
    with collecting(problems, "rig", dive.rig):
        rig = Rig.load(dive.rig)
    if rig is None:
        return None
    if rig.gaze is None:
        problems.append(Problem(place="rig", value=dive.rig, expected="a rig with mirrors"))
        return None
    with collecting(problems, "frame_rate_hz", dive.frame_rate_hz):
        checked_sensor(dive.load_rig())
    return rig


def check_world(name: str) -> None:
    """Raise a `ValueError` for what is neither a world nor a file of one."""
    if name in BUILT_IN:
        return
    if not name.lower().endswith((*MESH_SUFFIXES, MITSUBA_SUFFIX)):
        raise ValueError(f"expected {', '.join(sorted(BUILT_IN))}, a mesh or a Mitsuba scene")
    if not Path(name).is_file():
        raise ValueError("expected a file that is there")


@contextmanager
def collecting(problems: list[Problem], place: str, value: object) -> Iterator[None]:
    """Turn what a block raises about bad input into a problem of a place."""
    try:
        yield
    except ValidationError as error:
        said = "; ".join(detail["msg"].removeprefix("Value error, expected ") for detail in error.errors())
        problems.append(Problem(place=place, value=value, expected=said))
    except (ValueError, FileNotFoundError) as error:
        said = " ".join(str(error).split())
        said = said.removeprefix(f"{place} {value!r}: ").removeprefix("expected ")
        problems.append(Problem(place=place, value=value, expected=said))


def _while(times: FloatArray, at: NDArray[np.intp]) -> str:
    first, last = times[at[0]], times[at[-1]]
    return f"at {first:.2f} s" if first == last else f"from {first:.2f} to {last:.2f} s"
