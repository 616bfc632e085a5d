"""The loop over any camera and any mirrors: recorded video with recorded joints, or the real thing."""

from __future__ import annotations

import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from rigs import Rig
from tracking.loop.loop import TrackingLoop
from tracking.loop.track_files import TrackFiles
from tracking.loop.variants import VARIANTS, Variant
from tracking.perception import DETECTORS, RED_BALL, DetectorSettings
from tracking.perception.learned import LEARNED
from tracking.protocols import CameraFrame, MirrorDriver
from tracking.records import Mode

Progress = Callable[[int], None]
Clock = Callable[[], float]


class CountingCamera(Protocol):
    """A camera that counts what it could not give."""

    skipped: int

    @property
    def missing(self) -> int:
        """Images that should have been there and were not."""

    def read(self) -> CameraFrame | None:
        """Next image; None when there will be no more."""


@dataclass(frozen=True, kw_only=True)
class Tracked:
    """What happened in a run of the loop.

    Attributes
    ----------
    images : int
    detected : int
        Images in which a blob was found.
    modes : dict of str to int
        Images in each state of figure 12.
    first_s, last_s : float
        Times of the first and the last image.
    skipped : int
        Images that could not be read.
    missing : int
        Images that should have been there by the time stamps, and were not.
    interrupted : bool
        Whether it was stopped before the camera's end.
    wall_s : float
        How long it took; not part of what is written.
    """

    images: int
    detected: int
    modes: dict[str, int]
    first_s: float
    last_s: float
    skipped: int
    missing: int
    interrupted: bool
    wall_s: float

    @property
    def frames_per_s(self) -> float:
        """Images a second, with overlay and log."""
        return self.images / self.wall_s

    def as_dict(self) -> dict[str, Any]:
        """All but what depends on the machine."""
        return {name: value for name, value in asdict(self).items() if name != "wall_s"}


def track(
    camera: CountingCamera,
    mirrors: MirrorDriver,
    loop: TrackingLoop,
    folder: Path,
    *,
    rig: Rig,
    about: dict[str, Any],
    clock: Clock | None = None,
    progress: Progress,
    stopped: Callable[[], bool],
) -> Tracked:
    """Run the loop until the camera ends or somebody stops it; write log, overlay video and a summary.

    Whatever happens on the way, what there is by then is finished and put in place.

    Parameters
    ----------
    camera : CountingCamera
    mirrors : MirrorDriver
    loop : TrackingLoop
    folder : Path
        New, empty, or of an earlier run.
    rig : Rig
        Whose camera's images they must be.
    about : dict
        What the summary says besides: where images and joints came from.
    clock : callable, optional
        The camera's clock, seconds: when a command goes out. By default at the time of the image.
    progress : callable
        Takes the number of images so far.
    stopped : callable
        Whether to stop before the next image.

    Raises
    ------
    ValueError
        When there is no image, or one of another size than the rig's.
    FileExistsError
        When the folder holds something else.
    """
    camera_frame = camera.read()
    if camera_frame is None:
        raise ValueError(f"{about['source']}: expected at least one image, got none that can be read")
    _check_size(camera_frame, rig, about)
    files = TrackFiles(folder)
    modes: Counter[Mode] = Counter()
    detected, first_s, last_s = 0, camera_frame.time_s, camera_frame.time_s
    start = time.perf_counter()

    def tracked(*, interrupted: bool) -> Tracked:
        return Tracked(
            images=modes.total(),
            detected=detected,
            modes={str(mode): modes[mode] for mode in Mode},
            first_s=first_s,
            last_s=last_s,
            skipped=camera.skipped,
            missing=camera.missing,
            interrupted=interrupted,
            wall_s=time.perf_counter() - start,
        )

    result = None
    try:
        while camera_frame is not None and not stopped():
            _check_size(camera_frame, rig, about)
            step = loop.step(camera_frame, mirrors.report(camera_frame.time_s))
            mirrors.command(step.q_command, camera_frame.time_s if clock is None else clock())
            files.write(camera_frame, step)
            modes[step.mode] += 1
            detected += bool(step.detection.blobs)
            last_s = camera_frame.time_s
            progress(modes.total())
            camera_frame = camera.read()
        result = tracked(interrupted=camera_frame is not None)
    finally:
        files.finish(about | (result or tracked(interrupted=True)).as_dict())
    return result


def variant_named(name: str, *, turning: bool) -> Variant:
    """The loop of a name; where no mirror is turned, without the functional check, during which it would not look.

    Raises
    ------
    ValueError
        When there is none of that name.
    """
    if name not in VARIANTS:
        raise ValueError(f"variant {name!r}: expected one of {', '.join(VARIANTS)}")
    return VARIANTS[name] if turning else VARIANTS[name].without_check()


def detector_named(name: str) -> DetectorSettings:
    """What a target of a name looks like, or ``onnx:FILE`` tells; `ValueError` when there is none of that name."""
    if name.startswith(LEARNED):
        return replace(RED_BALL, onnx=name.removeprefix(LEARNED))
    if name not in DETECTORS:
        raise ValueError(f"detector {name!r}: expected one of {', '.join(DETECTORS)}, {LEARNED}FILE")
    return DETECTORS[name]


@contextmanager
def until_interrupted() -> Iterator[Callable[[], bool]]:
    """Gives a function that says whether Ctrl-C was pressed; the second time it interrupts as always."""
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set  # only the main thread hears of signals
        return

    def note(*_: object) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def _check_size(camera_frame: CameraFrame, rig: Rig, about: dict[str, Any]) -> None:
    height, width = camera_frame.image.shape[:2]
    if (width, height) != (rig.camera.width_px, rig.camera.height_px):
        raise ValueError(
            f"{about['source']}: expected images of {rig.camera.width_px} x {rig.camera.height_px} px as rig "
            f"{rig.name!r} has them, got {width} x {height}"
        )
