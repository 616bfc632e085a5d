"""Solid bodies in the water: hull, mount, servos, mirrors, world and target, with the fast renderer's reflectances.

`albedo` is everywhere the reflectance of each material at three wavelengths, shape (materials, 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import mi
from optics.mesh import Group, PartMesh, Role
from optics.mirror_outline import mirror_outline
from optics.water.materials import aluminium_index
from optics.water.mirror_coatings import mirror_reflectance
from rigs.gaze import FlatMirror
from rigs.mounting import MirrorCoating
from scenes.light.materials import Material, colour_basis, material_of
from scenes.stage.group_mesh import plate_edge, vertex_normals
from scenes.stage.targets import MeshShape, TargetShape
from scenes.surfaces.surface import Surface
from scenes.worlds import World

RIM_POINTS = 360
"""Of the polygon that stands for an ellipse: it leaves out 0.004 % of the half axes."""

MESH_COLOUR = {"type": "mesh_attribute", "name": "vertex_albedo"}


def diffuse(albedo: ArrayLike) -> dict[str, Any]:
    """Lambertian on both sides, with a reflectance for each of three wavelengths as it is given."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": _raw(albedo)}}


def part_shapes(
    parts: Sequence[PartMesh], scene_from: dict[Group, RigidTransform], albedo: FloatArray
) -> dict[str, Any]:
    """Hull, mount and servos at their places; of the mirrors' plates the edges, their faces are `mirror_shape`'s."""
    drawn = [plate_edge(part) if part.role == Role.MIRROR else part for part in parts]
    return {
        f"part_{position}": _mesh(
            scene_from[part.group].apply(part.vertices_m), part.faces, diffuse(albedo[material_of(part)])
        )
        for position, part in enumerate(drawn)
    }


def surface_shapes(
    name: str, surface: Surface | World, scene_from: RigidTransform, albedo: FloatArray, wavelength_nm: FloatArray
) -> dict[str, Any]:
    """World, or a target of triangles, as one mesh for each material; smooth normals as the fast renderer's."""
    vertices = scene_from.apply(surface.vertices_m) if len(surface.vertices_m) else surface.vertices_m
    normals = vertex_normals(vertices, surface.faces)
    factors = surface.colour @ colour_basis(wavelength_nm)
    shapes = {}
    for material in np.unique(surface.material):
        faces = surface.faces[surface.material == material]
        used, renumbered = np.unique(faces, return_inverse=True)
        shapes[f"{name}_{material}"] = _mesh(
            vertices[used],
            renumbered.reshape(faces.shape),
            {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": MESH_COLOUR}},
            normals=normals[used],
            albedo=albedo[material] * factors[used],
        )
    return shapes


def mirror_shape(
    scene_from_mirror: RigidTransform,
    plate: FlatMirror,
    n_water: float,
    albedo: FloatArray,
    wavelength_nm: FloatArray,
    *,
    coating: MirrorCoating = "bare-aluminium",
) -> Any:
    """Aluminium in water in front, dark behind; a coating scales it by what it does at 45 degrees, where M1 stands."""
    n, k = aluminium_index(wavelength_nm)
    aslant = np.array([np.cos(np.pi / 4)])
    coated, bare = (mirror_reflectance(each, wavelength_nm, aslant, n_water) for each in (coating, "bare-aluminium"))
    bsdf = {
        "type": "twosided",
        "front": {"type": "conductor", "eta": _raw(n / n_water), "k": _raw(k / n_water)}
        | ({} if coating == "bare-aluminium" else {"specular_reflectance": _raw((coated / bare)[:, 0])}),
        "back": {"type": "diffuse", "reflectance": _raw(albedo[Material.MIRROR_BACK])},
    }
    if plate.outline == "rectangle":
        scale = np.diag([plate.width_mm / 2000, plate.height_mm / 2000, 1.0, 1.0])
        place = mi.ScalarTransform4f(scene_from_mirror.as_matrix() @ scale)
        return {"type": "rectangle", "to_world": place, "bsdf": bsdf}
    rim = mirror_outline(plate).rim(RIM_POINTS)
    fan = np.arange(1, len(rim) - 1)
    faces = np.column_stack([np.zeros_like(fan), fan, fan + 1])
    return _mesh(scene_from_mirror.apply(np.column_stack([rim, np.zeros(len(rim))])), faces, bsdf)


def target_shapes(
    target: TargetShape, scene_from_target: RigidTransform, albedo: FloatArray, wavelength_nm: FloatArray
) -> dict[str, Any]:
    """The target at its place."""
    if isinstance(target, MeshShape):
        return surface_shapes("target", target.surface, scene_from_target, albedo, wavelength_nm)
    return {
        "target": {
            "type": "sphere",
            "center": [float(component) for component in scene_from_target.translation],
            "radius": float(target.radius_m),
            "bsdf": diffuse(albedo[Material.TARGET]),
        }
    }


def _raw(values: ArrayLike) -> dict[str, Any]:
    """Texture that holds numbers for three wavelengths as they are; `rgb` would take them for a colour."""
    return {"type": "rawconstant", "value": [float(value) for value in np.asarray(values)]}


def _mesh(
    vertices_m: FloatArray,
    faces: NDArray[np.integer[Any]],
    bsdf: dict[str, Any],
    *,
    normals: FloatArray | None = None,
    albedo: FloatArray | None = None,
) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh("mesh", len(vertices_m), len(faces), has_vertex_normals=normals is not None, props=properties)
    if albedo is not None:
        mesh.add_attribute(MESH_COLOUR["name"], 3, albedo.astype(np.float32).ravel())
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices_m.astype(np.float32).ravel()
    if normals is not None:
        parameters["vertex_normals"] = normals.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh
