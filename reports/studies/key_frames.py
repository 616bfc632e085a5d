"""The key frames of a dive: acquisition, largest error, losses; and their images out of the overlay video."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np

from dives.metrics.frames import Frames
from dives.metrics.holding import losses

MOST_LOSSES = 4
"""Shown, the longest of them: a report is no film."""


@dataclass(frozen=True, kw_only=True)
class KeyFrame:
    """A frame worth looking at.

    Attributes
    ----------
    name : str
        Of its image.
    frame : int
    caption : str
    """

    name: str
    frame: int
    caption: str


def key_frames(frames: Frames) -> list[KeyFrame]:
    """Acquisition, largest error while held, the longest losses; of a dive without acquisition what there was."""
    if frames.acquired is None:
        return _without_acquisition(frames)
    keys = [_key_frame(frames, "acquisition", frames.acquired, "acquisition, the first frame tracked")]
    held = np.flatnonzero(frames.held & frames.after_acquisition)
    error = frames.numbers["gaze_error_deg"][held]
    if np.isfinite(error).any():
        worst = int(held[np.nanargmax(error)])
        keys.append(
            _key_frame(
                frames, "largest_error", worst, f"largest error while held, {np.nanmax(error):.1f}\N{DEGREE SIGN}"
            )
        )
    longest = sorted(losses(frames), key=lambda loss: -loss.duration_s)[:MOST_LOSSES]
    for number, loss in enumerate(sorted(longest, key=lambda loss: loss.first), start=1):
        end = f"held again after {loss.duration_s:.1f} s" if loss.reacquired else "never held again"
        keys.append(_key_frame(frames, f"loss_{number}", loss.first, f"loss ({loss.cause}), {end}"))
    return keys


def save_key_frames(video: Path, keys: list[KeyFrame], folder: Path) -> list[tuple[Path, str]]:
    """Take key frames out of a video, one pass through it; files with their captions.

    Raises
    ------
    ValueError
        When the video cannot be read, or ends before the last of them.
    """
    wanted: dict[int, list[KeyFrame]] = {}
    for key in keys:
        wanted.setdefault(key.frame, []).append(key)
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Path] = {}
    last = max(wanted, default=-1)
    try:
        with av.open(video) as container:
            for number, frame in enumerate(container.decode(video=0)):
                for key in wanted.get(number, []):
                    found[key.name] = folder / f"{key.name}.png"
                    found[key.name].write_bytes(cv2.imencode(".png", frame.to_ndarray(format="bgr24"))[1].tobytes())
                if number >= last:
                    break
    except (av.error.FFmpegError, IndexError) as error:
        raise ValueError(f"{video}: expected a video, got one that cannot be read ({error})") from None
    if len(found) < len(keys):
        raise ValueError(f"{video}: expected at least {last + 1} frames, got fewer: it is cut short")
    return [(found[key.name], key.caption) for key in keys]


def _without_acquisition(frames: Frames) -> list[KeyFrame]:
    keys = []
    detections = np.flatnonzero(frames.detected)
    if len(detections):
        keys.append(_key_frame(frames, "first_detection", int(detections[0]), "first detection, which led nowhere"))
    # Where most of it was seen says most about the detector.
    visible = np.where(frames.cause == "", -1, frames.numbers["target_visible_px"])
    best = int(visible.argmax())
    if visible[best] > 0:
        what = f"not found ({frames.cause[best]}) with {visible[best]:.0f} px of the target in view"
        keys.append(_key_frame(frames, "not_found", best, what))
    return keys


def _key_frame(frames: Frames, name: str, frame: int, what: str) -> KeyFrame:
    return KeyFrame(name=name, frame=frame, caption=f"{frames.time_s[frame]:.1f} s: {what}")
