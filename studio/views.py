"""What the camera sees at a pose, with the rays that show how: made in a process of its own, which keeps its renderer.

Light is a draft until the full light of rig and surroundings is in the cache; then every image is in full light.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from cad.assembly.meshes import rig_meshes
from optics.gaze.kinematics import forward_gaze
from optics.gaze.sights import Sights
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.status import Region, Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import LitScene, prepare, prepare_from_cache
from scenes.image import display_image
from scenes.renderer import FastRenderer
from scenes.stage.frame import Frame, Label
from scenes.stage.targets import Ball, meshed
from studio.results import View, ViewRequest

RAY_END_M = 2.0
"""How far rays are drawn behind the gaze mirror."""
CONE_END_M = 1.0
CONE_GRID = (33, 25)
"""Columns and rows of the image by whose rays the cone is found."""
FARTHEST_M = 10.0
"""End of the distance overlay's scale."""
REGION_COLOURS = {
    Region.HOUSING: (30, 41, 59),
    Region.DIRECT: (233, 196, 106),
    Region.FOLD: (38, 70, 83),
    Region.GAZE: (42, 157, 143),
}
LABEL_COLOURS = {
    Label.HOUSING: (17, 24, 39),
    Label.OPEN_WATER: (48, 99, 142),
    Label.SURFACE: (148, 210, 230),
    Label.WORLD: (148, 163, 130),
    Label.TARGET: (230, 20, 40),
    Label.HULL: (233, 196, 106),
    Label.MOUNT: (231, 150, 81),
    Label.SERVO: (110, 60, 120),
    Label.MIRROR_BACK: (109, 89, 122),
    Label.MIRROR: (200, 225, 240),
    Label.SNOW: (255, 255, 255),
    Label.DECOY: (250, 130, 180),
}
OVERLAY_SHARE = {"regions": 0.45, "labels": 0.7}
"""Of the colour in the image."""


@dataclass
class _Kept:
    """The newest renderer."""

    key: Any = None
    light: str = "draft"
    renderer: FastRenderer | None = None


_KEPT = _Kept()


def see(request: ViewRequest) -> View:
    """Render a pose; `ValueError` for a pose or scene that there is not."""
    renderer = _renderer(request)
    start = time.perf_counter()
    q1, q2 = (float(q) for q in np.radians([request.q1_deg, request.q2_deg]))
    frame = renderer.render(q1=q1, q2=q2)
    image = _shown(frame, request, renderer)
    elapsed_ms = 1000 * (time.perf_counter() - start)
    return View(
        request=request,
        image=image,
        light=_KEPT.light,
        region=frame.region,
        sights=_sights(request.rig),
        render_ms=elapsed_ms,
        **_geometry(request.rig, q1, q2, renderer),
    )


def _renderer(request: ViewRequest) -> FastRenderer:
    """The kept renderer when it is of the same rig and surroundings; in full light as soon as there is some."""
    key = (request.rig, request.surroundings, request.width_px)
    if _KEPT.renderer is None or key != _KEPT.key or (request.full and _KEPT.light == "draft"):
        rig = request.rig
        scene, parts = request.surroundings.scene(rig), rig_meshes(rig)
        lit = prepare_from_cache(scene, rig, parts)
        light = "draft" if lit is None else "full"
        if lit is None and key == _KEPT.key and _KEPT.renderer is not None:
            return _KEPT.renderer
        lit = lit or prepare(scene, rig, parts, quality=LightQuality.draft(), full_if_kept=True)
        # One set of scenes at a time: kernels are recorded beside what scenes there are.
        _KEPT.renderer = None
        _KEPT.key, _KEPT.light, _KEPT.renderer = key, light, _sized(lit, request.width_px)
    return _KEPT.renderer


@lru_cache(maxsize=1)
def _sights(rig: Rig) -> Sights:
    return Sights.of(rig)


def _sized(lit: LitScene, width_px: int) -> FastRenderer:
    camera = lit.rig.camera
    return FastRenderer(lit, width_px=width_px, height_px=round(width_px * camera.height_px / camera.width_px))


def _shown(frame: Frame, request: ViewRequest, renderer: FastRenderer) -> NDArray[np.uint8]:
    """Image with its overlay."""
    if request.overlay == "distance":
        return distance_image(frame)
    image = _taken(frame, request) if request.sensor else display_image(frame, renderer.scene)
    if request.overlay == "regions":
        return with_colours(image, frame.region, REGION_COLOURS, OVERLAY_SHARE["regions"])
    if request.overlay == "labels":
        return with_colours(image, frame.label, LABEL_COLOURS, OVERLAY_SHARE["labels"])
    return image


def _taken(frame: Frame, request: ViewRequest) -> NDArray[np.uint8]:
    """What the rig's image sensor makes of a frame, with its noise."""
    from scenes.sensor import ImageSensor, capture, frame_key, settled_settings  # noqa: PLC0415  (few ask for it)

    height, width = frame.label.shape
    sensor = ImageSensor.from_rig(request.rig, width_px=width, height_px=height)
    scene = request.surroundings.scene(request.rig)
    settings = settled_settings(frame.radiance, sensor, card_radiance=scene.light.white_radiance(scene.depth_m))
    return capture(frame.radiance, sensor, settings, frame_key(0, 0)).image


def with_colours(
    image: NDArray[np.uint8], kinds: NDArray[np.uint8], colours: Mapping[Any, tuple[int, int, int]], share: float
) -> NDArray[np.uint8]:
    """Image in which each kind of pixel, shape (height, width), has its share of a colour."""
    table = np.array([colours[kind] for kind in sorted(colours)], dtype=np.float64)
    return np.round((1 - share) * image + share * table[kinds]).astype(np.uint8)


def distance_image(frame: Frame) -> NDArray[np.uint8]:
    """Distance of what is seen along the ray, near bright, open water dark, to `FARTHEST_M`."""
    near = 1 - np.clip(np.where(np.isfinite(frame.distance_m), frame.distance_m, FARTHEST_M) / FARTHEST_M, 0, 1)
    colours = np.array([(20, 24, 60), (42, 120, 142), (122, 209, 81), (253, 231, 37)], dtype=np.float64)
    stops = np.linspace(0, 1, len(colours))
    shown = np.stack([np.interp(near, stops, channel) for channel in colours.T], axis=-1)
    return np.round(shown).astype(np.uint8)


def _geometry(rig: Rig, q1: float, q2: float, renderer: FastRenderer) -> dict[str, Any]:
    layout, train = Layout.from_rig(rig), OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    target = renderer.scene.target
    assert target is not None
    centre = renderer.scene.world_from_body.inv().apply(target.world_from_target.translation)
    shape = target.shape
    radius = shape.radius_m if isinstance(shape, Ball) else float(np.ptp(meshed(shape).surface.vertices_m, 0).max() / 2)
    gaze = forward_gaze(layout, q1, q2)
    return {
        "target_px": target_pixel(train, layout, centre, renderer.shape),
        "target_m": centre,
        "target_radius_m": radius,
        "axis_m": layout.body_from_camera.apply(central_ray(train)),
        "cone_m": layout.body_from_camera.apply(gaze_cone_m(train).reshape(-1, 3)).reshape(2, -1, 3),
        "gaze_deg": tuple(float(np.degrees(angle)) for angle in (gaze.azimuth, gaze.elevation, gaze.roll)),
    }


def target_pixel(
    train: OpticalTrain, layout: Layout, target_m: FloatArray, shape: tuple[int, int]
) -> tuple[float, float] | None:
    """Where a point of the body frame is in an image of `shape` (height, width); None when the camera misses it."""
    found = train.project(layout.body_from_camera.inv().apply(target_m)[np.newaxis])
    if found.status[0] != Status.OK:
        return None
    scale = shape[1] / train.camera.width_px
    u, v = (float((pixel + 0.5) * scale - 0.5) for pixel in found.pixels[0])
    return u, v


def central_ray(train: OpticalTrain) -> FloatArray:
    """Corners of the ray of the principal point, camera frame: it ends where it misses something, (k, 3)."""
    principal = [[train.camera.cx_px, train.camera.cy_px]]
    points = [np.zeros(3)]
    for count in range(len(train.mirrors) + 1):
        ray = replace(train, mirrors=train.mirrors[:count]).trace(principal)
        if ray.status[0] != Status.OK:
            break
        points.append(ray.origin_m[0])
        end = ray.origin_m[0] + RAY_END_M * ray.direction[0]
    return np.array([*points, end] if len(points) > 1 else points * 2)


def gaze_cone_m(train: OpticalTrain) -> FloatArray:
    """Rays around what both mirrors pass: where they leave M2, and `CONE_END_M` further; camera frame, (2, k, 3)."""
    rays = train.trace(pixel_grid(train.camera, *CONE_GRID))
    rays = rays[rays.passed]
    if len(rays.status) < 3:
        return np.zeros((2, 0, 3))
    end = rays.origin_m + CONE_END_M * rays.direction
    middle = rays.direction.mean(axis=0)
    across = np.linalg.svd(middle[np.newaxis])[2][1:]
    rim = ConvexHull(end @ across.T).vertices
    return np.stack([rays.origin_m[rim], end[rim]])
