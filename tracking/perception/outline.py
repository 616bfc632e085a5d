"""Whether an outline is a ball's: an ellipse, since the crop stretches a disc by another factor along each direction.

Area and second moments tell it. Of all outlines with the same second moments the ellipse has the largest area,
``4 pi sqrt(det C)`` with the covariance C of its points; any other has less of it. A square has 3 / pi = 0.955, a half
disc 0.946, a coral with a bay 0.9 and less, and so has a disc of which something hides the larger part. Noise and
smear roughen every outline, so that this is weighed like the other marks of a target and decides nothing alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from tracking.records import Blob

CELL_MOMENT = 1 / 12
"""Second moment of a cell about its middle, which sums over the middles leave out."""

LEAST_MISSING = 1e-3
"""Of the ellipse: less is not told from none."""

EVEN_MISSING = 0.03
"""Share of the ellipse that is missing from as many balls as other things. Balls of the arena (seeds 0 to 7) miss 0.5
to 3 %, its corals and tiles 4 to 13 %."""

WEIGHT = 2.4
"""Of its logarithm, from the two normal distributions that this has over balls and over other things there."""

MOST_FOR, MOST_AGAINST = 2.0, 1.5
"""Log odds that an outline counts for; less against, since a ball at dusk is as ragged as a coral."""


def ellipse_share(moments: Mapping[str, float]) -> float:
    """Area of cells over that of the ellipse with their second moments, from 0 to 1; OpenCV's moments of a mask."""
    area = moments["m00"]
    across, down = (moments[name] / area + CELL_MOMENT for name in ("mu20", "mu02"))
    slant = moments["mu11"] / area
    return min(area / (4 * math.pi * math.sqrt(across * down - slant * slant)), 1.0)


def outline_log_odds(blob: Blob) -> float:
    """Natural logarithm of the odds that the outline of a blob that nothing cuts is a ball's."""
    missing = max(1 - blob.ellipse_share, LEAST_MISSING)
    return min(max(-WEIGHT * math.log(missing / EVEN_MISSING), -MOST_AGAINST), MOST_FOR)
