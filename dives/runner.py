"""A dive on a simulated clock: expose, look, decide, command, and write down what was true.

Image k is exposed about t_k = k / frame rate. The loop gets it with what the driver knows of the mirrors at t_k, and
its command arrives a control latency after the last row was closed. The mirrors move on by themselves.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray
from pydantic.main import IncEx

from cad.assembly.meshes import rig_meshes
from dives.dive import Dive
from dives.files import finish_dive, is_finished
from dives.ground_truth_columns import GroundTruthColumns
from dives.journal import Journal
from dives.known_target import with_known_target, without_colour
from dives.looked_at import pixels_around, with_margin
from dives.named_files import digests
from dives.paths import attitude_sensor
from dives.recorder import Recorder
from dives.rendered_camera import RenderedCamera
from dives.timed_mirrors import TimedMirrors
from dives.views.direct_view import direct_view
from dives.views.robot_view import robot_view
from optics.mesh import PartMesh
from optics.workers.threads import resting_threads
from rigs import Rig
from scenes.baking.light_quality import LightQuality, light_identity, light_marks
from tracking.log import Row, joint_columns, loop_columns
from tracking.loop.loop import TrackingLoop
from tracking.mirrors.simulated import SimulatedMirrors
from tracking.protocols import CameraFrame, MirrorReport
from tracking.records import Step

Log = Callable[[str], None]
Progress = Callable[[int, int], None]


class DiveStoppedError(RuntimeError):
    """A dive that could not be finished; what was finished of it is kept."""


@dataclass(frozen=True, kw_only=True)
class FrameRecord:
    """One image with what the loop made of it, and the log's row."""

    camera_frame: CameraFrame
    step: Step
    row: Row


class ClosedLoop:
    """Camera, loop, mirrors and, where there is one, attitude sensor of a dive, on one clock.

    Parameters
    ----------
    dive : Dive
    rig : Rig
        The dive's (`Dive.load_rig`).
    parts : sequence of PartMesh
        Hull and mount; may be empty.
    quality : LightQuality, optional
        Of the light in the images, full by default.

    Attributes
    ----------
    whole_images : bool
        Whether somebody else than the loop looks at the images: a video, or the overlay. If not, only what the loop
        looks at is rendered.
    seconds : dict of str to float
        Time spent in each part so far.
    """

    def __init__(self, dive: Dive, rig: Rig, parts: Sequence[PartMesh], quality: LightQuality | None = None):
        settings = dive.detector_settings()
        self.dive = dive
        self.whole_images = dive.video != "none" or dive.overlay
        self.mirrors = TimedMirrors(SimulatedMirrors.from_rig(rig, seed=dive.seed, checked=not dive.functional_check))
        self.camera = RenderedCamera(dive, rig, parts, self.mirrors, quality)
        self.attitude = attitude_sensor(dive)
        variant = dive.loop_variant()
        view = robot_view(rig, parts) if variant.ignores_robot else None
        past_mirrors = direct_view(rig, parts) if variant.direct_view else None
        self.loop = TrackingLoop(rig, variant, detector=settings, robot_view=view, direct_view=past_mirrors)
        size = (rig.camera.width_px, rig.camera.height_px)
        self._past_mirrors = None if past_mirrors is None else with_margin(past_mirrors.pixels(*size))
        target = self.camera.renderer.scene.target
        assert target is not None  # a dive's scene has one
        self.truth = GroundTruthColumns(rig, target.shape, settings)
        self.seconds = dict.fromkeys(("camera", "loop", "truth"), 0.0)

    def next(self) -> FrameRecord | None:
        """Take the next image and act on it; None when the dive is over."""
        time_s = self.camera.next_time_s
        if time_s is None:
            return None
        clock = [time.perf_counter()]
        report = self.mirrors.report(time_s)
        attitude = None if self.attitude is None else self.attitude.report(time_s)
        camera_frame = self.camera.read(None if self.whole_images else self._looked_at(report))
        exposure = self.camera.exposure
        assert camera_frame is not None and exposure is not None  # there is a next image
        clock.append(time.perf_counter())
        step = self.loop.step(camera_frame, report, attitude)
        self.mirrors.command(step.q_command, exposure.end_s + self.dive.control_latency_ms / 1000)
        clock.append(time.perf_counter())
        q = self.mirrors.q(np.array([exposure.start_s, exposure.end_s]))
        rows = self.mirrors.q(exposure.rows_s)
        state = exposure.state
        speed = (q[1] - q[0]) / (exposure.end_s - exposure.start_s)
        row: Row = {
            "frame": exposure.frame,
            "exposure_s": exposure.settings.exposure_s,
            "gain_db": exposure.settings.gain_db,
            **loop_columns(step, np.array([state.q1, state.q2])),
            **joint_columns("first_row", rows[0]),
            **joint_columns("last_row", rows[1]),
            **self.truth.of(exposure, step, speed),
        }
        clock.append(time.perf_counter())
        for name, took in zip(self.seconds, np.diff(clock).tolist(), strict=True):
            self.seconds[name] += took
        return FrameRecord(camera_frame=camera_frame, step=step, row=row)

    def _looked_at(self, report: MirrorReport) -> NDArray[np.bool_]:
        """Pixels at which loop and ground truth will look in the next image."""
        (q,) = self.mirrors.q(np.array([report.time_s]))
        outlines = [self.loop.corners_px(report), self.truth.corners_px(q)]
        gaze = pixels_around(outlines, self.camera.renderer.shape[::-1])
        if self._past_mirrors is None or not self.loop.looks_past_mirrors(report.time_s):
            return gaze
        return gaze | self._past_mirrors

    def snapshot(self) -> dict[str, Any]:
        """State of all parts, as JSON holds it."""
        return {part: getattr(self, part).snapshot() for part in ("mirrors", "camera", "loop")}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a state."""
        for part, state in snapshot.items():
            getattr(self, part).restore(state)


def run_dive(
    dive: Dive,
    folder: str | Path,
    *,
    rig: Rig | None = None,
    quality: LightQuality | None = None,
    log: Log = lambda sentence: None,
    progress: Progress = lambda done, total: None,
) -> Path:
    """Make a dive, or go on with one that was stopped; the files do not tell the difference.

    Parameters
    ----------
    dive : Dive
    folder : str or Path
        Gets log.parquet, video.mkv or frames/, overlay.mp4, metrics.json, dive.toml and rig.toml; made when it is not
        there.
    rig : Rig, optional
        Instead of the one that the dive names.
    quality : LightQuality, optional
        Of the light in the images, full by default.
    log : callable, optional
        Gets sentences about what is going on.
    progress : callable, optional
        Gets the images done and to do.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    DiveStoppedError
        When an image could not be made or written; what was finished is kept, and the same call goes on from there.
    ValueError
        When the folder holds another dive, or another process is writing into it.
    """
    folder = Path(folder)
    rig = dive.load_rig() if rig is None else dive.at_frame_rate(rig)
    dive = with_known_target(dive, rig)
    identity = identity_of(dive, rig, quality)
    if is_finished(folder, identity):
        log(f"{folder}: this dive is finished already")
        return folder
    if told := without_colour(dive):
        log(told)
    with closing(Journal(folder, identity)) as journal:
        try:
            if journal.frames < dive.frames:
                _record(dive, rig, quality, folder, journal, log=log, progress=progress)
            finish_dive(dive, rig, folder, journal, identity, light=light_marks(quality))
        except (OSError, ValueError, MemoryError, av.FFmpegError) as error:
            kept = min(journal.frames, dive.frames)
            raise DiveStoppedError(
                f"{folder}: the dive was stopped: {error}. {kept} of {dive.frames} frames are kept; "
                "the same command goes on from there"
            ) from error
    return folder


NOT_SEEN: Mapping[str, IncEx | bool] = {
    "requirements": True,
    "revision": True,
    "gaze": {"mount": {"printer"}, "servos": {"when_silent", "silent_after_s"}},
}
"""What of a rig file changes no frame."""


def identity_of(dive: Dive, rig: Rig, quality: LightQuality | None = None) -> str:
    """Digest of everything a dive's bytes come from, but for the code."""
    # What is asked of a dive changes no frame.
    asked = dive.model_dump(mode="json", exclude={"limits"})
    numbers = [asked, rig.model_dump(mode="json", exclude=NOT_SEEN), digests(dive), *light_identity(quality)]
    content = json.dumps(numbers, sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()


def _record(
    dive: Dive,
    rig: Rig,
    quality: LightQuality | None,
    folder: Path,
    journal: Journal,
    *,
    log: Log,
    progress: Progress,
) -> None:
    """Make the segments that are not there yet."""
    first = journal.frames
    if first:
        log(f"{folder}: going on from frame {first} of {dive.frames}")
    closed = ClosedLoop(dive, rig, rig_meshes(rig), quality)
    state = journal.snapshot()
    if state is not None:
        closed.restore(state)
    recorder = Recorder(dive, folder, journal)
    started = time.perf_counter()
    try:
        with resting_threads():
            for done in range(first + 1, dive.frames + 1):
                record = closed.next()
                assert record is not None  # the dive has that many images
                recorder.add(record.camera_frame, record.step, record.row)
                if journal.ends_segment(done) or done == dive.frames:
                    recorder.finish_segment(json.dumps(closed.snapshot()))
                progress(done, dive.frames)
    except BaseException:
        recorder.abandon()
        raise
    recorder.close()
    log(_timing(closed, dive.frames - first, time.perf_counter() - started))


def _timing(closed: ClosedLoop, frames: int, elapsed_s: float) -> str:
    spent = dict(closed.seconds)
    spent["waiting for the recorder"] = elapsed_s - sum(spent.values())
    parts = ", ".join(f"{name} {1000 * seconds / frames:.1f} ms" for name, seconds in spent.items())
    return f"{frames} frames in {elapsed_s:.1f} s, {frames / elapsed_s:.1f} frames/s: {parts} each"
