"""The transfer curve of sRGB, in which images are stored and shown."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def srgb_encode(linear: ArrayLike) -> NDArray[np.float64]:
    """Transfer curve of sRGB (IEC 61966-2-1) for linear values from 0 to 1."""
    linear = np.asarray(linear, dtype=np.float64)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def srgb_decode(encoded: ArrayLike) -> NDArray[np.float64]:
    """Linear values of sRGB values from 0 to 1; the inverse of `srgb_encode`."""
    encoded = np.asarray(encoded, dtype=np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
