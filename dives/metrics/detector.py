"""The detector against ground truth: precision, recall and F1, of pixels and of frames."""

from __future__ import annotations

import numpy as np

from dives.metrics.frames import Frames

DETECTOR_DEFINITIONS = {
    "pixel_precision": "of the pixels in the detector's masks, how many show the target; all frames, pixels pooled",
    "pixel_recall": "of the target's pixels in the crops, how many are in the detector's masks",
    "pixel_f1": "harmonic mean of pixel_precision and pixel_recall",
    "frame_precision": "of the frames with a detection, in how many its mask meets the target",
    "frame_recall": "of the frames with the target in the crop, in how many a detection's mask meets it",
    "frame_f1": "harmonic mean of frame_precision and frame_recall",
    "frames_with_target": "frames with at least one pixel of the target in the crop",
    "frames_detected": "frames with a detection",
    "frames_found": "frames with a detection whose mask meets the target",
}


def detector_metrics(frames: Frames) -> dict[str, object]:
    """Everything of `DETECTOR_DEFINITIONS`; None where nothing was there to be found or nothing was found."""
    true, found, both = (np.nansum(frames.numbers[f"detector_{name}_px"]) for name in ("true", "found", "both"))
    with_target = int((frames.numbers["detector_true_px"] > 0).sum())
    detected, hits = int(frames.detected.sum()), int(frames.found.sum())
    return {
        **_rates("pixel", float(both), of_found=float(found), of_true=float(true)),
        **_rates("frame", hits, of_found=detected, of_true=with_target),
        "frames_with_target": with_target,
        "frames_detected": detected,
        "frames_found": hits,
    }


def _rates(name: str, both: float, *, of_found: float, of_true: float) -> dict[str, object]:
    whole = of_found + of_true
    return {
        f"{name}_precision": both / of_found if of_found > 0 else None,
        f"{name}_recall": both / of_true if of_true > 0 else None,
        f"{name}_f1": 2 * both / whole if whole > 0 else None,
    }
