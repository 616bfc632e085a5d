"""The page of a dive: what was asked, how it went in numbers, the figures, and the key frames."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dives.metrics.frames import Frames
from dives.metrics.holding import Loss, not_found_causes
from reports.pages import content, page

NOT_DEFINED = "\N{EN DASH}"

CAPTIONS = (
    "Error in the crop on both axes, as in figure 13 of the paper; beside it where the target really was. Black: with "
    "a detection; red: without; boxes: lost by the detector.",
    "Commands to both servos, as in figure 14; beside them how far the joints were from the command of the same frame.",
    "What the paper could not give: the true angle between optical axis and target, why it was not found, the mode.",
)

OVERLAY = "overlay.mp4"
VIDEO_CAPTION = "The camera's images with the loop's crop, what it detected and how the joints stood."

Metrics = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class DiveResults:
    """What a page reports of a finished dive.

    Attributes
    ----------
    name : str
    dive : dict
        Its specification.
    metrics : dict
    story : str
        How it went, in words.
    losses : list of Loss
    looking_frames : int
        Frames in which the loop looked for the target: all after the functional check.
    figures : list of str
        One for each of `CAPTIONS`, named from the dive's folder.
    key_frames : list of tuple
        Images of the key frames, named from the dive's folder, with their captions.
    """

    name: str
    dive: dict[str, Any]
    metrics: Metrics
    story: str
    losses: list[Loss]
    looking_frames: int
    figures: list[str]
    key_frames: list[tuple[str, str]]


def dive_page(title: str, results: DiveResults, folder: Path) -> str:
    """Page of a dive as HTML, with the images of its folder embedded."""
    return page.page(title, [content.Title(name=title), dive_section(results, folder)])


def dive_section(results: DiveResults, folder: Path, *, beside: str = "") -> content.Section:
    """Section on a dive, whose images lie in its folder; `beside` is that folder's name, seen from the report's."""
    dive, metrics = results.dive, results.metrics
    return content.section(
        f"Dive: {results.name}",
        content.paragraph(dive.get("description", "")),
        content.tiles(key_numbers(metrics)),
        content.paragraph(results.story),
        *_video(results, folder, beside),
        *(content.figure(folder / file, caption) for file, caption in zip(results.figures, CAPTIONS, strict=True)),
        *_gallery(results.key_frames, folder),
        *_losses(results.losses),
        content.table(["Not found because", "Frames", "Share of frames"], _causes(results), numbers=[1, 2]),
        content.table(["The dive", ""], _facts(dive)),
    )


def key_numbers(metrics: Metrics) -> list[tuple[str, str]]:
    """Numbers that a reader looks for first, and what they are."""
    lost, back = metrics["losses"], metrics["losses_reacquired"]
    return [
        (_share(metrics["visible_fraction"]), "of the time after acquisition the target is visible"),
        (_number(metrics["gaze_error_held_rms_deg"], "°"), "RMS gaze error while held, against truth"),
        (_number(metrics["gaze_error_held_p95_deg"], "°"), "gaze error that 95 % of the held frames stay under"),
        _losses_key(lost, back),
        (_share(metrics["false_tracking_fraction"]), "of the time, functional check left out, on something else"),
        (_number(metrics["reacquisition_time_max_s"], " s"), "longest time to reacquire"),
        (_number(metrics["acquisition_time_s"], " s"), "to the acquisition, functional check included"),
        (
            f"{_share(metrics['frame_precision'])} / {_share(metrics['frame_recall'])}",
            "precision / recall of the detector over frames",
        ),
    ]


def _losses_key(lost: int | None, back: int | None) -> tuple[str, str]:
    """Losses and how many of them were made good; what was never acquired cannot be lost."""
    if lost is None:
        return "–", "losses: the target was never acquired"
    return (f"{back} of {lost}", "losses recovered") if lost else ("none", "losses")


def verdict(metrics: Metrics, frames: Frames) -> str:
    """How it went and, where it did not go well, why: in words."""
    if not metrics["acquired"]:
        return f"The target was never tracked. {_not_acquired(metrics, frames)}"
    held = f"The target was held {_share(metrics['time_on_target_fraction'])} of the time from the acquisition on"
    lost, back = metrics["losses"], metrics["losses_reacquired"]
    if not lost:
        return f"{held} and never lost."
    if lost == 1:
        story = "once and found again" if back else "once and not found again"
    else:
        story = f"{lost} times and found again {'every time' if back == lost else f'{back} times'}"
    return f"{held}. It was lost {story}. Causes: {_listed(metrics['loss_causes'])}."


def _video(results: DiveResults, folder: Path, beside: str) -> list[content.Video]:
    if not results.key_frames:
        return []
    still = folder / results.key_frames[0][0]
    return [content.Video(file=f"{beside}{OVERLAY}", still=still, caption=VIDEO_CAPTION)]


def _gallery(key_frames: list[tuple[str, str]], folder: Path) -> list[content.Gallery]:
    images = (content.figure(folder / file, caption) for file, caption in key_frames)
    return [content.gallery(images)] if key_frames else []


def _losses(found: list[Loss]) -> list[content.Table]:
    rows = [
        [f"{loss.start_s:.1f}", f"{loss.duration_s:.1f}", loss.cause, "yes" if loss.reacquired else "no"]
        for loss in found
    ]
    header = ["Lost at (s)", "For (s)", "Cause", "Recovered"]
    return [content.table(header, rows, numbers=[0, 1])] if rows else []


def _not_acquired(metrics: Metrics, frames: Frames) -> str:
    """Where the way to a track broke off: the target never came into the crop, or it did and was not found."""
    in_crop = frames.numbers["detector_true_px"] > 0
    if not in_crop.any():
        return f"It never came into the crop: {_listed(not_found_causes(frames, frames.looking))}."
    met = f"The detector met it in {metrics['frames_found']} of the {in_crop.sum()} frames that had it in the crop"
    missed = not_found_causes(frames, in_crop)
    return f"{met}; why not in the others: {_listed(missed)}." if missed else f"{met}."


def _listed(causes: dict[str, int]) -> str:
    return ", ".join(f"{cause} ({count})" for cause, count in causes.items())


def _causes(results: DiveResults) -> list[list[str]]:
    causes = results.metrics["not_found_causes_frames"]
    return [[cause, str(count), f"{count / results.looking_frames:.1%}"] for cause, count in causes.items()]


def _facts(dive: dict[str, Any]) -> list[list[str]]:
    keys = {
        "rig": "Rig",
        "world": "World",
        "depth_m": "Depth (m)",
        "jerlov_type": "Water (Jerlov type)",
        "variant": "Loop",
        "frame_rate_hz": "Frames per second",
        "duration_s": "Duration (s)",
        "control_latency_ms": "Control latency (ms)",
        "seed": "Seed",
    }
    sun = dive.get("sun", {})
    facts = [[label, str(dive[key])] for key, label in keys.items() if key in dive]
    return [*facts, ["Sun's elevation (degrees)", str(sun["elevation_deg"])]] if "elevation_deg" in sun else facts


def _share(value: float | None) -> str:
    return NOT_DEFINED if value is None else f"{value:.1%}"


def _number(value: float | None, unit: str) -> str:
    return NOT_DEFINED if value is None else f"{value:.2f}{unit}"
