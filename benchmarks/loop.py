"""The closed loop: perception and control alone, with rendering, a whole dive with its videos, and its memory.

The dive is the preset `spiral`. What the times are put beside is the real camera's: a loop that is slower than 30
images a second would lose some.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from cad.assembly.meshes import rig_meshes
from dives import Dive
from dives.dive import varied
from dives.runner import ClosedLoop, FrameRecord, run_dive
from dives.views.direct_view import direct_view
from dives.views.robot_view import robot_view
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import VARIANTS, Variant
from tracking.protocols import CameraFrame, MirrorReport

IMAGES = 120
WARM_UP = 10
RECORDED_FRAMES = 450
CAMERA_MS = 1000 / 30
ALLOWED_STEP_MS, ALLOWED_FRAME_MS = 2.0, 25.0
"""500 steps and 40 frames a second."""

SMALLER = 8
"""Times that the camera is smaller where memory is watched over many frames."""
SETTLED_FRAMES, MANY_FRAMES = 1000, 10_000
ALLOWED_GROWTH_MB = 32.0


def run() -> list[dict[str, Any]]:
    """Times of a step and of a frame, of a dive, and how memory grows."""
    dive = Dive.load("spiral")
    # Without the functional check the loop looks from the first image on.
    tracked = VARIANTS["default"].without_check()
    rig = dive.load_rig()
    parts = rig_meshes(rig)
    views: dict[str, Any] = {"robot_view": robot_view(rig, parts), "direct_view": direct_view(rig, parts)}
    closed = ClosedLoop(dive, rig, parts)
    closed.loop = TrackingLoop(rig, tracked, detector=dive.detector_settings(), **views)
    searched = _until_tracked(closed)
    records, frame_ms = _timed(closed, IMAGES)
    held = sum(record.step.mode == "track" for record in records)
    cases: tuple[tuple[str, Variant, dict[str, Any], list[FrameRecord]], ...] = (
        ("default, while it searches", tracked, views, searched[-IMAGES:]),
        ("default, while it tracks", tracked, views, records),
        ("paper, while it tracks", VARIANTS["paper"].without_check(), {}, records),
    )
    rows = [
        _row(
            f"perception and control, {name}, crop 320 x 240",
            _step_ms(
                TrackingLoop(rig, variant, detector=dive.detector_settings(), **views_of),
                [(record.camera_frame, closed_report(record)) for record in images],
            ),
            ALLOWED_STEP_MS,
            "ms",
            "one step without rendering; peer: what is allowed, 500 Hz",
        )
        for name, variant, views_of, images in cases
    ]
    width, height = rig.camera.width_px, rig.camera.height_px
    note = f"{1000 / frame_ms:.0f} frames/s with camera, sensor noise, truth and log; {held} of {IMAGES} tracked"
    rows += [
        _row(f"closed loop, {width} x {height}, reef", frame_ms, ALLOWED_FRAME_MS, "ms", f"{note}; peer: 40 frames/s"),
        *_dive_rows(dive),
        _memory_row(dive),
    ]
    return rows


def closed_report(record: FrameRecord) -> MirrorReport:
    """What the driver said with an image."""
    return MirrorReport(q=record.step.q_estimated, time_s=record.camera_frame.time_s, measured=False)


def _row(name: str, ours: float, peer: float, unit: str, note: str) -> dict[str, Any]:
    return {"name": name, "ours": ours, "peer": peer, "unit": unit, "ratio": peer / ours, "note": note}


def _until_tracked(closed: ClosedLoop) -> list[FrameRecord]:
    """The frame records of a dive until the loop tracks: what is timed then is what a user's dive mostly does."""
    records: list[FrameRecord] = []
    while not records or records[-1].step.mode != "track":
        record = closed.next()
        assert record is not None  # the preset's target is found
        records.append(record)
    return records


def _timed(closed: ClosedLoop, count: int) -> tuple[list[FrameRecord], float]:
    """The next frame records of a dive, and the median time of one in milliseconds."""
    records: list[FrameRecord] = []

    def take(_: int) -> None:
        record = closed.next()
        assert record is not None  # the dive is longer
        records.append(record)

    return records, statistics.median(_times_ms(take, range(count)))


def _step_ms(loop: TrackingLoop, camera_frames: list[tuple[CameraFrame, MirrorReport]]) -> float:
    """Mean time of a step, since a search looks past the mirrors in one image of six; milliseconds."""
    return statistics.fmean(_times_ms(lambda taken: loop.step(*taken), camera_frames))


def _times_ms(call: Callable[[Any], Any], arguments: Iterable[Any]) -> list[float]:
    times = []
    for argument in arguments:
        start = time.perf_counter()
        call(argument)
        times.append(time.perf_counter() - start)
    return [1000 * each for each in times[WARM_UP:]]


def _dive_rows(dive: Dive) -> list[dict[str, Any]]:
    """A dive with video, overlay and log beside its own time, and beside the same dive without video."""
    short = varied(dive, frames=RECORDED_FRAMES)
    (elapsed_s, with_video_s), (_, without_s) = (_dived(varied(short, video=video)) for video in (True, False))
    name = f"dive of {short.duration_s:.0f} s with {dive.video} video and overlay, lighting cached"
    note = f"all of it, start to files, {with_video_s:.1f} s of the processor; peer: its duration"
    fast = "processor seconds; only what the loop looks at is rendered, same log; peer: with video"
    return [
        _row(name, elapsed_s, short.duration_s, "s", note),
        _row("the same dive, --no-video", without_s, with_video_s, "s", fast),
    ]


def _dived(dive: Dive) -> tuple[float, float]:
    """Seconds of the clock and of the processor that a dive takes."""
    with tempfile.TemporaryDirectory() as folder:
        start, processor = time.perf_counter(), time.process_time()
        run_dive(dive, Path(folder) / "dive")
        return time.perf_counter() - start, time.process_time() - processor


def _memory_row(dive: Dive) -> dict[str, Any]:
    """Growth of resident memory over many frames of a small camera."""
    small = varied(dive, frames=MANY_FRAMES)
    small = small.model_copy(update={"duration_s": MANY_FRAMES / dive.frame_rate_hz, "world": "blue"})
    rig = small.load_rig()
    camera = rig.camera
    smaller = {
        "width_px": camera.width_px // SMALLER,
        "height_px": camera.height_px // SMALLER,
        "fx_px": camera.fx_px / SMALLER,
        "fy_px": camera.fy_px / SMALLER,
        # The centre of the first pixel is at (0, 0), its edge half a pixel before.
        "cx_px": (camera.cx_px + 0.5) / SMALLER - 0.5,
        "cy_px": (camera.cy_px + 0.5) / SMALLER - 0.5,
    }
    rig = rig.model_copy(update={"camera": camera.model_copy(update=smaller)})
    closed = ClosedLoop(small, rig, rig_meshes(rig))
    for _ in range(SETTLED_FRAMES):
        closed.next()
    before = _resident_mb()
    for _ in range(SETTLED_FRAMES, MANY_FRAMES):
        closed.next()
    note = f"from frame {SETTLED_FRAMES} to {MANY_FRAMES}, {before:.0f} MB at the first; peer: what is allowed"
    growth = max(_resident_mb() - before, 0.1)
    return _row("growth of memory over a long dive", growth, ALLOWED_GROWTH_MB, "MB", note)


def _resident_mb() -> float:
    """Resident memory of the process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096 / 2**20
