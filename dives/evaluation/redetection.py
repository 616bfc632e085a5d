"""A recorded dive detected again with other settings, and what that gains: the paper's video S5.

The images are those of the record, and so are the joint values that the loop estimated, hence its crops; only the
detector differs. Which pixels show the target is not kept with a dive: they are rendered again, from the dive's file
and the true joint values of its log.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from cad.assembly.meshes import rig_meshes
from dives.dive import Dive
from dives.files import DIVE_FILE, OVERLAY_FILE, VIDEO_FILE, json_text
from dives.ground_truth_columns import GroundTruthColumns
from dives.looked_at import pixels_around
from dives.metrics import dive_metrics
from dives.metrics.detector import DETECTOR_DEFINITIONS
from dives.paths import attitude_sensor, body_pose, decoy_pose, target_pose
from dives.recorder import FRAMES
from dives.rendered_camera import Exposure, dive_scene
from dives.views.robot_view import robot_view
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from rigs.atomic_files import atomic_files
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.renderer import FastRenderer
from scenes.sensor import CameraSettings, ImageSensor
from scenes.stage.state import State
from tracking.cameras import ImageFolderCamera, VideoCamera
from tracking.estimation.gimbal import Gimbal
from tracking.log import LOG, Row, loop_columns, read_log, table_of, write_table
from tracking.loop.loop import TrackingLoop
from tracking.loop.offline import detector_named
from tracking.overlay import overlay
from tracking.perception import ColourWindow, DetectorSettings
from tracking.protocols import CameraFrame, MirrorReport
from tracking.records import Mode, Step
from tracking.video import VideoWriter, concatenate

COMPARISON_FILE = "comparison.json"

LOSSLESS = ("ffv1", "frames")

COMPARED = (*DETECTOR_DEFINITIONS, "detected_error_rms_px")
"""Metrics that tell a detector apart; what the loop did with the target stays as it was recorded."""

DETECTION_COLUMNS = (
    "detected",
    "blobs",
    "blob_area_px",
    "centroid_x_px",
    "centroid_y_px",
    "error_x_px",
    "error_y_px",
    "detector_true_px",
    "detector_found_px",
    "detector_both_px",
    "detected_thing",
)
"""Columns of a log that are replaced, and with them the cause."""


@dataclass(frozen=True, kw_only=True)
class DetectedAgain:
    """One image of the record with its new detection.

    Attributes
    ----------
    camera_frame : CameraFrame
    step : Step
        As recorded but for the detection.
    row : dict
        Of the new log.
    """

    camera_frame: CameraFrame
    step: Step
    row: Row


class Recording:
    """A finished dive's folder, to be detected again.

    Parameters
    ----------
    folder : Path

    Attributes
    ----------
    dive : Dive
    rig : Rig
    log : pyarrow.Table

    Raises
    ------
    FileNotFoundError
        When the folder holds no finished dive, or no images of it.
    ValueError
        When its images are not kept as they were.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self.log = read_log(folder)
        self.dive = Dive.load(folder / DIVE_FILE)
        self.rig: Rig = self.dive.load_rig()
        if self.dive.video not in LOSSLESS:
            kept = f"video = {self.dive.video!r}"
            raise ValueError(
                f'{folder}: expected video = "ffv1" or "frames", which keep images as they were, got {kept}'
            )

    def camera_frames(self) -> Iterator[CameraFrame]:
        """Its images, at the times of its log; `ValueError` when one is missing."""
        times_s = self.log["time_s"].to_pylist()
        camera: VideoCamera | ImageFolderCamera
        if self.dive.video == "frames":
            camera = ImageFolderCamera(self.folder / FRAMES, frame_rate_hz=self.dive.frame_rate_hz)
        else:
            camera = VideoCamera(self.folder / VIDEO_FILE)
        try:
            for number, time_s in enumerate(times_s):
                camera_frame = camera.read()
                if camera_frame is None or abs(camera_frame.time_s - time_s) > 0.5 / self.dive.frame_rate_hz:
                    raise ValueError(f"{self.folder}: expected an image for each row of its log, row {number} has none")
                yield replace(camera_frame, time_s=time_s)
        finally:
            camera.close()


def changed_settings(dive: Dive, detector: str | None, changes: Mapping[str, Any]) -> DetectorSettings:
    """Settings to detect a dive with again: those of a detector by name, else the dive's own, with some changed.

    With neither a name nor changes they are the dive's `[offline_detector]`. A name says nothing of the water: that
    is the dive's.

    Parameters
    ----------
    dive : Dive
    detector : str, optional
        One of `tracking.perception.DETECTORS`.
    changes : mapping of str to number
        By the names of `DetectorSettings` and `ColourWindow`.

    Raises
    ------
    ValueError
        For an unknown name, values that cannot be, or when nothing is asked for.
    """
    offline = dive.offline_settings()
    if detector is not None:
        known = dive.detector_settings()
        of_target = {name: getattr(known, name) for name in ("colour", "over_water", "least_speed_m_per_s")}
        settings = replace(detector_named(detector), **of_target)
    elif changes:
        settings = dive.detector_settings()
    elif offline is not None:
        settings = offline
    else:
        raise ValueError(f"expected other settings, since dive {dive.name!r} has no [offline_detector]")
    of_window = {field.name for field in fields(ColourWindow)}
    window = replace(settings.window, **{name: value for name, value in changes.items() if name in of_window})
    return replace(settings, window=window, **{name: value for name, value in changes.items() if name not in of_window})


def detect_again(
    recording: Recording, settings: DetectorSettings, *, progress: Callable[[int, int], None] = lambda done, total: None
) -> Iterator[DetectedAgain]:
    """Detect the target in every image of a dive again.

    Parameters
    ----------
    recording : Recording
    settings : DetectorSettings
    progress : callable, optional
        Gets the images done and to do.
    """
    dive, rig = recording.dive, recording.rig
    # Labels alone are asked of it: they are the same in any light.
    renderer = FastRenderer(prepare(dive_scene(dive, rig), rig, quality=LightQuality.coarse()))
    target = renderer.scene.target
    assert target is not None  # a dive's scene has one
    truth = GroundTruthColumns(rig, target.shape, settings)
    gimbal = Gimbal(Layout.from_rig(rig))
    variant = dive.loop_variant()
    view = robot_view(rig, rig_meshes(rig)) if variant.ignores_robot else None
    loop = TrackingLoop(rig, variant, detector=settings, robot_view=view)
    turns = attitude_sensor(dive)
    rows = recording.log.to_pylist()
    sensor = ImageSensor.from_rig(rig)
    half_s = (sensor.height_px - 1) * sensor.row_time_s / 2
    for number, (camera_frame, recorded) in enumerate(zip(recording.camera_frames(), rows, strict=True)):
        # Degrees and back may end a rounding beyond a joint's limit.
        states = [
            _state(dive, np.clip(_joints(recorded, name), gimbal.lowest, gimbal.highest), camera_frame.time_s + later_s)
            for name, later_s in (("first_row", -half_s), ("true", 0.0), ("last_row", half_s))
        ]
        state = states[1]
        q_true = np.array([state.q1, state.q2])
        estimated = MirrorReport(q=_joints(recorded, "estimated"), time_s=camera_frame.time_s, measured=False)
        attitude = None if turns is None else turns.report(camera_frame.time_s)
        step = _as_recorded(loop.step(camera_frame, estimated, attitude), recorded)
        label = _labels(renderer, states, [step.corners_px, truth.corners_px(q_true)])
        true = truth.of(_exposure(recorded, state, label), step, np.zeros(2))
        yield DetectedAgain(camera_frame=camera_frame, step=step, row=_row(recorded, loop_columns(step, q_true) | true))
        progress(number + 1, len(rows))


def redetect(
    folder: Path, output: Path, settings: DetectorSettings, *, progress: Callable[[int, int], None]
) -> dict[str, dict[str, Any]]:
    """Detect a finished dive again; write the new log, what the detector sees as a video, and the comparison.

    Parameters
    ----------
    folder : Path
        Of the dive.
    output : Path
        Gets log.parquet, overlay.mp4 and comparison.json, when all of it is done.
    settings : DetectorSettings
    progress : callable
        Gets the images done and to do.

    Returns
    -------
    dict
        As `compared` has it.
    """
    recording = Recording(folder)
    rate_hz = recording.dive.frame_rate_hz
    with atomic_files(output) as partial:
        segment = partial / "overlay.mkv"
        rows = []
        with closing(VideoWriter(segment, "h264", rate_hz)) as video:
            for each in detect_again(recording, settings, progress=progress):
                video.write(overlay(each.camera_frame, each.step))
                rows.append(each.row)
        again = table_of(rows)
        comparison = compared(recording.log, again)
        concatenate([segment], partial / OVERLAY_FILE, container="mp4", frame_rate_hz=rate_hz)
        segment.unlink()
        write_table(again, partial / LOG)
        (partial / COMPARISON_FILE).write_text(json_text(comparison), encoding="utf-8")
    return comparison


def compared(before: pa.Table, after: pa.Table) -> dict[str, dict[str, Any]]:
    """Metrics of the detector in two logs of the same dive: `recorded`, `again`, and `gain`, their difference.

    A gain is None where either is.
    """
    recorded, again = ({name: dive_metrics(log)[name] for name in COMPARED} for log in (before, after))
    gain = {name: _difference(recorded[name], again[name]) for name in COMPARED}
    return {"recorded": recorded, "again": again, "gain": gain}


def _as_recorded(step: Step, row: Row) -> Step:
    """The detection of a step, with what the loop decided on the dive."""
    centroid = step.detection.centroid_px
    middle = (step.crop.shape[1] - 1) / 2, (step.crop.shape[0] - 1) / 2
    return replace(
        step,
        mode=Mode(row["mode"]),
        q_command=_joints(row, "command"),
        predicted_px=_point(row, "predicted"),
        error_px=None if centroid is None else (centroid[0] - middle[0], centroid[1] - middle[1]),
    )


def _row(recorded: Row, again: Row) -> Row:
    """A row of the new log: the recorded one with the columns of the new detection."""
    found = bool(again["detector_both_px"] > 0 and again["detected"])
    was_found = recorded["cause_of_loss"] == ""
    # The record knows how fast servos and image moved; for what was found there, nothing but the image is to blame.
    cause = "" if found else again["cause_of_loss"] if was_found else recorded["cause_of_loss"]
    return recorded | {name: again[name] for name in DETECTION_COLUMNS} | {"cause_of_loss": cause}


def _state(dive: Dive, q: FloatArray, time_s: float) -> State:
    """Where everything was."""
    return State(
        q1=float(q[0]),
        q2=float(q[1]),
        world_from_body=body_pose(dive, time_s),
        world_from_target=target_pose(dive, time_s),
        world_from_decoys=tuple(decoy_pose(dive, decoy, time_s) for decoy in dive.decoys),
        time_s=time_s,
    )


def _labels(renderer: FastRenderer, states: list[State], outlines_px: list[FloatArray]) -> NDArray[np.uint8]:
    """What pixels within outlines show, shape (height, width), as the image's rows went through the states."""
    rays, pixels = renderer.rays_of(pixels_around(outlines_px, renderer.shape[::-1]))
    label = np.zeros(renderer.shape, dtype=np.uint8)
    if rays.size:
        label.ravel()[pixels] = renderer.sweep_arrays(states, truth=False, chosen=rays).label.numpy()
    return label


def _exposure(row: Row, state: State, label: NDArray[np.uint8]) -> Exposure:
    """What a log knows of an exposure; how far the view moved in it is not in a log, and asked for the cause alone."""
    half_s = row["exposure_s"] / 2
    return Exposure(
        frame=row["frame"],
        time_s=row["time_s"],
        start_s=row["time_s"] - half_s,
        end_s=row["time_s"] + half_s,
        settings=CameraSettings(exposure_s=row["exposure_s"], gain_db=row["gain_db"], white_gains=(1.0, 1.0, 1.0)),
        state=state,
        label=label,
        smear_px=0.0,
        sweeps=1,
    )


def _joints(row: Row, kind: str) -> FloatArray:
    return np.radians([row[f"q1_{kind}_deg"], row[f"q2_{kind}_deg"]])


def _point(row: Row, kind: str) -> tuple[float, float] | None:
    x, y = row[f"{kind}_x_px"], row[f"{kind}_y_px"]
    return None if np.isnan(x) else (x, y)


def _difference(before: Any, after: Any) -> Any:
    return None if before is None or after is None else after - before
