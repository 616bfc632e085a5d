"""By what targets of each colour stand out under water, and the odds of a piece that does.

White balance, gain and exposure are constants in the logarithm of light, and the difference from the surroundings is
free of them. A colour stands out *along* a sum of the channels' logarithms: red by ``ln R - (ln G + ln B) / 2``;
yellow, which keeps its green when the water has taken the red, by ``(ln R + ln G) / 2 - ln B``. Blue, grey and black
balls stand out along none: water is blue, grey and black as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

Weights = tuple[float, float, float]
"""Of the logarithms of red, green and blue light."""

ALONG, ACROSS = 2, 3
"""Of `tracking.perception.contrast.Contrast.features`, counted from 0."""

DARKER: Weights = (0.0, -1.0, 0.0)
"""Along which a thing before the sun stands out, of which no colour is left."""


@dataclass(frozen=True, kw_only=True)
class TargetColour:
    """What tells a target of one colour.

    Attributes
    ----------
    along : tuple
        By which it stands out.
    across : tuple
        The other difference of colours that is weighed.
    over_water : tuple
        What is known before a dive of how it stands out from near by: weights of its inherent contrasts
        (`scenes.light.inherent_contrast`).
    most_across : float, optional
        Of across to along, that of a cell of a piece.
    plain_from : float
        What the water must leave of a target (`tracking.perception.DetectorSettings.over_water`) so that it looks as
        plainly like one as in clear water: infinite where that is not known.
    least, most : tuple of 7
        Of `Contrast.features`, which 98 of 100 pieces keep: beyond, the odds do not go on.
    odds : tuple of 8 rows
        Weights of 1 and the features, two by two, in the natural logarithm of the odds.
    """

    along: Weights
    across: Weights
    over_water: Weights
    most_across: float | None = None
    plain_from: float = math.inf
    least: tuple[float, ...]
    most: tuple[float, ...]
    odds: tuple[tuple[float, ...], ...]

    @cached_property
    def contrasts(self) -> NDArray[np.float32]:
        """Matrix of `contrast_matrix`, shape (4, 5)."""
        return contrast_matrix(self.along, self.across)

    def log_odds(self, features: FloatArray) -> float:
        """Natural logarithm of the odds of features, shape (7,), as many pieces being targets as not.

        What stands out by more than any piece that the odds were fitted to is judged as one of its hue that does as
        much: less water fades along and across alike.
        """
        least, most, odds = self._arrays
        weighed = np.ones(len(odds))
        weighed[1:] = features
        weighed[1 + ACROSS] *= most[ALONG] / max(features[ALONG], most[ALONG])
        weighed[1:] = np.clip(weighed[1:], least, most)
        return float(weighed @ odds @ weighed)

    @cached_property
    def _arrays(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return np.array(self.least), np.array(self.most), np.array(self.odds)


def contrast_matrix(along: Weights, across: Weights) -> NDArray[np.float32]:
    """Along, across, lightness and 1 of the logarithms of red, green, blue and alpha, shape (4, 5).

    Alpha counts nothing, but OpenCV makes four channels of four in a sixth of the time that it needs to make them of
    three.
    """
    return np.array([[*along, 0, 0], [*across, 0, 0], [0, 1, 0, 0, 0], [0, 0, 0, 0, 1]], dtype=np.float32)


# Fitted: red on stills of the arena and of the detector's table, the others on stills with balls of every colour
# (`./run bench detector --fit`, `--fit --colour yellow`).
RED = TargetColour(
    along=(1.0, -0.5, -0.5),
    across=(0.0, 1.0, -1.0),
    over_water=(1.0, 0.0, 0.0),
    most_across=0.4,
    plain_from=0.72,
    least=(0.02, -2.3, 0, -0.34, -1.53, 0, -0.89),
    most=(2.3, 2.3, 1.01, 0.48, 0.92, 2.43, 1.46),
    odds=(
        (-3.7, 0.54, 0.76, -5.91, -4.1, -9.12, 2.22, -0.51),
        (0, 0.01, 0.67, 3.34, -6.84, 1.29, -0.42, -0.36),
        (0, 0, -0.15, -3.83, 10.97, 0, 0.17, -0.44),
        (0, 0, 0, 27.86, 3.43, -3.74, -3.13, 1.18),
        (0, 0, 0, 0, -107.11, 15.9, -1.23, 4.05),
        (0, 0, 0, 0, 0, -3.73, -1.33, 0.16),
        (0, 0, 0, 0, 0, 0, -2.73, 0.14),
        (0, 0, 0, 0, 0, 0, 0, -1.64),
    ),
)

ORANGE = TargetColour(
    along=(0.75, 0.25, -1.0),
    across=(-0.5, 1.0, -0.5),
    over_water=(0.75, 0.25, -1.0),
    least=(0.03, -1.55, 0.02, -0.31, -1.29, 0, 1.56),
    most=(2.3, 2.3, 1.36, 0.37, 1.15, 2.56, 2.73),
    odds=(
        (2.37, -2.04, 0.75, 7.74, -64.57, -0.46, 0.46, -5.01),
        (0, 1.5, -0.21, 1.18, 0.2, 0.87, -1.12, -0.01),
        (0, 0, 0.61, -4.18, 12.86, -0.67, 0.87, -0.05),
        (0, 0, 0, 0.4, -29.31, 10.7, -3.72, 4.92),
        (0, 0, 0, 0, -147.65, 15.91, -8.41, 26.1),
        (0, 0, 0, 0, 0, -2.4, -0.36, -3.96),
        (0, 0, 0, 0, 0, 0, -1.78, 1.22),
        (0, 0, 0, 0, 0, 0, 0, -0.31),
    ),
)

YELLOW = TargetColour(
    along=(0.5, 0.5, -1.0),
    across=(1.0, -1.0, 0.0),
    over_water=(0.5, 0.5, -1.0),
    least=(0.02, -1.54, 0.02, -0.19, -1.29, 0, 1.46),
    most=(2.3, 2.3, 1.26, 0.8, 1.17, 2.51, 2.48),
    odds=(
        (-13.6, 1.76, 3.02, 9.29, -27.93, 0.17, -0.87, 7.72),
        (0, 0.32, -0.47, -2.29, 12.42, -1.88, 0.62, -0.99),
        (0, 0, 0.09, -2.04, 7, -1.29, -0.16, -0.54),
        (0, 0, 0, -7.93, 46.82, 0.46, -5.13, 5.03),
        (0, 0, 0, 0, -104.57, 23.3, -0.37, 0.52),
        (0, 0, 0, 0, 0, -1.15, 0.64, -0.1),
        (0, 0, 0, 0, 0, 0, -1.64, 2.34),
        (0, 0, 0, 0, 0, 0, 0, -2.6),
    ),
)

GREEN = TargetColour(
    along=(0.5, 0.5, -1.0),
    across=(1.0, -1.0, 0.0),
    over_water=(0.5, 0.5, -1.0),
    least=(0.02, -1.54, 0.02, -0.19, -1.29, 0, 0.59),
    most=(2.3, 2.3, 1.26, 0.8, 1.17, 2.51, 1.45),
    odds=(
        (-12.07, 0.33, 5.83, -2.66, -40.41, -1.94, 2.09, 15.95),
        (0, 0.14, 0.31, -2.07, -0.8, 0.79, 0.17, 0.96),
        (0, 0, -0.51, 2.95, 6.35, -2.19, -1.94, -3.66),
        (0, 0, 0, -14.32, 21.66, 11.84, -0.1, 15.92),
        (0, 0, 0, 0, -38.82, 2.18, 17.34, -6.16),
        (0, 0, 0, 0, 0, -1.45, -0.27, -1.51),
        (0, 0, 0, 0, 0, 0, -1.52, 1.37),
        (0, 0, 0, 0, 0, 0, 0, -9.15),
    ),
)

WHITE = TargetColour(
    along=(1 / 3, 1 / 3, 1 / 3),
    across=(0.5, 0.5, -1.0),
    over_water=(1 / 3, 1 / 3, 1 / 3),
    least=(0.06, -0.82, 0.04, -0.55, 0.03, 0, 1.14),
    most=(2.3, 2.3, 1.44, 1.21, 1.54, 2.64, 1.99),
    odds=(
        (1.28, 1.06, 2.67, 9, 1.98, -8.96, -0.54, -6.93),
        (0, -0.6, 0.46, -1.73, -5.87, 5.33, -1.14, 0.56),
        (0, 0, -0.73, 0.71, 1.86, 3.51, -0.55, -2.06),
        (0, 0, 0, 1.6, -1.99, -0.65, -3.53, 3.66),
        (0, 0, 0, 0, -22.39, 5.73, -0.84, 5.16),
        (0, 0, 0, 0, 0, -7.47, 3.51, -1.77),
        (0, 0, 0, 0, 0, 0, -1.27, 2.41),
        (0, 0, 0, 0, 0, 0, 0, 1.47),
    ),
)

TARGET_COLOURS = {"red": RED, "orange": ORANGE, "yellow": YELLOW, "green": GREEN, "white": WHITE}
"""By the names of `dives.specification.BallColour`."""
