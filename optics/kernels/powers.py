"""Kernels of powers: cheaper than Dr.Jit's own where a few millionths of the value do not matter."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.backend import Float32, UInt32, dr

POWER_OF_TWO = (0.999999236, 0.693121734, 0.240247667, 0.0559182479, 0.00956967494)
"""Polynomial of degree 4 for ``2^x``, |x| <= 1/2, whose largest relative error is least: 2.6e-6."""

LEAST_EXPONENT = -126.0
"""The smallest power of two that is a normal number of single precision."""


def power_of_two(exponent: Any) -> Any:
    """``2^x`` to 3e-6 for |x| < 126, in half the time of Dr.Jit's: the whole part becomes the exponent's bits."""
    whole = dr.round(exponent)
    rest = exponent - whole
    result = POWER_OF_TWO[-1]
    for coefficient in POWER_OF_TWO[-2::-1]:
        result = dr.fma(rest, result, coefficient)
    return result * dr.reinterpret_array(Float32, UInt32(whole + 127) << 23)


def decay(depth: Any) -> Any:
    """``exp(-depth)`` of an optical depth above -87, to 3e-6 up to 10 (single precision rounds larger ones)."""
    return power_of_two(dr.maximum(depth * -np.log2(np.e), LEAST_EXPONENT))
