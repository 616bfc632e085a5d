"""The fit of the detector's odds: the weights of two normal distributions, whose odds are known."""

import numpy as np
from scipy.stats import norm

from benchmarks.detector_fit import fitted_odds
from tracking.perception.contrast import Contrast

TARGETS = ([1.2, 0.6, 0.40, 0.05, -0.4, 0.5, 0.3], [0.2, 0.3, 0.10, 0.05, 0.2, 0.10, 0.4])
OTHERS = ([1.0, 0.2, 0.25, 0.10, -0.1, 0.6, 0.3], [0.2, 0.5, 0.10, 0.10, 0.3, 0.12, 0.4])
"""Mean and standard deviation of each feature."""


def pieces(distribution, count, rng):
    for features in rng.normal(*distribution, (count, 7)):
        out, clear, redness, greenness, lightness, aspect, red = features.tolist()
        yield Contrast(
            standing_out=np.exp(out),
            clearness=np.exp(clear),
            along=redness,
            across=greenness,
            lightness=lightness,
            aspect=np.exp(aspect),
            over_water=red,
        )


def test_odds_of_two_normal_distributions_are_found():
    """Five times as many others as targets count as many; the log odds are the difference of the log densities."""
    rng = np.random.default_rng(1)
    samples = [(piece, True) for piece in pieces(TARGETS, 4000, rng)]
    samples += [(piece, False) for piece in pieces(OTHERS, 20000, rng)]
    least, most, odds = fitted_odds(samples)
    features = np.array([piece.features() for piece in pieces(TARGETS, 300, rng)])
    features = features[((features > least) & (features < most)).all(axis=1)]
    assert len(features) > 200
    terms = np.column_stack([np.ones(len(features)), features])
    found = np.einsum("ni,ij,nj->n", terms, odds, terms)
    known = (norm.logpdf(features, *TARGETS) - norm.logpdf(features, *OTHERS)).sum(axis=1)
    # Spread over 10; what the ends of the features cost, and the ridge, are a tenth of that.
    assert np.ptp(known) > 10
    assert np.abs(found - known).mean() < 0.4
    assert abs((found - known).mean()) < 0.2
