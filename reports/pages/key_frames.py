"""The telling moments of a dive: acquisition, largest error, losses; and their pictures out of the overlay video."""

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
class Moment:
    """A frame worth looking at.

    Attributes
    ----------
    name : str
        Of its picture.
    frame : int
    caption : str
    """

    name: str
    frame: int
    caption: str


def telling_moments(frames: Frames) -> list[Moment]:
    """Acquisition, largest error while held, the longest losses; of a dive without acquisition what there was."""
    if frames.acquired is None:
        return _moments_without_acquisition(frames)
    moments = [_moment(frames, "acquisition", frames.acquired, "acquisition, the first frame tracked")]
    held = np.flatnonzero(frames.held & frames.after_acquisition)
    error = frames.numbers["gaze_error_deg"][held]
    if np.isfinite(error).any():
        worst = int(held[np.nanargmax(error)])
        moments.append(
            _moment(frames, "largest_error", worst, f"largest error while held, {np.nanmax(error):.1f}\N{DEGREE SIGN}")
        )
    longest = sorted(losses(frames), key=lambda loss: -loss.duration_s)[:MOST_LOSSES]
    for number, loss in enumerate(sorted(longest, key=lambda loss: loss.first), start=1):
        end = f"held again after {loss.duration_s:.1f} s" if loss.reacquired else "never held again"
        moments.append(_moment(frames, f"loss_{number}", loss.first, f"loss ({loss.cause}), {end}"))
    return moments


def save_moments(video: Path, moments: list[Moment], folder: Path) -> list[tuple[Path, str]]:
    """Take the moments' frames out of a video, one pass through it; files with their captions.

    Raises
    ------
    ValueError
        When the video cannot be read, or ends before the last of them.
    """
    wanted: dict[int, list[Moment]] = {}
    for moment in moments:
        wanted.setdefault(moment.frame, []).append(moment)
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Path] = {}
    last = max(wanted, default=-1)
    try:
        with av.open(video) as container:
            for number, frame in enumerate(container.decode(video=0)):
                for moment in wanted.get(number, []):
                    found[moment.name] = folder / f"{moment.name}.png"
                    found[moment.name].write_bytes(cv2.imencode(".png", frame.to_ndarray(format="bgr24"))[1].tobytes())
                if number >= last:
                    break
    except (av.error.FFmpegError, IndexError) as error:
        raise ValueError(f"{video}: expected a video, got one that cannot be read ({error})") from None
    if len(found) < len(moments):
        raise ValueError(f"{video}: expected at least {last + 1} frames, got fewer: it is cut short")
    return [(found[moment.name], moment.caption) for moment in moments]


def _moments_without_acquisition(frames: Frames) -> list[Moment]:
    moments = []
    detections = np.flatnonzero(frames.detected)
    if len(detections):
        moments.append(_moment(frames, "first_detection", int(detections[0]), "first detection, which led nowhere"))
    # Where most of it was seen says most about the detector.
    visible = np.where(frames.cause == "", -1, frames.numbers["target_visible_px"])
    best = int(visible.argmax())
    if visible[best] >= 0:
        what = f"not found ({frames.cause[best]}) with {visible[best]:.0f} px of the target in view"
        moments.append(_moment(frames, "not_found", best, what))
    return moments


def _moment(frames: Frames, name: str, frame: int, what: str) -> Moment:
    return Moment(name=name, frame=frame, caption=f"{frames.time_s[frame]:.1f} s: {what}")
