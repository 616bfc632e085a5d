"""Where camera, port, mirrors and anchors stand, and how far each is from the hull; no mount need be possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import RigidTransform

from cad.assembly.hull_surface import hull_surface
from cad.hulls.anchors import (
    ENDS,
    LARGEST_ANGLE_DEG,
    LARGEST_GAP_MM,
    Anchor,
    End,
    Point,
    base_anchor,
    fold_anchor,
    nearest_on_surface,
    normal_around,
)
from cad.hulls.distance import NearestPoints, nearest_points
from cad.hulls.hull_mesh import posed, read_hull_surface
from cad.hulls.window import with_window
from optics.feasibility.hull_room import LARGEST_ANCHOR_GAP_M
from optics.kernels.arrays import FloatArray, unit
from optics.kernels.ray_scene import first_faces, mesh_scene
from optics.layout import Layout
from optics.mirror import PlaneMirror
from optics.mirror_outline import mirror_outline
from optics.status import Region
from optics.train import OpticalTrain, Rays, pixel_grid
from rigs import FileHull, NoPortSpec, Rig
from rigs.files import STEP_SUFFIXES

RAYS = (17, 13)
"""Columns and rows of the image by whose rays the view through the port is followed."""
RINGS, POINTS_PER_SIDE = 5, 8
"""Of the points that stand for a mirror's plate."""
SIDEWAYS = 1.5
"""Rays that miss M1's plane are followed this many times the distance to M1."""
POSES = (7, 5)
"""Pans and tilts over the joints' ranges at which the gaze mirror is looked at."""
PINHOLE, PORT = "camera's pinhole", "port's outer face"
CAMERA_PLACES = frozenset({PINHOLE, PORT})
INSIDE_MM = -0.01
"""Deeper is inside the hull: a port may lie flush with it."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """A thing of the rig beside the hull.

    Attributes
    ----------
    name : str
        What it is, in words.
    point_mm : tuple of three floats
        Its point that is nearest to the hull, or deepest in it; body frame.
    nearest_mm : tuple of three floats
        The hull's point that is nearest to that.
    distance_mm : float
        Between the two, negative inside the hull.
    wrong : str
        What is wrong with that, in words; empty when nothing is.
    """

    name: str
    point_mm: Point
    nearest_mm: Point
    distance_mm: float
    wrong: str


@dataclass(frozen=True, kw_only=True)
class Light:
    """Rays of the image from the port towards M1: (n, 3), body frame, millimetres.

    Attributes
    ----------
    start_mm, end_mm : arrays, shape (n, 3)
        On the port's outer face; and in M1's plane, or where the hull stops them before: at the port, when its skin is
        between that and the pinhole.
    folded, stopped : arrays, shape (n,)
        Which of them M1 would fold, and which the hull stops before they are there.
    rim : array, shape (k,)
        Those at the edge of the view, around it.
    """

    start_mm: FloatArray
    end_mm: FloatArray
    folded: NDArray[np.bool_]
    stopped: NDArray[np.bool_]
    rim: NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Plate:
    """A mirror's plate: corners of its face and, in their order, of its back; (k, 3), body frame, millimetres.

    `inside`: whether some of it is in the hull.
    """

    face_mm: FloatArray
    back_mm: FloatArray
    inside: bool = False


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A rig beside its hull.

    Attributes
    ----------
    rig : Rig
    hull : Trimesh
        Body frame, millimetres, as the rays of light hit it.
    layout : Layout
    light : Light
    fold_mirror, gaze_mirror : Plate
        M1, and M2 at rest.
    gaze_poses : tuple of Plate
        M2 over the ranges of both joints.
    anchors : dict
        By their end, fold and base; without one whose normal cannot be told.
    places : tuple of Place
        Camera, port, mirrors and anchors, each with its distance from the hull.
    """

    rig: Rig
    hull: trimesh.Trimesh
    layout: Layout
    light: Light
    fold_mirror: Plate
    gaze_mirror: Plate
    gaze_poses: tuple[Plate, ...]
    anchors: dict[End, Anchor]
    places: tuple[Place, ...]

    @property
    def wrong(self) -> tuple[Place, ...]:
        """What cannot stay where it is."""
        return tuple(place for place in self.places if place.wrong)


def rig_standing(rig: Rig) -> Standing:
    """Place a rig beside its hull.

    Raises
    ------
    ValueError
        For a rig without mirrors, and for a hull that cannot be read or made.
    """
    layout, hull = Layout.from_rig(rig), _hull(rig)
    q1, q2 = (float(np.clip(0, *joint.limits)) for joint in (layout.pan, layout.tilt))
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    light = _light(rig, train, layout, hull)
    fold, rest, poses = _plates(rig, layout, (q1, q2))
    (fold,), fold_place = _beside("fold mirror M1", [fold], hull)
    (rest,), rest_place = _beside("gaze mirror M2 at rest", [rest], hull)
    poses, range_place = _beside("gaze mirror M2 over its range", poses, hull)
    anchors = {end: anchor for end in ENDS if (anchor := _anchor(rig, end, hull)) is not None}
    return Standing(
        rig=rig,
        hull=hull,
        layout=layout,
        light=light,
        fold_mirror=fold,
        gaze_mirror=rest,
        gaze_poses=poses,
        anchors={end: anchors[end][0] for end in anchors},
        places=(
            *_camera_places(layout, light, hull),
            fold_place,
            rest_place,
            range_place,
            *(place for _, place in anchors.values()),
        ),
    )


def _hull(rig: Rig) -> trimesh.Trimesh:
    """Hull as the rays of light hit it: of a file its own triangles, open or closed, with the window cut out."""
    if rig.file_hull is not None:
        return with_window(_triangles(rig.file_hull), rig)
    try:
        return hull_surface(rig)
    except ValueError:
        # A camera far from our own hull leaves the boss of its port in the water: then the hull is shown without it.
        return hull_surface(rig.model_copy(update={"port": NoPortSpec(shape="none")}))


def _triangles(hull: FileHull) -> trimesh.Trimesh:
    if hull.file.suffix.lower() not in STEP_SUFFIXES:
        return posed(hull, read_hull_surface(hull).surface)
    from cad.hulls.hull import file_hull_surface  # noqa: PLC0415  (takes seconds to import)

    return file_hull_surface(hull)


def _light(rig: Rig, train: OpticalTrain, layout: Layout, hull: trimesh.Trimesh) -> Light:
    """Rays of the image behind the port, up to M1 or to the hull before it."""
    pixels = pixel_grid(train.camera, *RAYS)
    at_port = train.without_mirrors().trace(pixels)
    rays = at_port[at_port.passed]
    folded = np.isin(train.trace(pixels).region, (Region.FOLD, Region.GAZE))[at_port.passed]
    rim, distance = _around(rays.direction), _to_plane(train.mirrors[0], rays)
    rays = rays.moved(layout.body_from_camera)
    skin = mesh_scene(np.asarray(hull.vertices) / 1000, np.asarray(hull.faces))
    hit, _ = first_faces(skin, rays.origin_m, rays.direction)
    if rig.file_hull is not None:
        # Our own hulls hold the port in a boss that is solid behind it; a file's has a window there, or closed skin.
        segments = rays.origin_m - layout.body_from_camera.translation
        lengths = np.linalg.norm(segments, axis=1)
        starts = np.broadcast_to(layout.body_from_camera.translation, segments.shape)
        behind, _ = first_faces(skin, starts, segments / lengths[:, np.newaxis])
        hit = np.where(behind < lengths, 0.0, hit)
    end = rays.origin_m + np.minimum(hit, distance)[:, np.newaxis] * rays.direction
    return Light(start_mm=1000 * rays.origin_m, end_mm=1000 * end, folded=folded, stopped=hit < distance, rim=rim)


def _to_plane(mirror: PlaneMirror, rays: Rays) -> FloatArray:
    """How far rays go to a mirror's plane, or to somewhat more than its distance if they do not; metres."""
    centre, normal = np.asarray(mirror.point_m, dtype=np.float64), mirror.axes[:, 2]
    height, along = (centre - rays.origin_m) @ normal, rays.direction @ normal
    distance = np.divide(height, along, out=np.full(len(along), np.inf), where=height * along > 0)
    return np.asarray(np.minimum(distance, SIDEWAYS * np.linalg.norm(centre)))


def _around(directions: FloatArray) -> NDArray[np.int64]:
    """Those of directions in front of a camera that bound them, in the order around them."""
    ahead = np.flatnonzero(directions[:, 2] > 0)
    if len(ahead) < 3:
        return ahead
    bounds = ConvexHull(directions[ahead, :2] / directions[ahead, 2:]).vertices
    return np.asarray(ahead[bounds], dtype=np.int64)


def _plates(rig: Rig, layout: Layout, rest: tuple[float, float]) -> tuple[Plate, Plate, tuple[Plate, ...]]:
    """M1, M2 at rest, and M2 over its range."""
    gaze = rig.require_gaze()
    fold, turned = (mirror_outline(mirror).rim() for mirror in (gaze.fold_mirror, gaze.gaze_mirror))
    fold_depth, depth = (mirror.thickness_mm / 1000 for mirror in (gaze.fold_mirror, gaze.gaze_mirror))
    grid = [(q1, q2) for q1 in layout.pan.values(POSES[0]) for q2 in layout.tilt.values(POSES[1])]
    return (
        _plate(fold, fold_depth, layout.body_from_m1),
        _plate(turned, depth, layout.body_from_m2(*rest)),
        tuple(_plate(turned, depth, layout.body_from_m2(*q)) for q in grid),
    )


def _plate(outline_m: FloatArray, depth_m: float, body_from_mirror: RigidTransform) -> Plate:
    face = np.column_stack([outline_m, np.zeros(len(outline_m))])
    face_mm, back_mm = (1000 * body_from_mirror.apply(face - [0, 0, depth]) for depth in (0.0, depth_m))
    return Plate(face_mm=face_mm, back_mm=back_mm)


def _points(plate: Plate) -> FloatArray:
    """Points of a plate's face and back: rings from its edge to its middle."""
    points = []
    for corners in (plate.face_mm, plate.back_mm):
        steps = np.linspace(0, 1, POINTS_PER_SIDE, endpoint=False)[:, np.newaxis, np.newaxis]
        edge = ((1 - steps) * corners + steps * np.roll(corners, -1, axis=0)).reshape(-1, 3)
        middle = corners.mean(axis=0)
        points += [middle + share * (edge - middle) for share in np.linspace(0, 1, RINGS)]
    return np.concatenate(points)


def _place(name: str, points_mm: FloatArray, hull: trimesh.Trimesh, wrong: str = "") -> Place:
    """A thing made of points."""
    return _nearest_place(name, points_mm, nearest_points(hull, points_mm), wrong)


def _nearest_place(name: str, points_mm: FloatArray, found: NearestPoints, wrong: str) -> Place:
    """The point that is nearest to the hull, or deepest in it."""
    which = int(found.distance_mm.argmin())
    return Place(
        name=name,
        point_mm=_point(points_mm[which]),
        nearest_mm=_point(found.point_mm[which]),
        distance_mm=float(found.distance_mm[which]),
        wrong=wrong,
    )


def _beside(name: str, plates: Sequence[Plate], hull: trimesh.Trimesh) -> tuple[tuple[Plate, ...], Place]:
    """Plates that know whether they are in the hull, and the place of the one that is nearest to it or deepest in."""
    points = np.stack([_points(plate) for plate in plates])
    found = nearest_points(hull, points.reshape(-1, 3))
    inside = np.any(found.distance_mm.reshape(len(plates), -1) <= 0, axis=1)
    wrong = "in the hull" if inside.any() else ""
    beside = tuple(replace(plate, inside=within) for plate, within in zip(plates, inside.tolist(), strict=True))
    return beside, _nearest_place(name, points.reshape(-1, 3), found, wrong)


def _camera_places(layout: Layout, light: Light, hull: trimesh.Trimesh) -> list[Place]:
    """The pinhole, which may be in a housing, and the port's outer face, from which light must get out."""
    lost = light.stopped[light.folded]
    wrong = f"the hull stops {lost.mean():.0%} of its light before M1" if lost.any() else ""
    if not len(light.start_mm):
        wrong = "none of its light gets through the port"
    camera = _place(PINHOLE, 1000 * layout.body_from_camera.translation[np.newaxis], hull, wrong)
    if not len(light.start_mm):
        return [camera]
    port = _place(PORT, light.start_mm, hull)
    return [camera, replace(port, wrong="behind the hull's skin") if port.distance_mm < INSIDE_MM else port]


def _anchor(rig: Rig, end: End, hull: trimesh.Trimesh) -> tuple[Anchor, Place] | None:
    """An anchor and its place; None when the rig file does not say which way it faces."""
    mount = rig.require_gaze().mount
    point = getattr(mount, f"{end}_anchor_mm")
    asked = getattr(mount, f"{end}_plane") is None and getattr(mount, f"{end}_normal") is None
    if rig.file_hull is not None and asked:
        # What is shown need not be closed, as the hull must be that a mount asks for its normal.
        _, normals, _ = nearest_on_surface(hull, point)
        anchor = Anchor(point_mm=point, normal=_point(unit("normal", normals.sum(axis=0))))
    else:
        try:
            anchor = fold_anchor(rig) if end == "fold" else base_anchor(rig)
        except ValueError:
            return None
    return anchor, _anchor_place(f"{end} anchor", anchor, hull, from_file=rig.file_hull is not None)


def _anchor_place(name: str, anchor: Anchor, hull: trimesh.Trimesh, *, from_file: bool) -> Place:
    place = _place(name, np.array([anchor.point_mm]), hull)
    # Seats are on the solid of a file, which may stand off its triangles as a wrap does.
    if abs(place.distance_mm) > (1000 * LARGEST_ANCHOR_GAP_M if from_file else LARGEST_GAP_MM):
        return replace(place, wrong="not on the hull's surface")
    _, normals, _ = nearest_on_surface(hull, anchor.point_mm)
    if from_file:
        normals = np.vstack([normals, normal_around(hull, anchor)])
    # Triangles of a file may face inwards.
    square = np.abs(normals @ np.array(anchor.normal)).max() > np.cos(np.radians(LARGEST_ANGLE_DEG))
    return place if square else replace(place, wrong="not square to the hull's surface")


def _point(point: FloatArray) -> Point:
    x, y, z = (float(value) for value in point)
    return x, y, z
