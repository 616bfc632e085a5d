"""How a body that the waves move sways: a damped oscillation that noise keeps going.

In the wave band the motion of a vessel is a resonance driven by white noise (Fossen, Handbook of Marine Craft
Hydrodynamics and Motion Control, 2011, section 8.2.2): displacement x with x'' + 2 z w x' + w² x = w(t), whose standing
covariance is diag(s², w² s²). Waves that are felt have periods of 4 to 10 s.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from optics.kernels.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class Sway:
    """A damped oscillation on each axis.

    Attributes
    ----------
    deviation_deg : float
        Standard deviation of what it adds to a direction.
    period_s : float
        Of the oscillation without damping.
    damping : float
        Of the critical one, below 1: how far real periods are spread about that one.
    """

    deviation_deg: float = 2.5
    period_s: float = 6.0
    damping: float = 0.2

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"expected {name} above 0, got {value}")
        if self.damping >= 1:
            raise ValueError(f"expected damping below 1, got {self.damping}")

    @property
    def _frequency(self) -> float:
        return 2 * math.pi / self.period_s

    @property
    def covariance(self) -> FloatArray:
        """Of displacement and its rate when nothing is known of them, shape (2, 2); rad², per second and second²."""
        deviation = math.radians(self.deviation_deg)
        return np.diag([deviation, self._frequency * deviation]) ** 2

    def transition(self, seconds: float) -> FloatArray:
        """What takes displacement and rate to those expected some seconds later, shape (2, 2)."""
        decay = self.damping * self._frequency
        damped = self._frequency * math.sqrt(1 - self.damping**2)
        cosine, sine = math.cos(damped * seconds), math.sin(damped * seconds) / damped
        return math.exp(-decay * seconds) * np.array(
            [[cosine + decay * sine, sine], [-(self._frequency**2) * sine, cosine - decay * sine]]
        )

    def process_noise(self, seconds: float) -> FloatArray:
        """Covariance that the noise adds within some seconds, shape (2, 2): what keeps `covariance` as it is."""
        transition = self.transition(seconds)
        return self.covariance - transition @ self.covariance @ transition.T
