"""Frames: the fast renderer beside stock Mitsuba `path` on the same rig, tank and poses, in one run.

Stock Mitsuba sees the same triangles, the port as two dielectric planes, the mirrors as aluminium rectangles and the
same sun and sky. It has no water between them (its `path` knows no media) and no hull (the camera would stand in
the solid), so it does less work per sample. Every
frame has a new pose of the gimbal, which stock Mitsuba takes through its scene parameters.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from cad.meshes import rig_meshes
from optics.backend import dr, mi
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.port import FlatPort, port_from_spec
from rigs import Rig
from scenes.renderer import FastRenderer
from scenes.stage import Stage, stage

WARM_UP, FRAMES = 4, 20
STOCK_SAMPLES = (1, 16)
SIZES = ((640, 480), (320, 240))


def run() -> list[dict[str, Any]]:
    """Milliseconds per frame with a new pose each, ours and stock Mitsuba's."""
    rig = Rig.load("aqua2")
    parts, scene = rig_meshes(rig), stage(rig)
    triangles = sum(len(part.faces) for part in parts) + len(scene.world.faces)
    rows = []
    for width, height in SIZES:
        renderer = FastRenderer(rig, parts, scene, width_px=width, height_px=height)

        def ours(q1: float, q2: float, renderer: FastRenderer = renderer) -> None:
            dr.eval(renderer.arrays(q1=q1, q2=q2))
            dr.sync_thread()

        fast = _milliseconds(ours)
        for samples in STOCK_SAMPLES:
            stock = _milliseconds(_stock_path(rig, parts, scene, width, height, samples))
            rows.append(
                {
                    "name": f"frame {width} x {height}, new pose, {triangles / 1000:.0f} k triangles",
                    "ours": fast,
                    "peer": stock,
                    "unit": "ms",
                    "ratio": stock / fast,
                    "note": f"peer: stock Mitsuba path, {samples} spp, no water; ours: 1 spp, no noise, with water",
                }
            )
    return rows


def _milliseconds(frame: Callable[[float, float], None]) -> float:
    poses = np.radians(np.linspace([-60.0, -20.0], [60.0, 20.0], WARM_UP + FRAMES))
    times = []
    for q1, q2 in poses:
        start = time.perf_counter()
        frame(float(q1), float(q2))
        times.append(time.perf_counter() - start)
    return 1000 * statistics.median(times[WARM_UP:])


def _stock_path(  # noqa: PLR0917
    rig: Rig, parts: list[PartMesh], scene: Stage, width: int, height: int, samples: int
) -> Callable[[float, float], None]:
    """Function that puts the gimbal into a pose and renders one frame with stock Mitsuba."""
    layout = Layout.from_rig(rig)
    body = scene.world_from_body
    description: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 12, "hide_emitters": False},
        "sensor": _sensor(rig, body.as_matrix() @ layout.body_from_camera.as_matrix(), width, height, samples),
        "sun": {"type": "directional", "direction": list(-scene.light.towards_sun), "irradiance": 3.0},
        "sky": {"type": "constant", "radiance": 0.3},
        "world": _mesh(scene.world.vertices_m, scene.world.faces),
        "m1": _rectangle(body.as_matrix() @ layout.body_from_m1.as_matrix(), rig.fold_mirror),
        "m2": _rectangle(np.eye(4), rig.gaze_mirror),
    }
    description |= _port(rig, body.as_matrix() @ layout.body_from_camera.as_matrix())
    visible = [part for part in parts if part.role not in (Role.MIRROR, Role.HULL)]
    for part in visible:
        description[part.name] = _mesh(part.vertices_m, part.faces)
    # Merged shapes could not be moved one by one.
    loaded = mi.load_dict(description, optimize=False)
    parameters = mi.traverse(loaded)
    half = [rig.gaze_mirror.width_mm / 2000, rig.gaze_mirror.height_mm / 2000, 1.0]
    for part in visible:
        if part.group == Group.FIXED:
            placed = body.apply(part.vertices_m)
            parameters[f"{part.name}.vertex_positions"] = placed.astype(np.float32).ravel()

    def frame(q1: float, q2: float) -> None:
        frames = {Group.PAN: body * layout.body_from_pan(q1), Group.TILT: body * layout.body_from_m2(q1, q2)}
        for part in visible:
            if part.group in frames:
                placed = frames[part.group].apply(part.vertices_m)
                parameters[f"{part.name}.vertex_positions"] = placed.astype(np.float32).ravel()
        parameters["m2.to_world"] = mi.ScalarTransform4f(frames[Group.TILT].as_matrix() @ np.diag([*half, 1.0]))
        parameters.update()
        dr.eval(mi.render(loaded, spp=samples))
        dr.sync_thread()

    return frame


def _sensor(rig: Rig, world_from_camera: np.ndarray, width: int, height: int, samples: int) -> dict[str, Any]:
    camera = rig.camera
    # Mitsuba's camera looks along +z with x to the left and y up: half a turn about z from OpenCV's.
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    return {
        "type": "perspective",
        "fov": float(np.degrees(2 * np.arctan(camera.width_px / 2 / camera.fx_px))),
        "near_clip": 1e-3,
        "to_world": mi.ScalarTransform4f(world_from_camera @ half_turn),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": samples},
    }


def _port(rig: Rig, world_from_camera: np.ndarray) -> dict[str, Any]:
    port = port_from_spec(rig.port, rig.water)
    assert isinstance(port, FlatPort)
    radius = port.aperture_radius_m
    faces = {
        "port_inner": (port.distance_m, port.n_port, port.n_inside),
        "port_outer": (port.distance_m + port.thickness_m, port.n_water, port.n_port),
    }
    described = {}
    for name, (distance, behind, before) in faces.items():
        # The disk's normal, -z, looks at the camera: there the exterior index holds.
        pose = np.diag([radius, -radius, -1.0, 1.0])
        pose[2, 3] = distance
        described[name] = {
            "type": "disk",
            "to_world": mi.ScalarTransform4f(world_from_camera @ pose),
            "bsdf": {"type": "dielectric", "int_ior": behind, "ext_ior": before},
        }
    return described


def _rectangle(pose: np.ndarray, plate: Any) -> dict[str, Any]:
    scale = np.diag([plate.width_mm / 2000, plate.height_mm / 2000, 1.0, 1.0])
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f(pose @ scale),
        "bsdf": {"type": "conductor", "material": "Al"},
    }


def _mesh(vertices_m: np.ndarray, faces: np.ndarray) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": {"type": "diffuse"}})
    mesh = mi.Mesh("mesh", len(vertices_m), len(faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices_m.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh
