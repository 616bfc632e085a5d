"""BOP's layout for 6D poses (scenewise): `bop/SPLIT/000000/` with images, depth, masks, cameras and poses.

A camera of BOP is a pinhole. Ours is the virtual camera over both mirrors, or the real one of a rig without them: two
reflections are a rigid motion, so that its poses and depths are exact. What the port does is not a pinhole's: the
matrix of an image is the one nearest to the exact rays of the pixels that look over both mirrors, and the image's
entry says how far off it is. Only what is seen over both mirrors is told: an image has one camera, and over one mirror
it would be mirrored, which no rotation says.

The keys are those of "Format of BOP datasets" of the BOP toolkit, boxes as its `misc.calc_2d_bbox` measures them:
from the first to the last pixel, so that one pixel is 0 wide.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from dives.datasets.dataset import Dataset
from dives.datasets.files import records
from dives.datasets.formats.bop_models import BopObject, Key, bop_objects, write_models
from dives.datasets.formats.coco import read_layer
from dives.datasets.record import SampleRecord
from optics.gaze.virtual_pinhole import DISTANCES_M
from optics.kernels.arrays import FloatArray
from optics.status import Region
from optics.train import Rays
from rigs import Rig
from rigs.atomic_files import write_bytes, write_text
from scenes.truth.virtual_view import exit_rays

FEWEST_PIXELS = 50
"""Over the mirrors; an image that shows less there is left out."""

FITTED_PIXELS = 2000
"""Of those are enough for four unknowns."""

CAMERA = "bop/camera.json"
"""The first image's camera, for programs that take one for the whole set."""

DEPTH_SCALE = 1.0
"""Millimetres to a step of depth."""

BoolImage = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Pinhole:
    """The pinhole nearest to a port's rays, at the place of the pinhole behind it.

    Attributes
    ----------
    matrix : array, shape (3, 3)
    rms_px, largest_px : float
        What is left at the fitted pixels, over points 0.5 to 10 m behind the port.
    """

    matrix: FloatArray
    rms_px: float
    largest_px: float


def write_bop(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write scenes and models; returns the names of the JSON and PLY files, which tell of all others."""
    objects = bop_objects(dataset)
    names = write_models(folder, objects.values())
    sensor: dict[str, float] = {}
    for place, chosen in _scenes(folder, indices).items():
        texts: dict[str, dict[str, Any]] = {"scene_camera": {}, "scene_gt": {}, "scene_gt_info": {}}
        for record in records(folder, chosen):
            image = _image(dataset, folder, record, objects)
            if image is not None:
                sensor = sensor or _sensor(image)
                for name, entry in zip(texts, _write_image(folder / place, record, image), strict=True):
                    texts[name][str(record.index)] = entry
        for name, entries in texts.items():
            names.append(f"{place}/{name}.json")
            (folder / place).mkdir(parents=True, exist_ok=True)
            write_text(folder / names[-1], _lines(entries))
    if sensor:
        names.append(CAMERA)
        write_text(folder / CAMERA, json.dumps(sensor, indent=2) + "\n")
    return names


def split_folder(split: str) -> str:
    """What BOP calls a split."""
    return "val" if split == "validation" else split


def fitted_pinhole(rays: Rays, seen: BoolImage) -> Pinhole:
    """Pinhole at the frame's origin that is nearest, in least squares, to the rays of the pixels in a mask.

    Parameters
    ----------
    rays : Rays
        Of all pixels behind the port, row by row.
    seen : array, shape (height, width)
        Pixels that count.
    """
    v, u = np.nonzero(seen)
    some = slice(None, None, 1 + len(v) // FITTED_PIXELS)
    v, u = v[some], u[some]
    chosen = rays[v * seen.shape[1] + u]
    reach = np.array(DISTANCES_M)[:, np.newaxis, np.newaxis]
    points = chosen.origin_m + reach * chosen.direction
    slopes = points[..., :2] / points[..., 2:]
    focal, centre, off = zip(*(_line(slopes[..., axis], place) for axis, place in enumerate((u, v))), strict=True)
    matrix = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1.0]])
    distance = np.hypot(*off)
    return Pinhole(matrix=matrix, rms_px=float(np.sqrt((distance**2).mean())), largest_px=float(distance.max()))


def _line(slopes: FloatArray, pixels: NDArray[np.int64]) -> tuple[float, float, FloatArray]:
    """Focal length and centre along an axis, and how far off each point is."""
    placed = np.broadcast_to(pixels, slopes.shape)
    focal, centre = np.polyfit(slopes.ravel(), placed.ravel(), 1)
    return float(focal), float(centre), focal * slopes + centre - placed


@dataclass(frozen=True, kw_only=True)
class _Image:
    """What is told of an image.

    `shown` has object, pose in the camera, silhouette and visible pixels of each thing.
    """

    pinhole: Pinhole
    camera_from_world: RigidTransform
    depth: NDArray[np.uint16]
    shown: list[tuple[BopObject, RigidTransform, BoolImage, BoolImage]]
    rgb: bytes


def _scenes(folder: Path, indices: Sequence[int]) -> dict[str, list[int]]:
    """Samples of each scene of a split, by its folder."""
    found: dict[str, list[int]] = {}
    for record in records(folder, indices):
        place = f"bop/{split_folder(record.split)}/{record.scene['number']:06d}"
        found.setdefault(place, []).append(record.index)
    return found


def _image(dataset: Dataset, folder: Path, record: SampleRecord, objects: dict[Key, BopObject]) -> _Image | None:
    """What is told of a sample; None when its mirrors show hardly anything."""
    instances, paths, depth = (read_layer(folder, record, kind) for kind in ("instances", "paths", "depth"))
    virtual = record.world_from_virtual_camera
    region = Region.GAZE if "gaze" in virtual else Region.DIRECT
    seen = paths == region
    rays = exit_rays(_rig(dataset, record), *seen.shape)
    if np.count_nonzero(seen) < FEWEST_PIXELS:
        return None
    camera_from_world = RigidTransform.from_matrix(virtual[region.name.lower()]).inv()
    numbers = {name: int(number) for number, name in record.instances.items()}
    shown = []
    for name, each, world_from_thing in _things(dataset, record, objects):
        pose = camera_from_world * RigidTransform.from_matrix(world_from_thing)
        visible = seen & (instances == numbers.get(name, -1))
        # A pixel on an edge may be the thing's in single precision and not in double precision: it is both's then.
        silhouette = visible | each.met_by(rays, pose).reshape(seen.shape)
        if silhouette.any():
            shown.append((each, pose, silhouette, visible))
    return _Image(
        pinhole=fitted_pinhole(rays, seen),
        camera_from_world=camera_from_world,
        depth=np.where(seen, depth, 0).astype(np.uint16),
        shown=shown,
        rgb=(folder / record.file("images")).read_bytes(),
    )


def _rig(dataset: Dataset, record: SampleRecord) -> Rig:
    return next(rig for rig in dataset.rigs.values() if rig.name == record.rig)


def _things(
    dataset: Dataset, record: SampleRecord, objects: dict[Key, BopObject]
) -> Iterator[tuple[str, BopObject, Any]]:
    """Name among the instances, object and pose in the world of target and decoys that are there."""
    values = dataset.grid.scene(record.scene["number"])
    diameter_m = record.drawn.get("target.diameter_m")
    things: list[tuple[str, Key, Any]] = [
        ("target", (values["target.shape"], values["target.colour"], diameter_m), record.world_from_target)
    ]
    for number, (each, pose) in enumerate(zip(dataset.spec.decoys, record.world_from_decoys, strict=True)):
        things.append((f"decoy {number}", (each.shape, each.colour, each.diameter_m), pose))
    yield from ((name, objects[key], pose) for name, key, pose in things if pose is not None)


def _write_image(place: Path, record: SampleRecord, image: _Image) -> tuple[Any, Any, Any]:
    """Write the images of a sample; its entries of camera, poses and what is said about them."""
    name = f"{record.index:06d}"
    _write(place / "rgb" / f"{name}{record.files['images'].suffix}", image.rgb)
    _write(place / "depth" / f"{name}.png", _png(image.depth))
    poses, infos = [], []
    for number, (each, pose, silhouette, visible) in enumerate(image.shown):
        for kind, mask in (("mask", silhouette), ("mask_visib", visible)):
            _write(place / kind / f"{name}_{number:06d}.png", _png(np.where(mask, 255, 0).astype(np.uint8)))
        poses.append(_rows("m2c", pose) | {"obj_id": each.number})
        infos.append(mask_info(silhouette, visible, image.depth))
    return _camera(record, image), poses, infos


def _camera(record: SampleRecord, image: _Image) -> dict[str, Any]:
    """Camera of an image; the keys behind `depth_scale` are our own."""
    return {
        "cam_K": image.pinhole.matrix.ravel().tolist(),
        **_rows("w2c", image.camera_from_world),
        "depth_scale": DEPTH_SCALE,
        "rms_px": round(image.pinhole.rms_px, 4),
        "largest_px": round(image.pinhole.largest_px, 4),
        "rig": record.rig,
        **{f"{name}_deg": value for name, value in record.joints_deg.items()},
    }


def _sensor(image: _Image) -> dict[str, float]:
    """Entry of `camera.json`: an image's camera."""
    (fx, _, cx), (_, fy, cy), _ = image.pinhole.matrix.tolist()
    height, width = image.depth.shape
    return {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "depth_scale": DEPTH_SCALE, "width": width, "height": height}


def _rows(what: str, pose: RigidTransform) -> dict[str, Any]:
    """Rotation, row by row, and translation in millimetres."""
    turn, shift = pose.rotation.as_matrix(), 1000 * pose.translation
    return {f"cam_R_{what}": turn.ravel().tolist(), f"cam_t_{what}": shift.tolist()}


def mask_info(silhouette: BoolImage, visible: BoolImage, depth: NDArray[Any]) -> dict[str, Any]:
    """Entry of `scene_gt_info.json`, of a silhouette that is not empty."""
    pixels, shown = int(silhouette.sum()), int(visible.sum())
    return {
        "bbox_obj": _box(silhouette) if shown else [-1] * 4,
        "bbox_visib": _box(visible) if shown else [-1] * 4,
        "px_count_all": pixels,
        "px_count_valid": int((silhouette & (depth > 0)).sum()),
        "px_count_visib": shown,
        "visib_fract": shown / pixels,
    }


def _box(mask: BoolImage) -> list[int]:
    rows, columns = np.nonzero(mask)
    return [int(columns.min()), int(rows.min()), int(np.ptp(columns)), int(np.ptp(rows))]


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, content)


def _png(image: NDArray[Any]) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


def _lines(entries: dict[str, Any]) -> str:
    """JSON with a line for each image, as BOP's own files have it."""
    return "{\n" + ",\n".join(f'  "{name}": {json.dumps(entry)}' for name, entry in entries.items()) + "\n}\n"
