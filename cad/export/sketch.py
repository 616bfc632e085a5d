"""A rig beside its hull as surfaces and lines with names: what a picture draws and a GLB file holds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh

from cad.checks.standing import CAMERA_PLACES, POSES, Plate, Standing
from cad.colours import colour
from cad.export.glb import add_surface
from optics.kernels.arrays import FloatArray
from optics.mesh import Role
from rigs.atomic_files import atomic_file

Colour = tuple[int, int, int]

WRONG: Colour = (208, 28, 36)
LIGHT: Colour = (214, 137, 16)
MIRROR: Colour = (33, 118, 199)
ANCHOR: Colour = (20, 125, 92)
INK: Colour = (28, 43, 57)

ANCHOR_RADIUS_MM, NORMAL_MM, PINHOLE_RADIUS_MM = 8.0, 40.0, 4.0
RAYS_SHOWN = 8
SHOWN_POSES = frozenset(
    pan * POSES[1] + tilt for pan in (0, POSES[0] // 2, POSES[0] - 1) for tilt in (0, POSES[1] // 2, POSES[1] - 1)
)
"""Ends and middle of both joints; others are drawn only in the hull."""
AXES_SHARE = 0.2
"""Length of the body's axes, of the hull's longest side."""
TUBE_SHARE, FAINT = 1 / 900, 0.5
"""Radius of a line in a file of triangles, of the hull's longest side; what a faint line has of it."""
HULL_OPACITY = 0.6


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles in the body frame, millimetres, with a name and a colour (sRGB, 0 to 255)."""

    name: str
    mesh: trimesh.Trimesh
    colour: Colour


@dataclass(frozen=True, kw_only=True)
class Line:
    """Corners (n, 3) of a line in the body frame, millimetres, with a name and a colour (sRGB, 0 to 255)."""

    name: str
    points_mm: FloatArray
    colour: Colour
    faint: bool = False


@dataclass(frozen=True, kw_only=True)
class Sketch:
    """What is drawn of a rig: surfaces, the hull first, and lines."""

    surfaces: tuple[Surface, ...]
    lines: tuple[Line, ...]


def rig_sketch(standing: Standing) -> Sketch:
    """Surfaces and lines of a rig beside its hull; what is in the hull or in the light's way is red."""
    plates = (("fold_mirror", standing.fold_mirror), ("gaze_mirror", standing.gaze_mirror))
    pinhole = 1000 * standing.layout.body_from_camera.translation
    ball = trimesh.creation.icosphere(subdivisions=2, radius=PINHOLE_RADIUS_MM).apply_translation(pinhole)
    wrong = {place.name for place in standing.wrong}
    surfaces = [
        Surface(name="hull", mesh=standing.hull, colour=colour(Role.HULL)),
        *(Surface(name=name, mesh=_plate_mesh(plate), colour=_plate_colour(plate)) for name, plate in plates),
        Surface(name="camera", mesh=ball, colour=WRONG if wrong & CAMERA_PLACES else LIGHT),
    ]
    for end, anchor in standing.anchors.items():
        place = trimesh.geometry.align_vectors([0, 0, 1], anchor.normal)
        place[:3, 3] = anchor.point_mm
        disc = trimesh.creation.cylinder(radius=ANCHOR_RADIUS_MM, height=1.0, transform=place)
        paint = WRONG if f"{end} anchor" in wrong else ANCHOR
        surfaces.append(Surface(name=f"{end}_anchor", mesh=disc, colour=paint))
    return Sketch(surfaces=tuple(surfaces), lines=tuple(_lines(standing, pinhole, wrong)))


def write_sketch(sketch: Sketch, path: Path) -> None:
    """Write a sketch as GLB, metres, y up, -z forward; lines are thin tubes, so that every viewer shows them."""
    scene = trimesh.Scene()
    radius = TUBE_SHARE * float(sketch.surfaces[0].mesh.extents.max())
    for surface in sketch.surfaces:
        _add(scene, surface.name, surface.mesh, surface.colour, HULL_OPACITY if surface.name == "hull" else 1.0)
    for line in sketch.lines:
        _add(scene, line.name, _tube(line.points_mm, radius * (FAINT if line.faint else 1)), line.colour, 1.0)
    with atomic_file(path) as partial:
        partial.write_bytes(scene.export(file_type="glb"))


def _lines(standing: Standing, pinhole: FloatArray, wrong: set[str]) -> Iterable[Line]:
    reach = AXES_SHARE * float(standing.hull.extents.max())
    for name, axis in zip("xyz", np.eye(3), strict=True):
        yield Line(name=f"body_{name}", points_mm=np.array([np.zeros(3), reach * axis]), colour=INK)
    yield from _light(standing, pinhole)
    for name, plate in (("fold_mirror_edge", standing.fold_mirror), ("gaze_mirror_edge", standing.gaze_mirror)):
        yield Line(name=name, points_mm=_closed(plate.face_mm), colour=_plate_colour(plate))
    for number, plate in enumerate(standing.gaze_poses):
        if not plate.inside and number not in SHOWN_POSES:
            continue
        paint = WRONG if plate.inside else MIRROR
        yield Line(name=f"gaze_range_{number}", points_mm=_closed(plate.face_mm), colour=paint, faint=True)
    for end, anchor in standing.anchors.items():
        tip = np.array(anchor.point_mm) + NORMAL_MM * np.array(anchor.normal)
        paint = WRONG if f"{end} anchor" in wrong else ANCHOR
        yield Line(name=f"{end}_normal", points_mm=np.array([anchor.point_mm, tip]), colour=paint)
    for place in standing.places:
        yield Line(
            name="distance_" + place.name.replace("'s", "").replace(" ", "_"),
            points_mm=np.array([place.point_mm, place.nearest_mm]),
            colour=WRONG if place.wrong else INK,
        )


def _light(standing: Standing, pinhole: FloatArray) -> Iterable[Line]:
    """The view's edge: on the port, on M1's plane, and some of the rays between, red where the hull stops them."""
    light = standing.light
    if not len(light.rim):
        return
    for name, points in (("port_edge", light.start_mm), ("view_edge", light.end_mm)):
        yield Line(name=name, points_mm=_closed(points[light.rim]), colour=LIGHT)
    shown = light.rim[np.unique(np.linspace(0, len(light.rim), RAYS_SHOWN, endpoint=False).astype(int))]
    stopped = np.flatnonzero(light.stopped & light.folded)
    if len(stopped):
        shown = np.union1d(shown, stopped[:: max(1, len(stopped) // RAYS_SHOWN)])
    for number, ray in enumerate(shown):
        yield Line(
            name=f"ray_{number}",
            points_mm=np.array([pinhole, light.start_mm[ray], light.end_mm[ray]]),
            colour=WRONG if light.stopped[ray] else LIGHT,
        )


def _plate_colour(plate: Plate) -> Colour:
    return WRONG if plate.inside else MIRROR


def _plate_mesh(plate: Plate) -> trimesh.Trimesh:
    """A plate as a closed prism: its outline is convex."""
    count = len(plate.face_mm)
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)])
    following = np.roll(np.arange(count), -1)
    sides = [(k, k + count, following[k]) for k in range(count)]
    sides += [(following[k], k + count, following[k] + count) for k in range(count)]
    faces = np.concatenate([fan, fan[:, ::-1] + count, sides])
    return trimesh.Trimesh(np.concatenate([plate.face_mm, plate.back_mm]), faces, process=False)


def _closed(points_mm: FloatArray) -> FloatArray:
    return np.concatenate([points_mm, points_mm[:1]])


def _tube(points_mm: FloatArray, radius_mm: float) -> trimesh.Trimesh:
    pairs = pairwise(points_mm)
    pieces = [
        trimesh.creation.cylinder(radius=radius_mm, segment=np.array(pair), sections=6)
        for pair in pairs
        if np.linalg.norm(pair[1] - pair[0]) > radius_mm
    ]
    return trimesh.util.concatenate(pieces) if pieces else trimesh.Trimesh()


def _add(scene: trimesh.Scene, name: str, mesh: trimesh.Trimesh, paint: Colour, opacity: float) -> None:
    if not len(mesh.faces):
        return
    surface = trimesh.Trimesh(np.asarray(mesh.vertices) / 1000, mesh.faces, process=False)
    add_surface(scene, surface, np.eye(4), name=name, material=name, colour=paint, opacity=opacity)
