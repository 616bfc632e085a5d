"""How the numbers of recorded episodes are spread, as LeRobot's `meta/stats.json` tells it, quantiles included."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)


def array_statistics(values: FloatArray) -> dict[str, Any]:
    """Of each column of an array, shape (n, d)."""
    quantiles = np.quantile(values, QUANTILES, axis=0)
    return {
        "min": values.min(axis=0).tolist(),
        "max": values.max(axis=0).tolist(),
        "mean": values.mean(axis=0).tolist(),
        "std": values.std(axis=0).tolist(),
        "count": [len(values)],
        **{_name(share): row.tolist() for share, row in zip(QUANTILES, quantiles, strict=True)},
    }


def histogram(image: NDArray[np.uint8]) -> NDArray[np.int64]:
    """How often each of 256 values comes in each channel, shape (3, 256)."""
    return np.stack([np.bincount(image[..., channel].ravel(), minlength=256) for channel in range(3)])


def histogram_statistics(counts: NDArray[np.int64], images: int) -> dict[str, Any]:
    """Of each channel from 0 to 1, by how often each of 256 values comes, shape (3, 256); arrays of shape (3, 1, 1)."""
    levels, total = np.arange(256) / 255, counts.sum(axis=1)
    mean = counts @ levels / total
    reached = np.cumsum(counts, axis=1) / total[:, np.newaxis]
    found = {"min": levels[(counts > 0).argmax(axis=1)], "max": levels[255 - (counts[:, ::-1] > 0).argmax(axis=1)]}
    found |= {"mean": mean, "std": np.sqrt(np.maximum(counts @ levels**2 / total - mean**2, 0))}
    found |= {_name(share): levels[(reached >= share).argmax(axis=1)] for share in QUANTILES}
    return {name: values.reshape(3, 1, 1).tolist() for name, values in found.items()} | {"count": [images]}


def _name(share: float) -> str:
    return f"q{round(100 * share):02d}"
