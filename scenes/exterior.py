"""Exterior views of a rig: hull and mount seen from outside, in air, by stock Mitsuba's path tracer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import unit
from optics.kernels.backend import mi
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import Rig
from scenes.image import write_image
from scenes.light.materials import albedo_table, material_of
from scenes.light.spectrum import camera_bands

VIEWPOINTS = {"left": (0.8, 3.0, -0.3), "front": (3.4, -1.2, -0.6)}
"""Directions in body axes that exterior views are taken from."""

WIDTH_PX, HEIGHT_PX = 720, 560
FIELD_OF_VIEW_DEG = 40.0
SAMPLES = 64
FRAMED = (Role.MOUNT, Role.MIRROR, Role.SERVO)
"""What must be in the image at rest; of the hull there may be much more."""
MARGIN = 1.1
SKY_RADIANCE, SUN_IRRADIANCE = 1.0, 3.0
"""As on a white studio ground, exposed so that white is white: mounts are often printed black."""
SUN_DIRECTION = (-0.5, 0.4, -0.8)
MIRROR = {"type": "conductor", "material": "Al"}


def exterior_view(
    rig: Rig, parts: Sequence[PartMesh], *, viewpoint: ArrayLike, q1: float = 0.0, q2: float = 0.0
) -> NDArray[np.uint8]:
    """Image of a rig from outside, sRGB, shape (HEIGHT_PX, WIDTH_PX, 3); joint values in radians.

    `viewpoint`, shape (3,), is the direction in body axes from which the mount is seen; the camera is so far away that
    all of mount, mirrors and servos at rest fit into the image.
    """
    layout = Layout.from_rig(rig)
    layout.check_joints(q1, q2)
    body_from = {Group.FIXED: None, Group.PAN: layout.body_from_pan(q1), Group.TILT: layout.body_from_m2(q1, q2)}
    centre, radius = _framed(layout, parts)
    away = MARGIN * radius / np.sin(np.radians(FIELD_OF_VIEW_DEG / 2) * HEIGHT_PX / WIDTH_PX)
    eye = centre + away * unit("viewpoint", viewpoint)
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 6},
        "sky": {"type": "constant", "radiance": SKY_RADIANCE},
        "sun": {"type": "directional", "direction": list(SUN_DIRECTION), "irradiance": SUN_IRRADIANCE},
        "sensor": {
            "type": "perspective",
            "fov": FIELD_OF_VIEW_DEG,
            "to_world": mi.ScalarTransform4f().look_at(origin=list(eye), target=list(centre), up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": WIDTH_PX, "height": HEIGHT_PX, "rfilter": {"type": "box"}},
        },
    }
    for part in parts:
        pose = body_from[part.group]
        vertices = part.vertices_m if pose is None else pose.apply(part.vertices_m)
        if part.role is Role.MIRROR:
            front = front_faces(part, layout)
            scene[f"{part.name}_front"] = _shape(replace(part, faces=part.faces[front]), vertices, MIRROR)
            part = replace(part, faces=part.faces[~front])  # noqa: PLW2901  (what is left of it)
        scene[part.name] = _shape(part, vertices, _surface(part))
    # Merged shapes would lose their materials.
    image = mi.render(mi.load_dict(scene, optimize=False), spp=SAMPLES, seed=0)
    picture = mi.Bitmap(image).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True)
    return np.array(picture)


def write_exterior_views(rig: Rig, parts: Sequence[PartMesh], folder: Path, *, q1: float, q2: float) -> list[Path]:
    """Write a PNG from every one of `VIEWPOINTS` into an existing folder."""
    paths = []
    for name, viewpoint in VIEWPOINTS.items():
        path = folder / f"outside_{name}.png"
        write_image(exterior_view(rig, parts, viewpoint=viewpoint, q1=q1, q2=q2), path)
        paths.append(path)
    return paths


def _framed(layout: Layout, parts: Sequence[PartMesh]) -> tuple[NDArray[np.float64], float]:
    """Centre and radius of a sphere around all that must be in the image, at rest, in the body frame."""
    at_rest = {Group.FIXED: None, Group.PAN: layout.body_from_pan(0.0), Group.TILT: layout.body_from_m2(0.0, 0.0)}
    poses = [(part, at_rest[part.group]) for part in parts if part.role in FRAMED]
    points = np.vstack([part.vertices_m if pose is None else pose.apply(part.vertices_m) for part, pose in poses])
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def front_faces(part: PartMesh, layout: Layout) -> NDArray[np.bool_]:
    """Which faces of a mirror's plate are its front; the others are glass: its edges and its back."""
    normal = [0.0, 0.0, 1.0] if part.group is Group.TILT else layout.body_from_m1.rotation.apply([0.0, 0.0, 1.0])
    first, second, third = np.moveaxis(part.vertices_m[part.faces], 1, 0)
    normals = np.cross(second - first, third - first)
    return np.asarray(normals @ normal > 0.5 * np.linalg.norm(normals, axis=1))


def _shape(part: PartMesh, vertices_m: NDArray[np.float64], surface: dict[str, Any]) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": surface})
    mesh = mi.Mesh(part.name, len(vertices_m), len(part.faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices_m.astype(np.float32).ravel()
    parameters["faces"] = part.faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


def _surface(part: PartMesh) -> dict[str, Any]:
    colour = camera_bands().weight @ albedo_table()[material_of(part)]
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": [float(channel) for channel in colour]}}
