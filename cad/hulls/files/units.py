"""What the numbers in a hull's file mean, and whether they make a vehicle."""

from __future__ import annotations

from optics.kernels.arrays import FloatArray
from rigs import Unit

MILLIMETRES: dict[Unit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
PLAUSIBLE_MM = (100.0, 20_000.0)
"""Longest side of a vehicle, from a hand's breadth to a large submarine."""


def check_size(size_mm: FloatArray, unit: Unit | None) -> None:
    """Refuse what is too small or too large for a vehicle, with the unit that would make it one.

    Parameters
    ----------
    size_mm : array, shape (3,)
        Its sides.
    unit : str or None
        What the rig says its numbers mean; None for a file that says so itself.

    Raises
    ------
    ValueError
        When the longest side is not plausible.
    """
    longest = float(max(size_mm))
    low, high = PLAUSIBLE_MM
    if low <= longest <= high:
        return
    message = f"expected a vehicle of {length_text(low)} to {length_text(high)}, got one of {length_text(longest)}"
    if unit is None:
        raise ValueError(f"{message} in the file's own unit")
    number = longest / MILLIMETRES[unit]
    better = plausible_units(number)
    hint = " or ".join(f'unit = "{name}" would make it {length_text(number * MILLIMETRES[name])}' for name in better)
    raise ValueError(f'{message} with unit = "{unit}"' + (f"; {hint}" if hint else ""))


def plausible_units(longest: float) -> list[Unit]:
    """Units in which this longest side is that of a vehicle."""
    low, high = PLAUSIBLE_MM
    return [name for name, factor in MILLIMETRES.items() if low <= longest * factor <= high]


def length_text(length_mm: float) -> str:
    """Length in words, in metres from one metre on."""
    return f"{length_mm:.3g} mm" if length_mm < 1000 else f"{length_mm / 1000:.4g} m"
