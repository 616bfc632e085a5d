"""Outlines against shapes whose smallest outlines are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.mirror_outline import OCTAGON_CUT, OUTLINES, Polygon
from optics.sizing.outlines import REACH_DIRECTIONS, ROUNDED_CORNERS, outlines_around

ROUNDING_M = 1e-12
STRAIGHT_M = 2e-6
"""Twice what the convex outline may leave out of the hull."""

KINDS = ("rectangle", "octagon", "ellipse", "free rectangle", "convex")


def circle(radius, centre, count=3600):
    angles = 2 * np.pi * np.arange(count) / count
    return np.asarray(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def test_areas_around_a_circle_off_the_centre():
    """Radius 1 around (0.5, 0): a rectangle of 3 x 2 when it is centred, of 2 x 2 when it is not, and pi."""
    outlines = outlines_around(circle(1, [0.5, 0.0]), np.zeros(3600))
    areas = [outlines.area_m2(kind) for kind in ("rectangle", "free rectangle", "convex")]
    # The circle is a polygon of 3600 corners; 2 pi^3 / (3 * 3600^2) is what it lacks, its corners the rest.
    np.testing.assert_allclose(areas, [6, 4, np.pi], rtol=2e-5)


def test_around_a_centred_circle_the_octagon_is_regular_and_the_ellipse_the_circle():
    outlines = outlines_around(circle(1, [0.0, 0.0]), np.zeros(3600))
    assert outlines.area_m2("octagon") == pytest.approx(8 * np.tan(np.pi / 8), rel=1e-6)
    # The polygon of the reaches is circumscribed.
    assert outlines.sides_m("ellipse") == pytest.approx(
        (2, 2), rel=1 / np.cos(np.pi / 4 / (REACH_DIRECTIONS["ellipse"] - 1)) - 1
    )


def test_around_a_rectangle_the_ellipse_is_the_closed_form():
    """The smallest ellipse around a centred rectangle has sqrt(2) times its sides, and pi / 2 times its area."""
    corners = np.array([[-2, -1], [2, -1], [2, 1], [-2, 1]], dtype=float)
    outlines = outlines_around(corners, np.zeros(4))
    assert outlines.sides_m("ellipse") == pytest.approx((4 * np.sqrt(2), 2 * np.sqrt(2)), rel=1e-6)
    assert outlines.area_m2("ellipse") == pytest.approx(4 * np.pi, rel=1e-9)


@pytest.mark.parametrize("name", ["octagon", "ellipse"])
def test_no_other_proportions_make_a_smaller_one(name):
    """The best of 20000 proportions, each scaled until it holds all points, by the outline's own test."""
    points = np.random.default_rng(5).normal(size=(200, 2)) * [0.03, 0.05] + [0.01, 0.0]
    found = outlines_around(points, np.zeros(200)).area_m2(name)
    ratio = np.geomspace(0.2, 5, 20_000)[:, np.newaxis]
    x, y = np.abs(points.T)
    if name == "ellipse":
        scale = np.hypot(x, y / ratio).max(axis=1)
    else:
        limit = 1 + ratio - OCTAGON_CUT * np.minimum(1, ratio)
        scale = np.max([x + 0 * ratio, y / ratio, (x + y) / limit], axis=(0, 2))
    areas = OUTLINES[name](half_width=scale, half_height=scale * ratio[:, 0]).area_m2
    # Proportions are 8e-5 apart; the ellipse is made around a polygon.
    assert areas.min() * (1 - 1e-4) < found < areas.min() * (1 + 1.3e-3)


def test_a_margin_moves_every_edge_out_by_itself():
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    outlines = outlines_around(square, np.full(4, 0.25))
    assert outlines.sides_m("rectangle") == (2.5, 2.5)
    # As narrow as the square with its margin, and so high that the cuts, 45 degrees, pass its corners at the margin.
    height = 2 * (2 + 0.25 * np.sqrt(2) - (np.sqrt(2) - 1) * 1.25)
    assert outlines.sides_m("octagon") == pytest.approx((2.5, height), abs=ROUNDING_M)
    # Square, strips and the polygon around a disc (area k tan(pi / k) r^2) in place of the four corners.
    rounded = ROUNDED_CORNERS * np.tan(np.pi / ROUNDED_CORNERS) * 0.25**2
    strips = 4 * 2 * 0.25 / np.cos(np.pi / ROUNDED_CORNERS)
    assert outlines.area_m2("convex") == pytest.approx(4 + strips + rounded, rel=1e-3)


@given(seed=st.integers(0, 10_000), growth=st.sampled_from([0.0, 0.003]))
def test_every_outline_holds_every_disc_and_what_is_free_is_smaller(seed, growth):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(40, 2)) * [0.03, 0.08] + rng.uniform(-0.02, 0.02, 2)
    radii = growth * rng.uniform(0.5, 1, 40)
    outlines = outlines_around(points, radii)
    for kind in KINDS:
        outline = Polygon.of(outlines.corners_m(kind))
        # An ellipse's points leave out 0.05 % of it.
        slack = {"convex": STRAIGHT_M, "ellipse": 6e-4 * outline.radius_m}.get(kind, ROUNDING_M)
        assert (np.array(outline.beyond(*points.T)) + radii).max() < slack
    areas = {kind: outlines.area_m2(kind) for kind in KINDS}
    assert areas["rectangle"] >= areas["free rectangle"]
    if growth == 0:
        assert min(areas, key=areas.get) == "convex"


def test_an_unknown_outline_is_refused():
    outlines = outlines_around(circle(1, [0, 0]), np.zeros(3600))
    with pytest.raises(
        ValueError, match="expected an outline out of rectangle, octagon, ellipse, free rectangle, convex, got"
    ):
        outlines.corners_m("star")
