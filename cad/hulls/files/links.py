"""Links of a robot's description, posed: their meshes and simple shapes, masses and cameras."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from cad.hulls.files.found import Faces, FoundCamera, FoundHull, Piece, found_hull
from cad.hulls.files.uris import find_file
from optics.kernels.arrays import FloatArray

METRE_MM = 1000.0
UNDECLARED = re.compile(rb"(</?[\w-]+|\s[\w-]+):(?=[\w-]+[\s=/>])")
"""The name of an element or attribute up to the colon behind its prefix."""
CAMERA_NAME = re.compile(r"(^|[^a-z])cam(era)?s?([^a-z]|$)", re.IGNORECASE)
SHAPES: dict[str, tuple[Callable[..., trimesh.Trimesh], dict[str, int]]] = {
    "box": (lambda size: trimesh.creation.box(extents=size), {"size": 3}),
    "cylinder": (lambda r, h: trimesh.creation.cylinder(radius=r[0], height=h[0]), {"radius": 1, "length": 1}),
    "capsule": (lambda r, h: trimesh.creation.capsule(radius=r[0], height=h[0]), {"radius": 1, "length": 1}),
    "sphere": (lambda r: trimesh.creation.icosphere(subdivisions=3, radius=r[0]), {"radius": 1}),
    "ellipsoid": (lambda r: trimesh.creation.icosphere(subdivisions=3).apply_scale(r), {"radii": 3}),
}
"""Simple shapes, and how many numbers each of their keys has."""
Y_UP_SUFFIXES = (".glb", ".gltf")
"""Simulators turn glTF, which is y up by its standard; COLLADA's up axis they leave alone, and so do we."""
UPSIDE_DOWN_Y = 0.7
"""A camera's frame whose y points down by this much has z forward, as images have, and not x."""

ROBOT_AGAIN = "get the robot's description again, or give its mesh alone"

ReadMesh = Callable[[Path], FoundHull]


@dataclass(kw_only=True)
class Problems:
    """What is wrong with a description, gathered: it is said all at once."""

    said: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    def raise_any(self, description: Path) -> None:
        """Raise a `ValueError` when there is anything."""
        found = list(dict.fromkeys(self.said))
        if self.missing:
            names = ", ".join(dict.fromkeys(self.missing))
            found.append(
                f"expected the meshes that it names beside or above {description.resolve().parent}, missing: {names}; "
                "put them there"
            )
        if found:
            raise ValueError("; ".join(found))


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A mesh or simple shape on a link.

    Attributes
    ----------
    geometry : Element
        The element `geometry`, as URDF and SDF have it.
    pose : RigidTransform
        From its own axes to the robot's, metres.
    name : str
        The link's.
    """

    geometry: ET.Element
    pose: RigidTransform
    name: str


@dataclass(frozen=True, kw_only=True)
class Description:
    """A robot's description, read.

    Attributes
    ----------
    visuals, collisions : list of Shape
        What is drawn, and what other things bump into.
    mass_kg : float
        Of all links; 0 when none has one.
    cameras : list of FoundCamera
    """

    visuals: list[Shape]
    collisions: list[Shape]
    mass_kg: float
    cameras: list[FoundCamera]


def xml_root(text: str | bytes, what: str) -> ET.Element:
    """Root of an XML text; raises `ValueError` that says what was expected."""
    try:
        return ET.fromstring(text)
    except ET.ParseError as error:
        if "unbound prefix" in str(error) and isinstance(text, bytes):
            # Simulators read names with a prefix that nobody has declared.
            return xml_root(UNDECLARED.sub(rb"\1_", text).decode(errors="replace"), what)
        said = f"expected {what}, got what is no XML ({error})"
        raise ValueError(f"{said}; {ROBOT_AGAIN}") from None


def put_together(file: Path, description: Description, problems: Problems, read_mesh: ReadMesh) -> FoundHull:
    """Triangles of a description's links in metres, x forward and z up (REP 103).

    Links are drawn by their visuals; where there are none at all, by their collision shapes.

    Raises
    ------
    ValueError
        With all problems at once, meshes that are not found among them.
    """
    source = _Source(file=file, problems=problems, read_mesh=read_mesh)
    pieces = [
        Piece(name=shape.name, vertices=shape.pose.apply(vertices), faces=faces)
        for shape in description.visuals or description.collisions
        for vertices, faces in source.triangles(shape)
    ]
    if not pieces and not problems.missing:
        problems.said.append("expected links with visuals or collision shapes, got none that has a size")
    problems.raise_any(file)
    return found_hull(
        file,
        pieces,
        unit_mm=METRE_MM,
        up="+z",
        forward="+x",
        has_frame=True,
        mass_kg=description.mass_kg or None,
        cameras=tuple(description.cameras),
        files=tuple(dict.fromkeys(source.files)),
    )


def mesh_uris(root: ET.Element) -> list[str]:
    """Names of all meshes of a description."""
    return [name for mesh in root.iter("mesh") if (name := mesh_uri(mesh))]


def mesh_uri(mesh: ET.Element) -> str:
    """Name of a mesh's file, as URDF or SDF has it; empty when there is none."""
    return str(mesh.get("filename") or mesh.findtext("uri") or "").strip()


def camera(name: str, pose: RigidTransform, *, x_forward: bool | None = None) -> FoundCamera:
    """A camera from its frame: x forward and z up, or as images have it z forward and y down.

    Where it is not known which, the name says so ("optical"), or a y that points down.
    """
    turn = pose.rotation.as_matrix()
    if x_forward is None:
        x_forward = "optical" not in name.lower() and -turn[2, 1] < UPSIDE_DOWN_Y
    look, top = (turn[:, 0], turn[:, 2]) if x_forward else (turn[:, 2], -turn[:, 1])
    return FoundCamera(name=name, position_mm=METRE_MM * pose.translation, look=look, top=top)


def is_camera(name: str) -> bool:
    """Whether a link's or sensor's name says that it is a camera."""
    return CAMERA_NAME.search(name) is not None


def pose_of(xyz: Sequence[float], rpy: Sequence[float], *, degrees: bool = False) -> RigidTransform:
    """Pose from a translation, and turns about the fixed axes x, y, z in this order."""
    return RigidTransform.from_components(np.asarray(xyz), Rotation.from_euler("xyz", rpy, degrees=degrees))


def numbers(text: str | None, count: int, where: str, problems: Problems, default: float = 0.0) -> list[float]:
    """So many numbers of a text; the default, and a problem unless there is no text, when it does not hold them."""
    if text is None:
        return count * [default]
    try:
        read = [float(word) for word in text.split()]
    except ValueError:
        read = []
    if len(read) != count or not np.isfinite(read).all():
        problems.said.append(f"{where} = {text.strip()!r}: expected {count} number{'s' if count > 1 else ''}")
        return count * [default]
    return read


class _Source:
    """Where the triangles of a description's shapes come from, and the files that were read for them."""

    def __init__(self, *, file: Path, problems: Problems, read_mesh: ReadMesh):
        self.file, self.problems, self.read_mesh = file, problems, read_mesh
        self.files = [file]

    def triangles(self, shape: Shape) -> Iterator[tuple[FloatArray, Faces]]:
        """Corners in metres in the shape's own axes, and triangles, of each thing in its geometry."""
        for kind in shape.geometry:
            where = f"{shape.name}: {kind.tag}"
            made = self._mesh(kind, where) if kind.tag == "mesh" else self._simple(kind, where)
            if made is not None:
                yield made

    def _mesh(self, mesh: ET.Element, where: str) -> tuple[FloatArray, Faces] | None:
        uri = mesh_uri(mesh)
        scale_text = mesh.get("scale", mesh.findtext("scale"))
        scale = np.array(numbers(scale_text, 3, f"{where}.scale", self.problems, default=1.0))
        path = find_file(uri, self.file)
        if path is None:
            self.problems.missing.append(uri or "one without a name")
            return None
        try:
            found = self.read_mesh(path)
        except ValueError as error:
            self.problems.said.append(f"{path.name}: {error}")
            return None
        self.files.extend(found.files)
        vertices = np.asarray(found.vertices, dtype=np.float64) * ((found.unit_mm or METRE_MM) / METRE_MM)
        if path.suffix.lower() in Y_UP_SUFFIXES:
            vertices = vertices[:, [0, 2, 1]] * [1, -1, 1]
        faces, part = found.faces, mesh.findtext("submesh/name", "").strip()
        if part:
            faces = found.faces_of(part)
            if not len(faces):
                names = ", ".join(sorted({body.name for body in found.bodies}))
                self.problems.said.append(f"{where}.submesh = {part!r}: expected a part of {path.name} ({names})")
                return None
            if mesh.findtext("submesh/center", "").strip() in ("true", "1"):
                used = vertices[faces.reshape(-1)]
                vertices = vertices - (used.min(axis=0) + used.max(axis=0)) / 2
        return scale * vertices, faces if np.prod(scale) > 0 else faces[:, ::-1]

    def _simple(self, kind: ET.Element, where: str) -> tuple[FloatArray, Faces] | None:
        """Box, cylinder and their like; nothing of what has no size, or of other kinds."""
        if kind.tag not in SHAPES:
            return None
        make, keys = SHAPES[kind.tag]
        texts = {key: kind.get(key, kind.findtext(key)) for key in keys}
        lacking = [key for key, text in texts.items() if text is None]
        if lacking:
            self.problems.said.append(f"{where}: expected its {' and '.join(lacking)}, got none")
            return None
        given = [numbers(texts[key], count, f"{where}.{key}", self.problems) for key, count in keys.items()]
        if min(min(values) for values in given) <= 0:
            return None
        made = make(*given)
        return np.asarray(made.vertices, dtype=np.float64), np.asarray(made.faces, dtype=np.int64)
