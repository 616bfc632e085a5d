"""The housing: the port's two faces as refracting surfaces, and a black can behind them that the camera looks out of.

Shapes are in the scene's frame (`scenes.reference.scene`); the port's numbers are in the camera's.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray, check_vector, unit
from optics.kernels.backend import mi
from optics.ports.port import DomePort, FlatPort, NoPort, Port
from scenes.reference.bodies import diffuse

ROOM_BEHIND_M = 0.005
"""From the pinhole to the can's back, where nothing else says how deep it is."""

BLACK = np.zeros(3)


def housing(port: Port, scene_from_camera: FloatArray, water: Any) -> dict[str, Any]:
    """Shapes of a port in the scene, by name; `scene_from_camera` is a 4 x 4 matrix.

    What is outside the aperture is black, as it is to the fast renderer. Light may be reflected to and fro inside the
    window, and the can is seen in the mirrors; the fast renderer knows neither.
    """
    match port:
        case NoPort():
            return {}
        case FlatPort():
            return _flat(port, scene_from_camera, water)
        case DomePort():
            return _dome(port, scene_from_camera, water)
    raise TypeError(f"expected a flat port, a dome or none, got {type(port).__name__}")


def _flat(port: FlatPort, scene_from_camera: FloatArray, water: Any) -> dict[str, Any]:
    frame = scene_from_camera @ _frame_along(unit("normal", port.normal))
    radius = port.aperture_radius_m
    if radius is None:
        raise ValueError("expected a port with an aperture, got one without")
    inner, outer = port.distance_m, port.distance_m + port.thickness_m
    return {
        "port_inner": {
            "type": "disk",
            "to_world": _placed(frame, inner, radius),
            "bsdf": _interface(port.n_inside, port.n_port),
        },
        "port_outer": {
            "type": "disk",
            "to_world": _placed(frame, outer, radius),
            "bsdf": _interface(port.n_port, port.n_water),
            "exterior": water,
        },
        "can": _tube(frame, -ROOM_BEHIND_M, outer, radius),
        "can_back": {"type": "disk", "to_world": _placed(frame, -ROOM_BEHIND_M, radius), "bsdf": diffuse(BLACK)},
    }


def _dome(port: DomePort, scene_from_camera: FloatArray, water: Any) -> dict[str, Any]:
    """Two whole spheres; cans inside and around them leave the part within the aperture to be looked through."""
    centre = check_vector("centre_m", port.centre_m)
    frame = scene_from_camera.copy()
    frame[:3, 3] = (scene_from_camera @ [*centre, 1.0])[:3]
    outer = port.radius_m + port.thickness_m
    aperture = min(port.aperture_radius_m or port.radius_m, port.radius_m)
    rim = float(np.sqrt(port.radius_m**2 - aperture**2))
    spheres = {
        "port_inner": (port.radius_m, _interface(port.n_inside, port.n_port), {}),
        "port_outer": (outer, _interface(port.n_port, port.n_water), {"exterior": water}),
    }
    back = -outer - ROOM_BEHIND_M
    shapes = {
        name: {
            "type": "sphere",
            "center": [float(component) for component in frame[:3, 3]],
            "radius": radius,
            "bsdf": bsdf,
            **medium,
        }
        for name, (radius, bsdf, medium) in spheres.items()
    }
    return {
        **shapes,
        "can": _tube(frame, -port.radius_m, rim, aperture),
        "can_around": _tube(frame, back, rim, outer),
        "can_back": {"type": "disk", "to_world": _placed(frame, back, outer), "bsdf": diffuse(BLACK)},
    }


def _interface(n_inside: float, n_outside: float) -> dict[str, Any]:
    """Refracting face whose normal points outwards; Mitsuba scales radiance by the square of the index."""
    return {"type": "dielectric", "int_ior": float(n_inside), "ext_ior": float(n_outside)}


def _tube(frame: FloatArray, start: float, stop: float, radius: float) -> dict[str, Any]:
    return {
        "type": "cylinder",
        "p0": [0, 0, start],
        "p1": [0, 0, stop],
        "radius": radius,
        "to_world": mi.ScalarTransform4f(frame),
        "bsdf": diffuse(BLACK),
    }


def _placed(frame: FloatArray, along: float, radius: float) -> Any:
    pose = np.diag([radius, radius, 1.0, 1.0])
    pose[2, 3] = along
    return mi.ScalarTransform4f(frame @ pose)


def _frame_along(normal: FloatArray) -> FloatArray:
    """Rotation, as a 4 x 4 matrix, that takes z to `normal`."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across = across / np.linalg.norm(across)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([across, np.cross(normal, across), normal])
    return matrix
