"""Which corners of the gaze mirror a loop goes by: the exact train's, or the paper's eq. 6 on samples of them."""

from __future__ import annotations

import numpy as np

from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.loop.variants import Variant
from tracking.perception import CornerModel, CornerSamples, InverseDistanceCorners
from tracking.perception.corners.exact import corners_of

SAMPLE_GRID = 7
"""Poses a joint at which the exact corners are taken when eq. 6 has no samples of its own."""


def corner_model(rig: Rig, variant: Variant, samples: CornerSamples | None, gimbal: Gimbal) -> CornerModel:
    """Corners of a rig's gaze mirror as a variant has them, with the samples that were taken, if any."""
    exact = corners_of(rig)
    if variant.corners == "exact":
        return exact
    if samples is None:
        axes = [np.linspace(low, high, SAMPLE_GRID) for low, high in zip(gimbal.lowest, gimbal.highest, strict=True)]
        q = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        corners = exact.corners(q)
        seen = np.isfinite(corners).all(axis=(1, 2))
        samples = CornerSamples(q=q[seen], corners_px=corners[seen])
    return InverseDistanceCorners(samples=samples)
