"""The user's own mesh: a file read by trimesh, with its colours or its texture as a colour for each vertex."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.mesh import double_area_vectors
from optics.srgb import srgb_decode
from scenes.light.materials import Material
from scenes.surfaces.surface import Surface, surface

if TYPE_CHECKING:
    import trimesh

METRES = {"m": 1.0, "mm": 0.001, "inch": 0.0254}
Y_UP_SUFFIXES = (".glb", ".gltf")
"""Formats whose standard says metres and y up; all others are read with z up, in the stated unit."""
MESH_SUFFIXES = (".obj", ".ply", ".stl", *Y_UP_SUFFIXES)

Thing = tuple[str, Surface]


def read_things(path: Path, *, unit: str, plausible_m: tuple[float, float]) -> list[Thing]:
    """Named surfaces of a mesh file, z up, metres, about the file's own origin.

    Vertex and face colours and the colours of textures (taken at the vertices) are read as sRGB and become the
    reflectance; what has no colour is grey.

    Parameters
    ----------
    path : Path
    unit : {"m", "mm", "inch"}
        What the file's numbers mean; GLB and glTF are metres.
    plausible_m : tuple of float
        Smallest and largest extent of what is read.

    Raises
    ------
    ValueError
        When the file cannot be used; the message says what is wrong with it, all at once.
    """
    if unit not in METRES:
        raise ValueError(f"expected a unit ({', '.join(METRES)}), got {unit!r}")
    check_is_file(path)
    import trimesh  # noqa: PLC0415  (takes longer to import than a frame to render)

    try:
        scene = trimesh.load_scene(path, process=False)
        placed = [(str(scene.graph[node][1]), *scene.graph[node]) for node in sorted(scene.graph.nodes_geometry)]
        read = [(name, _placed(scene.geometry[key], pose)) for name, pose, key in placed]
    except Exception as error:
        # Readers of broken files fail in as many ways as files are broken.
        raise ValueError(f"{path.name}: expected a mesh, got what cannot be read as one ({error})") from None
    scale = 1.0 if path.suffix.lower() in Y_UP_SUFFIXES else METRES[unit]
    things = [(name, _surface(mesh, scale, path.suffix.lower() in Y_UP_SUFFIXES)) for name, mesh in read if mesh]
    problems = _problems(things, unit, plausible_m)
    if problems:
        raise ValueError(f"{path.name}: " + "; ".join(problems))
    return things


def check_is_file(path: Path) -> None:
    """Raise a `ValueError` that says so when there is no such file."""
    if not path.is_file():
        raise ValueError(f"{path}: expected a file, found {'a folder' if path.is_dir() else 'nothing'}")


def linear(srgb: NDArray[Any]) -> NDArray[np.float32]:
    """Reflectance of sRGB values of 0 to 255 (IEC 61966-2-1)."""
    return srgb_decode(np.asarray(srgb, dtype=np.float64) / 255).astype(np.float32)


def _placed(geometry: Any, pose: FloatArray) -> trimesh.Trimesh | None:
    """Copy of a mesh where the file's scene puts it; None for points and curves, which hold no triangles."""
    import trimesh  # noqa: PLC0415

    if not isinstance(geometry, trimesh.Trimesh) or not len(geometry.faces):
        return None
    mesh = geometry.copy()
    mesh.apply_transform(pose)
    return mesh


def _surface(mesh: trimesh.Trimesh, scale: float, y_up: bool) -> Surface:
    vertices, faces = scale * np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32)
    if y_up:
        vertices = np.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], axis=-1)
    material, colour = _colours(mesh)
    if len(colour) == len(faces) and mesh.visual.kind == "face":
        # A colour for each face needs corners of its own.
        vertices, colour = vertices[faces].reshape(-1, 3), np.repeat(colour, 3, axis=0)
        faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    flat = np.linalg.norm(double_area_vectors(vertices[faces]), axis=1) == 0
    return surface(vertices, faces[~flat], material, colour)


def _colours(mesh: trimesh.Trimesh) -> tuple[Material, NDArray[np.float32]]:
    kind = mesh.visual.kind
    if kind is None:
        return Material.ROCK, np.ones((len(mesh.vertices), 3), dtype=np.float32)
    if kind == "face":
        return Material.COLOURED, linear(mesh.visual.face_colors[:, :3])
    colours = mesh.visual.to_color().vertex_colors if kind == "texture" else mesh.visual.vertex_colors
    return Material.COLOURED, linear(np.broadcast_to(np.asarray(colours)[..., :3], (len(mesh.vertices), 3)))


def _problems(things: list[Thing], unit: str, plausible_m: tuple[float, float]) -> list[str]:
    if not sum(len(each.faces) for _, each in things):
        return ["expected triangles that have an area, got none; export it again as a mesh with faces"]
    broken = [name for name, each in things if not np.isfinite(each.vertices_m).all()]
    problems = [f"expected finite coordinates, got others in {name}" for name in broken]
    used = np.concatenate([each.vertices_m for name, each in things if name not in broken] or [np.zeros((1, 3))])
    extent, (low, high) = float(np.ptp(used, axis=0).max()), plausible_m
    if not broken and not low <= extent <= high:
        better = [each for each, metres in METRES.items() if low <= extent / METRES[unit] * metres <= high]
        hint = f"; {' or '.join(better)} would be" if better else ""
        problems.append(f"expected a size of {low:g} to {high:g} m, got {extent:.3g} m with unit {unit}{hint}")
    return problems
