"""A world from a Mitsuba scene file: its triangles and how much they reflect, and nothing else of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import Float32, UInt32, another_thread, dr, mi
from scenes.light.materials import Material
from scenes.surfaces.surface import surface
from scenes.worlds.mesh_file import Thing, check_is_file

MITSUBA_SUFFIX = ".xml"


def read_mitsuba(path: Path) -> tuple[list[Thing], tuple[str, ...]]:
    """Named surfaces of a Mitsuba scene, z up, metres, about its own origin; and what of it is not used.

    A BSDF's diffuse reflectance is taken at each vertex, a texture's at its coordinates.

    Raises
    ------
    ValueError
        When the file cannot be loaded or holds no triangles.
    """
    check_is_file(path)
    try:
        # Merged shapes would lose their names and materials.
        with another_thread():  # its textures may be OpenEXR's
            scene = mi.load_file(str(path), optimize=False)
    except Exception as error:
        # Its parser raises what the plugin at hand raises.
        raise ValueError(f"{path.name}: expected a Mitsuba scene, got what cannot be loaded ({error})") from None
    things, left_out = [], []
    for shape in scene.shapes():
        if shape.is_mesh() and shape.face_count():
            things.append((_name(shape), _surface(shape)))
        else:
            left_out.append(f"shape {_name(shape)} (no triangles)")
    left_out += [f"emitter {_name(emitter)}" for emitter in scene.emitters()]
    left_out += [f"sensor {_name(sensor)}" for sensor in scene.sensors()]
    media = [shape.interior_medium() for shape in scene.shapes() if shape.is_medium_transition()]
    left_out += sorted({f"medium {_name(medium)}" for medium in media if medium is not None})
    if not things:
        raise ValueError(f"{path.name}: expected triangle meshes, got none ({', '.join(left_out) or 'an empty scene'})")
    return things, (f"{path.name}: not used: {', '.join(left_out)}",) if left_out else ()


def _name(item: Any) -> str:
    return str(item.id() or item.class_name())


def _surface(shape: Any) -> Any:
    parameters = mi.traverse(shape)
    vertices = np.array(parameters["vertex_positions"], dtype=np.float64).reshape(-1, 3)
    faces = np.array(parameters["faces"]).reshape(-1, 3)
    return surface(vertices, faces, Material.COLOURED, _reflectance(shape, len(vertices)))


def _reflectance(shape: Any, count: int) -> NDArray[np.float32]:
    """Diffuse reflectance at each vertex, shape (n, 3)."""
    at = dr.zeros(mi.SurfaceInteraction3f, count)
    if shape.has_vertex_texcoords():
        at.uv = dr.gather(mi.Point2f, mi.traverse(shape)["vertex_texcoords"], dr.arange(UInt32, count))
    at.wi = mi.Vector3f(0, 0, 1)
    value = shape.bsdf().eval_diffuse_reflectance(at)
    columns = [np.broadcast_to(np.array(Float32(channel)), count) for channel in value]
    return np.asarray(np.clip(np.stack(columns, axis=-1), 0, 1), dtype=np.float32)
