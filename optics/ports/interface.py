"""What all ports share: the window between the camera's air and the water, in the camera frame (pinhole at the origin).

`trace` follows rays from the pinhole out into the water; `project` is its inverse: the direction at the pinhole whose
refracted ray passes through a given point in the water.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

from optics.kernels.arrays import opaque
from optics.kernels.backend import Bool, UInt32, dr

NEWTON_TOLERANCE = 1e-13
"""Relative step under which the root counts as found."""

NEWTON_STEPS = 12
"""Newton steps of `project` at most; four to six converge anywhere inside the field of view of a real port."""


@dataclass(frozen=True, kw_only=True)
class Exit:
    """Rays behind the port: Dr.Jit arrays.

    `point` (metres) on the outer face, unit `direction` in the water, `inside` whether the ray is within the
    aperture, `transmitted` whether it was not totally reflected, `transmittance` Fresnel's for both faces together
    (without the light that is reflected twice inside the window), 0 for rays that do not get out.
    """

    point: Any
    direction: Any
    inside: Any
    transmitted: Any
    transmittance: Any


def newton(start: tuple[Any, ...], improved: Callable[..., tuple[tuple[Any, ...], Any]]) -> tuple[tuple[Any, ...], Any]:
    """Kernel: steps of Newton's method until each lane has its root.

    Parameters
    ----------
    start : tuple of arrays
        First guess.
    improved : callable
        From a guess to the next one, and whether its step was too small to matter.

    Returns
    -------
    root : tuple of arrays
    converged : bool array
        False where `NEWTON_STEPS` were not enough.
    """

    def step(steps: Any, converged: Any, *guess: Any) -> tuple[Any, ...]:
        better, converged = improved(*guess)
        return steps + 1, converged, *better

    # The loop is left by the lanes of a vector together, most often after four steps.
    width = dr.width(start)
    _, converged, *root = dr.while_loop(
        (dr.zeros(UInt32, width), dr.zeros(Bool, width), *start),
        lambda steps, converged, *_: ~converged & (steps < NEWTON_STEPS),
        step,
        # Differentiated backwards, a loop keeps what each turn began with.
        max_iterations=NEWTON_STEPS,
    )
    return tuple(root), converged


class Port(ABC):
    """What all ports share."""

    n_inside: float
    n_water: float

    @abstractmethod
    def parameters(self) -> dict[str, Any]:
        """Numbers of the port for the kernels, as Dr.Jit scalars and vectors."""

    def without_rim(self) -> Self:
        """The same port with an unbounded aperture."""
        return self

    @staticmethod
    @abstractmethod
    def trace(parameters: dict[str, Any], direction: Any) -> Exit:
        """Kernel: follow unit directions from the pinhole into the water."""

    @staticmethod
    @abstractmethod
    def project(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: unit direction at the pinhole towards a point in the water, as seen through the port.

        Returns the direction, whether the root converged, and whether the point is in the water at all.
        """


@dataclass(frozen=True, kw_only=True)
class Window(Port):
    """What ports with a window share; lengths and indices are positive.

    Parameters
    ----------
    thickness_m : float
    n_inside, n_port, n_water : float
    aperture_radius_m : float, optional
        Clear radius; None: unbounded.
    """

    thickness_m: float
    n_inside: float = 1.0
    n_port: float = 1.49
    n_water: float = 1.333
    aperture_radius_m: float | None = None

    def __post_init__(self) -> None:
        check_positive(self, "thickness_m", "n_inside", "n_port", "n_water", "aperture_radius_m")

    def without_rim(self) -> Self:
        """The same port with an unbounded aperture."""
        return replace(self, aperture_radius_m=None)

    def parameters(self) -> dict[str, Any]:
        """Numbers that all windows have; with the ratios at both faces: a kernel would divide again for every ray."""
        return {
            "n_inside": opaque(self.n_inside),
            "n_port": opaque(self.n_port),
            "n_water": opaque(self.n_water),
            "ratio_in": opaque(self.n_inside / self.n_port),
            "ratio_out": opaque(self.n_port / self.n_water),
            "aperture": opaque(self.aperture_radius_m or float("inf")),
        }


def check_positive(port: Any, *names: str) -> None:
    """Raise a `ValueError` for a field that is neither None nor a positive finite number."""
    for name in names:
        value = getattr(port, name)
        if value is not None and not (0 < value < float("inf")):
            raise ValueError(f"expected {name} > 0, got {value}")
