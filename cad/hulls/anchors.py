"""Where the mount is bolted to the hull: a point and the outward normal of the surface there.

A rig gives a point and, if it likes, the name of a plane of the hull or a normal. Numbers answer for the hulls we make
ourselves; a hull from a file is asked at its surface. Nothing here needs the modelling kernel, unless a STEP file is
read for the first time.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from optics.feasibility.envelope import body_width_mm, hull_half_size
from optics.feasibility.torpedo import torpedo_normal
from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors
from rigs import BoxHull, FileHull, Hull, Problem, Rig, TorpedoHull
from rigs.files import STEP_SUFFIXES

Point = tuple[float, float, float]
End = Literal["fold", "base"]
ENDS: tuple[End, End] = ("fold", "base")
LARGEST_GAP_MM = 1.0
LARGEST_ANGLE_DEG = 10.0
"""How far an anchor's normal may be from the surface's: a flange of 50 mm then stands off by 4 mm at its edge."""
DISC_MM, DISC_POINTS = 25.0, 48
"""Half a flange, and where on it the normal of a hull from a file is looked at."""
TIE_MM = 1e-6
BATCH = 100_000


@dataclass(frozen=True, kw_only=True)
class Anchor:
    """Where a flange lies on the hull.

    Attributes
    ----------
    point_mm : tuple of three floats
        Middle of the contact, on the hull's surface, body frame, millimetres.
    normal : tuple of three floats
        Outward normal of the surface there, unit length.
    """

    point_mm: Point
    normal: Point


def fold_anchor(rig: Rig) -> Anchor:
    """Where the fold bracket is bolted on; raises `ValueError` for a rig without mirrors or an unknown plane."""
    return _anchor(rig, "fold")


def base_anchor(rig: Rig) -> Anchor:
    """Where the gimbal's base is bolted on; raises `ValueError` for a rig without mirrors or an unknown plane."""
    return _anchor(rig, "base")


def hull_planes(hull: Hull) -> Mapping[str, Anchor]:
    """Planes of a hull that an anchor may name, each with a point of it.

    The sides of our own hulls are top, bottom, left and right, of a box also front and back; of a torpedo they touch
    its cylinder along a line. A file's are those that the rig declares in `[hull.planes.NAME]`; of a STEP file an
    anchor may also name a flat face.
    """
    if isinstance(hull, FileHull):
        return {name: _as_anchor(plane.point_mm, plane.normal) for name, plane in hull.planes.items()}
    _, width, height = 1000 * hull_half_size(hull)
    half = {"top": height, "left": width}
    if isinstance(hull, BoxHull):
        half |= {"left": body_width_mm(hull) / 2, "front": hull.length_mm / 2}
    axes = {"front": (1.0, 0.0, 0.0), "left": (0.0, 1.0, 0.0), "top": (0.0, 0.0, 1.0)}
    opposite = {"front": "back", "left": "right", "top": "bottom"}
    planes = {}
    for name, distance in half.items():
        for side, sign in ((name, 1.0), (opposite[name], -1.0)):
            axis = sign * np.array(axes[name])
            planes[side] = _as_anchor(distance * axis, axis)
    return planes


def anchor_problems(rig: Rig, hull: trimesh.Trimesh) -> list[Problem]:
    """Anchors that are not on the hull, or whose normal is not that of the hull.

    Parameters
    ----------
    rig : Rig
        The rig.
    hull : Trimesh
        Surface of its hull in the body frame, millimetres.
    """
    problems = []
    for end in ENDS:
        anchor = _anchor(rig, end)
        nearest, normals, gap = nearest_on_surface(hull, anchor.point_mm)
        if gap > LARGEST_GAP_MM:
            expected = f"a point on the hull; the nearest is {_coordinates(nearest)}, {gap:.1f} mm away"
            problems.append(Problem(place=f"mount.{end}_anchor_mm", value=anchor.point_mm, expected=expected))
            continue
        if isinstance(rig.require_gaze().hull, FileHull):
            # A facet of a coarse mesh is not the surface that it stands for.
            normals = np.vstack([normals, normal_around(hull, anchor)])
        cosines = normals @ np.array(anchor.normal)
        best = int(np.argmax(cosines))
        angle = float(np.degrees(np.arccos(np.clip(cosines[best], -1, 1))))
        if angle > LARGEST_ANGLE_DEG:
            expected = (
                f"a normal within {LARGEST_ANGLE_DEG:g} degrees of the hull's, which is "
                f"{_coordinates(normals[best], digits=3)} at this anchor: they are {angle:.1f} degrees apart"
            )
            problems.append(Problem(place=_place_of_normal(rig, end), value=anchor.normal, expected=expected))
    return problems


def nearest_on_surface(surface: trimesh.Trimesh, point_mm: ArrayLike) -> tuple[FloatArray, FloatArray, float]:
    """Nearest point of a surface.

    Returns
    -------
    nearest : array, shape (3,)
        Where the surface comes nearest.
    normals : array, shape (n, 3)
        Unit normals of the triangles that meet there: several on an edge.
    gap : float
        How far away it is, in the surface's unit.
    """
    point = np.asarray(point_mm, dtype=np.float64)
    batches = []
    for start in range(0, len(surface.faces), BATCH):
        triangles = np.asarray(surface.vertices)[np.asarray(surface.faces)[start : start + BATCH]]
        batches.append(trimesh.triangles.closest_point(triangles, np.broadcast_to(point, (len(triangles), 3))))
    closest = np.concatenate(batches)
    distances = np.linalg.norm(closest - point, axis=1)
    gap = float(distances.min())
    corners = np.asarray(surface.vertices)[np.asarray(surface.faces)[distances <= gap + TIE_MM]]
    across = double_area_vectors(corners)
    lengths = np.linalg.norm(across, axis=1)
    normals = across[lengths > 0] / lengths[lengths > 0, np.newaxis]
    return np.asarray(closest[int(np.argmin(distances))]), normals, gap


def normal_around(surface: trimesh.Trimesh, anchor: Anchor) -> FloatArray:
    """Mean normal of the surface under a disc as wide as a flange, unit length, shape (3,)."""
    point, z = np.array(anchor.point_mm), np.array(anchor.normal)
    x, y = np.linalg.svd(z[np.newaxis])[2][1:]
    radius = DISC_MM * np.sqrt((np.arange(DISC_POINTS) + 0.5) / DISC_POINTS)
    # The sunflower's angle spreads points evenly.
    angle = np.pi * (3 - 5**0.5) * np.arange(DISC_POINTS)
    disc = point + np.outer(radius * np.cos(angle), x) + np.outer(radius * np.sin(angle), y)
    triangles = np.asarray(surface.triangles)
    near = (triangles.min(axis=1) <= point + 2 * DISC_MM).all(axis=1)
    near &= (triangles.max(axis=1) >= point - 2 * DISC_MM).all(axis=1)
    piece = trimesh.Trimesh(np.asarray(surface.vertices), np.asarray(surface.faces)[near], process=False)
    mean = np.sum([nearest_on_surface(piece, place)[1].mean(axis=0) for place in disc], axis=0)
    return np.asarray(mean / max(np.linalg.norm(mean), 1e-12))


def _anchor(rig: Rig, end: End) -> Anchor:
    gaze = rig.require_gaze()
    point = getattr(gaze.mount, f"{end}_anchor_mm")
    name, normal = getattr(gaze.mount, f"{end}_plane"), getattr(gaze.mount, f"{end}_normal")
    if normal is not None:
        return _as_anchor(point, normal)
    planes = hull_planes(gaze.hull)
    if name is not None:
        if name not in planes and isinstance(gaze.hull, FileHull) and gaze.hull.file.suffix.lower() in STEP_SUFFIXES:
            from cad.hulls.step_file import step_planes  # noqa: PLC0415  (takes seconds to import)

            named = {face: _as_anchor(*plane) for face, plane in step_planes(gaze.hull).items()}
            planes = named | dict(planes)
        if name not in planes:
            raise ValueError(f"mount.{end}_plane = {name!r}: expected a plane of the hull{_choice(name, planes)}")
        plane = planes[name]
        return _as_anchor(np.array(point) - _height(point, plane) * np.array(plane.normal), plane.normal)
    return _as_anchor(point, _normal_at(gaze.hull, point))


def _normal_at(hull: Hull, point_mm: Point) -> ArrayLike:
    """Normal of the surface near a point: of the nearest side of box and frame, of the nearest triangle of a file."""
    if isinstance(hull, FileHull):
        from cad.hulls.hull import closed_surface, file_hull_solid  # noqa: PLC0415  (takes seconds to import)

        _, normals, _ = nearest_on_surface(closed_surface(file_hull_solid(hull)), point_mm)
        return np.asarray(normals.sum(axis=0))
    if isinstance(hull, TorpedoHull):
        return torpedo_normal(hull, np.array(point_mm) / 1000)
    planes = hull_planes(hull).values()
    return min(planes, key=lambda plane: abs(_height(point_mm, plane))).normal


def _height(point_mm: ArrayLike, plane: Anchor) -> float:
    """Height of a point above a plane."""
    return float((np.asarray(point_mm) - plane.point_mm) @ np.array(plane.normal))


def _as_anchor(point_mm: ArrayLike, normal: ArrayLike) -> Anchor:
    x, y, z = (float(value) for value in np.asarray(point_mm))
    unit = np.asarray(normal, dtype=np.float64) / np.linalg.norm(np.asarray(normal, dtype=np.float64))
    return Anchor(point_mm=(x, y, z), normal=(float(unit[0]), float(unit[1]), float(unit[2])))


def _place_of_normal(rig: Rig, end: End) -> str:
    """Key to change when a normal is wrong: the one it came from."""
    mount = rig.require_gaze().mount
    named = next((key for key in (f"{end}_plane", f"{end}_normal") if getattr(mount, key) is not None), None)
    return f"mount.{named or f'{end}_anchor_mm'}"


def _choice(name: str, planes: Mapping[str, Anchor]) -> str:
    if not planes:
        return ", but it has none; declare one as [hull.planes.NAME]"
    close = difflib.get_close_matches(name, planes, n=1)
    return f" ({', '.join(sorted(planes))})" + (f"; did you mean {close[0]!r}?" if close else "")


def _coordinates(point: ArrayLike, digits: int = 1) -> str:
    return "(" + ", ".join(f"{value:.{digits}f}" for value in np.round(np.asarray(point), digits) + 0.0) + ")"
