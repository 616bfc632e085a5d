"""How far off the loop looks and estimates: errors against ground truth, in degrees and in pixels of the crop."""

from __future__ import annotations

import numpy as np

from dives.metrics.frames import Frames, unit_vectors
from optics.kernels.arrays import FloatArray

PERCENTILES = (50, 95, 99)

ERRORS = {
    "gaze_error": "deg: angle between the true optical axis and the direction from the virtual camera's centre to the"
    " target, all frames from the acquisition on",
    "gaze_error_held": "deg: the same in frames in which the target is held",
    "crop_error": "px: distance of the target's true place in the crop from the crop's centre, where the target's"
    " centre is in the mirror, all frames from the acquisition on",
    "detected_error": "px: distance of the detected centroid from the target's true place in the crop, found frames",
    "predicted_error": "px: distance of the filter's prediction from the target's true place in the crop, frames from"
    " the acquisition on",
    "estimated_direction_error": "deg: angle between the direction to the target that the loop estimates and the true"
    " one, frames from the acquisition on in which it estimates one",
}

POINTING_DEFINITIONS = {
    f"{name}_{kind}_{definition.partition(':')[0]}": (
        f"{'root mean square' if kind == 'rms' else 'largest' if kind == 'max' else f'percentile {kind[1:]}'} of the"
        f" {name.replace('_', ' ')}:{definition.partition(':')[2]}"
    )
    for name, definition in ERRORS.items()
    for kind in ("rms", *(f"p{percentile}" for percentile in PERCENTILES), "max")
}


def pointing_metrics(frames: Frames) -> dict[str, object]:
    """Everything of `POINTING_DEFINITIONS`; None where no frame has a number."""
    numbers, after = frames.numbers, frames.after_acquisition
    true_px, centroid_px, predicted_px = (_pairs(frames, name) for name in ("true", "centroid", "predicted"))
    gaze_error = numbers["gaze_error_deg"]
    return {
        **_spread("gaze_error", "deg", gaze_error[after]),
        **_spread("gaze_error_held", "deg", gaze_error[after & frames.held]),
        **_spread("crop_error", "px", _length(true_px - crop_centre_px(frames))[after]),
        **_spread("detected_error", "px", _length(centroid_px - true_px)[frames.found]),
        **_spread("predicted_error", "px", _length(predicted_px - true_px)[after]),
        **_spread("estimated_direction_error", "deg", estimated_direction_error_deg(frames)[after]),
    }


def crop_centre_px(frames: Frames) -> FloatArray:
    """Centre of the crop, shape (2,): where eq. 11 counts errors from, read off the frames with a detection."""
    centres = (_pairs(frames, "centroid") - _pairs(frames, "error"))[frames.detected]
    finite = centres[np.isfinite(centres).all(axis=1)]
    return np.asarray(np.median(finite, axis=0)) if len(finite) else np.full(2, np.nan)


def estimated_direction_error_deg(frames: Frames) -> FloatArray:
    """Angle between the estimated and the true direction to the target, shape (n,); nan where none is estimated."""
    estimated, true = (
        unit_vectors(frames.numbers[f"{name}_azimuth_deg"], frames.numbers[f"{name}_elevation_deg"])
        for name in ("estimated", "true")
    )
    # The half chord keeps its digits at small angles, where an arc cosine has lost them.
    half_chord = 0.5 * _length(estimated - true)
    return np.asarray(np.degrees(2 * np.arcsin(np.minimum(half_chord, 1.0))))


def _pairs(frames: Frames, name: str) -> FloatArray:
    return np.stack([frames.numbers[f"{name}_x_px"], frames.numbers[f"{name}_y_px"]], axis=-1)


def _length(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt((vectors**2).sum(axis=-1)))


def _spread(name: str, unit: str, values: FloatArray) -> dict[str, object]:
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        kinds = ("rms", *(f"p{percentile}" for percentile in PERCENTILES), "max")
        return {f"{name}_{kind}_{unit}": None for kind in kinds}
    percentiles = dict(zip(PERCENTILES, np.percentile(finite, PERCENTILES), strict=True))
    return {
        f"{name}_rms_{unit}": float(np.sqrt(np.mean(finite**2))),
        **{f"{name}_p{percentile}_{unit}": float(value) for percentile, value in percentiles.items()},
        f"{name}_max_{unit}": float(finite.max()),
    }
