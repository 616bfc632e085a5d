"""A sample as files: its image, its layers of ground truth, and a record of everything else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from dives.datasets.drawing import Sample, target_radius_m
from dives.datasets.record import Matrix, SampleFile, SampleRecord, file_facts
from dives.datasets.scenes import DatasetScene
from optics.gaze.kinematics import forward_gaze
from scenes.image import display_image
from scenes.sensor import capture, frame_key, settled_settings
from scenes.stage.frame import Frame
from scenes.truth import GroundTruth, ground_truth
from scenes.truth.coco import coco_document
from scenes.truth.motion import Motion

DEPTH_UNIT_M = 0.001
"""Of a step of the depth's 16 bits; 0 is open water, housing or what is beyond the camera's reach."""

DEEPEST = 2**16 - 1

FURTHER = 8
"""Added to the path of a pixel whose light came over one more reflection."""

FLOW_UNIT_PX = 1 / 64
"""Of a step of the flow's 16 bits, as in KITTI's files."""

FLOW_ZERO = 2**15

LAYERS = {
    "images": "image as the camera takes it, 8-bit sRGB",
    "depth": "z-depth in the virtual camera of the pixel's path, 16 bits, 1 = 1 mm, 0 = none",
    "normals": "unit normal in that camera (right, down, forward), 16 bits each, 0 = -1, 65535 = 1; 0 0 0 = none",
    "semantic": "what is seen (scenes.stage.frame.Label), 8 bits",
    "instances": "which one, 16 bits, 0 = none; names in the sample's record",
    "paths": "over which mirrors: 0 housing, 1 direct, 2 M1, 3 M1 and M2; plus 8 over one more reflection; 8 bits",
}
"""Folders of the images of a sample, and what their pixels are."""

FLOW = {
    "flow": "optical flow, 16 bits: red 64 u + 32768, green 64 v + 32768, blue 0 none, 1 seen, 2 out, 3 hidden, 4 else"
}
"""Likewise, of sets that have it."""


@dataclass(frozen=True, kw_only=True)
class Rendered:
    """A sample that is rendered.

    Attributes
    ----------
    files : dict of str to bytes
        Content by folder (`LAYERS`, `layers`).
    record : SampleRecord
    """

    files: dict[str, bytes]
    record: SampleRecord


def rendered(scene: DatasetScene, sample: Sample) -> Rendered:
    """Render a sample: the same bytes whatever was rendered before."""
    frame = scene.renderer.render_states([sample.state])[0]
    exact = frame if scene.renderer.samples == 1 else scene.exact_renderer.render_states([sample.state])[0]
    image, exposure = _image(scene, sample, frame)
    flow = scene.dataset.spec.clip.flow
    truth = ground_truth(
        replace(exact, target_fraction=frame.target_fraction),
        scene.rig,
        sample.state,
        parts=scene.parts,
        instance_names=scene.renderer.instance_names,
        target_radius_m=target_radius_m(scene, sample.state) if sample.present[0] else None,
        next_state=sample.next_state if flow else None,
        next_frame=scene.exact_renderer.render_states([sample.next_state])[0] if flow else None,
    )
    quality = scene.dataset.spec.image.jpeg_quality
    files = {"images": _png(image) if quality is None else _jpeg(image, quality)}
    files |= {name: _png(layer) for name, layer in _layers(truth).items()}
    if truth.forward is not None:
        files["flow"] = _png(_flow(truth.forward))
    if scene.dataset.spec.image.exr:
        files["layers"] = _exr(replace(truth, frame=replace(truth.frame, radiance=frame.radiance)))
    suffixes = {"images": ".png" if quality is None else ".jpg", "layers": ".exr"}
    facts = {name: file_facts(suffixes.get(name, ".png"), content) for name, content in files.items()}
    return Rendered(files=files, record=_record(scene, sample, truth, exposure, facts))


def _image(scene: DatasetScene, sample: Sample, frame: Frame) -> tuple[NDArray[np.uint8], dict[str, float] | None]:
    spec = scene.dataset.spec
    if not spec.image.sensor:
        return display_image(frame, scene.stage), None
    settings = settled_settings(frame.radiance, scene.sensor, card_radiance=scene.card_radiance)
    settings = replace(settings, exposure_s=settings.exposure_s * 2 ** sample.values["image.exposure_ev"])
    taken = capture(frame.radiance, scene.sensor, settings, frame_key(spec.seed, sample.index))
    return taken.image, {"time_ms": 1000 * settings.exposure_s, "gain_db": settings.gain_db}


def _layers(truth: GroundTruth) -> dict[str, NDArray[Any]]:
    frame, view = truth.frame, truth.view
    depth = np.where(np.isfinite(view.z_depth_m) & (view.z_depth_m > 0), view.z_depth_m, 0) / DEPTH_UNIT_M
    has_normal = np.linalg.norm(view.normal, axis=-1, keepdims=True) > 0.5
    return {
        "depth": np.clip(np.round(depth), 0, DEEPEST).astype(np.uint16),
        "normals": np.where(has_normal, np.round((view.normal + 1) / 2 * DEEPEST), 0).astype(np.uint16),
        "semantic": frame.label,
        "instances": (frame.instance + 1).astype(np.uint16),
        "paths": frame.region + FURTHER * view.further_reflection.astype(np.uint8),
    }


def _flow(motion: Motion) -> NDArray[np.uint16]:
    """Flow as KITTI has it: what does not fit into 16 bits is none."""
    steps = [np.round(each / FLOW_UNIT_PX) + FLOW_ZERO for each in (motion.du_px, motion.dv_px)]
    fits = np.logical_and.reduce([(each >= 0) & (each <= DEEPEST) for each in steps])
    told = [np.where(fits, each, 0) for each in (*steps, motion.seen + 1.0)]
    return np.stack(told, axis=-1).astype(np.uint16)


def _png(image: NDArray[Any]) -> bytes:
    return cv2.imencode(".png", _blue_first(image) if image.ndim == 3 else image)[1].tobytes()


def _jpeg(image: NDArray[np.uint8], quality: int) -> bytes:
    """JPEG without subsampled colour: a target of few pixels is known by its colour."""
    flags = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    return cv2.imencode(".jpg", _blue_first(image), flags)[1].tobytes()


def _blue_first(image: NDArray[Any]) -> NDArray[Any]:
    """The order in which OpenCV has colours."""
    return np.ascontiguousarray(image[..., ::-1])


def _exr(truth: GroundTruth) -> bytes:
    from scenes.truth.layers import layers_bytes  # noqa: PLC0415  (few sets have them)

    return layers_bytes(truth)


def _record(
    scene: DatasetScene,
    sample: Sample,
    truth: GroundTruth,
    exposure: dict[str, float] | None,
    files: dict[str, SampleFile],
) -> SampleRecord:
    state, document = sample.state, coco_document(truth, file_name="")
    assert state.world_from_body is not None and state.world_from_target is not None
    rows, columns = truth.frame.label.shape
    seen = np.unique(truth.frame.instance)
    there = sample.present[0]
    return SampleRecord(
        index=sample.index,
        split=sample.split,
        clip=sample.clip,
        frame=sample.frame,
        scene={key: _without_folder(value) for key, value in scene.values.items()} | {"number": scene.number},
        drawn=sample.values,
        time_s=state.time_s,
        width_px=columns,
        height_px=rows,
        rig=scene.rig.name,
        camera_matrix=document["info"]["camera_matrix"],
        world_from_virtual_camera=document["info"]["world_from_virtual_camera"],
        world_from_body=state.world_from_body.as_matrix().tolist(),
        world_from_target=state.world_from_target.as_matrix().tolist() if there else None,
        world_from_decoys=_decoy_poses(sample),
        target_radius_m=target_radius_m(scene, state) if there else None,
        target_px=truth.frame.target_centroid_px(),
        joints_deg={"q1": float(np.degrees(state.q1)), "q2": float(np.degrees(state.q2))},
        gaze_deg=_gaze(scene, sample),
        exposure=exposure,
        path_px=truth.frame.region_counts(),
        instances={str(int(number) + 1): truth.instance_names[number] for number in seen if number >= 0},
        annotations=[_without_mask(each) for each in document["annotations"]],
        files=files,
    )


def _decoy_poses(sample: Sample) -> list[Matrix | None]:
    """Pose of each decoy in the world; None of one that is not there."""
    poses = sample.state.world_from_decoys or ()
    return [pose.as_matrix().tolist() if there else None for pose, there in zip(poses, sample.present[1:], strict=True)]


def _without_folder(value: Any) -> Any:
    """A file's name alone: a record shall be the same on every machine."""
    return Path(value).name if isinstance(value, str) and Path(value).suffix else value


def _without_mask(annotation: dict[str, Any]) -> dict[str, Any]:
    """An annotation without its mask, which semantic, instances and paths hold."""
    return {key: value for key, value in annotation.items() if key not in ("segmentation", "id", "image_id")}


def _gaze(scene: DatasetScene, sample: Sample) -> dict[str, float] | None:
    if scene.layout is None:
        return None
    gaze = forward_gaze(scene.layout, sample.state.q1, sample.state.q2)
    return {name: float(np.degrees(getattr(gaze, name))) for name in ("azimuth", "elevation", "roll")}
