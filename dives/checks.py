"""What is wrong with a dive beyond single values: files and names that do not exist, and paths that cannot be swum."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.spatial.transform import RigidTransform

from dives.motions import Legs
from dives.paths import body_pose, target_places, target_pose
from dives.specification import DiveSpecification
from optics.kernels.arrays import FloatArray
from rigs import Rig
from rigs.problems import Problem
from scenes.sensor import ImageSensor
from scenes.stage.targets import Ball, TargetShape
from scenes.worlds.catalogue import BUILT_IN
from scenes.worlds.mesh_file import MESH_SUFFIXES
from scenes.worlds.mitsuba_file import MITSUBA_SUFFIX
from tracking.loop.variants import VARIANTS

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
    with _collecting(problems, "target.shape", dive.target.shape):
        shape = dive.target.load_shape()
    with _collecting(problems, "world", dive.world):
        _check_world(dive.world)
    if rig is not None and dive.jerlov_type is not None:
        with _collecting(problems, "jerlov_type", dive.jerlov_type):
            rig.water.of_type(dive.jerlov_type)
    for key, settings in (("detector", dive.detector_settings), ("offline_detector", dive.offline_settings)):
        with _collecting(problems, key, None):
            settings()
    if dive.variant not in VARIANTS:
        problems.append(Problem(place="variant", value=dive.variant, expected=f"one of {', '.join(sorted(VARIANTS))}"))
    if dive.offline_detector is not None and dive.video not in ("ffv1", "frames"):
        expected = '"ffv1" or "frames", since [offline_detector] needs every image as it was'
        problems.append(Problem(place="video", value=dive.video, expected=expected))
    if isinstance(dive.robot, Legs) and any(dive.robot.points_m[0]):
        expected = "a path that begins at the robot's start, [0, 0, 0]"
        problems.append(Problem(place="robot.points_m[0]", value=list(dive.robot.points_m[0]), expected=expected))
    problems += path_problems(dive, rig, 0.0 if shape is None else bounding_radius_m(shape))
    return problems


def path_problems(dive: DiveSpecification, rig: Rig | None, radius_m: float) -> list[Problem]:
    """Where target or robot leave the water, and where the target touches or enters the hull.

    Parameters
    ----------
    dive : Dive
    rig : Rig, optional
        With the hull; None when it cannot be used, and the hull is not asked for.
    radius_m : float
        Of a ball around the target's origin that holds it.
    """
    times = instants(dive)
    bodies = body_pose(dive, times)
    target_m = target_pose(dive, times).translation
    problems = []
    for place, what, top in (
        ("target.path", "target", target_m[:, 2] + radius_m),
        ("robot", "robot", bodies.translation[:, 2]),
    ):
        above = np.flatnonzero(top >= 0)
        if len(above):
            expected = (
                f"a {what} below the surface; at {times[above[0]]:.2f} s it is {top[above[0]]:.2f} m above "
                f"({_while(times, above)})"
            )
            problems.append(Problem(place=place, value=None, expected=expected))
    if rig is not None and rig.gaze is not None:
        inside = np.flatnonzero(_touches_hull(rig, bodies, target_m, radius_m))
        if len(inside):
            expected = f"a target that keeps off the hull; it touches it or is inside {_while(times, inside)}"
            problems.append(Problem(place="target.path", value=None, expected=expected))
    return problems


def instants(dive: DiveSpecification) -> FloatArray:
    """Times at which paths are looked at, s: more often where the target is fast."""
    last = (dive.frames - 1) / dive.frame_rate_hz
    coarse = np.linspace(0, last, 1000)
    _, velocity = target_places(dive, coarse)
    speed = float(np.linalg.norm(velocity, axis=1).max())
    if isinstance(dive.target.path, Legs):
        speed = dive.target.path.speed_m_per_s
    step = min(LONGEST_STEP_S, STEP_M / max(speed, 1e-9))
    return np.linspace(0, last, int(np.clip(np.ceil(last / step) + 1, 2, MOST_STEPS)))


def bounding_radius_m(shape: TargetShape) -> float:
    """Radius of the smallest ball about the target's origin that holds it."""
    if isinstance(shape, Ball):
        return shape.radius_m
    return float(np.linalg.norm(shape.surface.vertices_m, axis=1).max())


def _touches_hull(rig: Rig, bodies: RigidTransform, target_m: FloatArray, radius_m: float) -> NDArray[np.bool_]:
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
    with _collecting(problems, "rig", dive.rig):
        rig = Rig.load(dive.rig)
    if rig is None:
        return None
    if rig.gaze is None:
        problems.append(Problem(place="rig", value=dive.rig, expected="a rig with mirrors"))
        return None
    with _collecting(problems, "frame_rate_hz", dive.frame_rate_hz):
        ImageSensor.from_rig(dive.load_rig())
    return rig


def _check_world(name: str) -> None:
    if name in BUILT_IN:
        return
    if not name.lower().endswith((*MESH_SUFFIXES, MITSUBA_SUFFIX)):
        raise ValueError(f"expected {', '.join(sorted(BUILT_IN))}, a mesh or a Mitsuba scene")
    if not Path(name).is_file():
        raise ValueError("expected a file that is there")


@contextmanager
def _collecting(problems: list[Problem], place: str, value: object) -> Iterator[None]:
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
