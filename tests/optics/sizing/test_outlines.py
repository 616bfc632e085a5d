"""Outlines against shapes whose smallest outlines are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.mirror import PlaneMirror, outline_edges
from optics.sizing.outlines import ROUNDED_CORNERS, outlines_around

ROUNDING_M = 1e-12
STRAIGHT_M = 2e-6
"""Twice what the convex outline may leave out of the hull."""

KINDS = ("rectangle", "free rectangle", "octagon", "convex")


def circle(radius, centre, count=3600):
    angles = 2 * np.pi * np.arange(count) / count
    return np.asarray(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def test_areas_around_a_circle_off_the_centre():
    """Radius 1 around (0.5, 0): a 3 x 2 rectangle, a 2 x 2 one, the octagon of inradius 1: 8 tan(pi / 8), and pi."""
    outlines = outlines_around(circle(1, [0.5, 0.0]), np.zeros(3600))
    areas = [outlines.area_m2(kind) for kind in KINDS]
    # The circle is a polygon of 3600 corners; 2 pi^3 / (3 * 3600^2) is what it lacks, its corners the rest.
    np.testing.assert_allclose(areas, [6, 4, 8 * np.tan(np.pi / 8), np.pi], rtol=2e-5)


def test_a_margin_moves_every_edge_out_by_itself():
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    outlines = outlines_around(square, np.full(4, 0.25))
    assert outlines.rectangle_m == (2.5, 2.5)
    np.testing.assert_allclose(outlines.octagon_m @ [1, 1] / np.sqrt(2) <= np.sqrt(2) + 0.25 + ROUNDING_M, True)
    # Square, strips and the polygon around a disc (area k tan(pi / k) r^2) in place of the four corners.
    rounded = ROUNDED_CORNERS * np.tan(np.pi / ROUNDED_CORNERS) * 0.25**2
    strips = 4 * 2 * 0.25 / np.cos(np.pi / ROUNDED_CORNERS)
    assert outlines.area_m2("convex") == pytest.approx(4 + strips + rounded, rel=1e-3)


def test_a_square_on_its_corner_needs_no_octagon():
    outlines = outlines_around(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]), np.zeros(4))
    assert len(outlines.octagon_m) == 4
    assert outlines.area_m2("octagon") == pytest.approx(2, abs=1e-9)


@given(seed=st.integers(0, 10_000), growth=st.sampled_from([0.0, 0.003]))
def test_every_outline_holds_every_disc_and_each_is_smaller_than_the_one_before(seed, growth):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(40, 2)) * [0.03, 0.08] + rng.uniform(-0.02, 0.02, 2)
    radii = growth * rng.uniform(0.5, 1, 40)
    outlines = outlines_around(points, radii)
    for kind in KINDS:
        corners = outlines.corners_m(kind)
        PlaneMirror(point_m=(0, 0, 0), normal=(0, 0, 1), up=(0, 1, 0), outline_m=corners)  # convex, and a real outline
        edges = outline_edges(corners)
        outside = points @ edges[:, :2].T + radii[:, np.newaxis] - edges[:, 2]
        assert outside.max() < (STRAIGHT_M if kind == "convex" else ROUNDING_M)
    rectangle, free, octagon, convex = (outlines.area_m2(kind) for kind in KINDS)
    assert rectangle >= free >= octagon - ROUNDING_M
    if growth == 0:
        assert octagon >= convex


def test_an_unknown_outline_is_refused():
    outlines = outlines_around(circle(1, [0, 0]), np.zeros(3600))
    with pytest.raises(ValueError, match="expected an outline out of rectangle, free rectangle, octagon, convex, got"):
        outlines.corners_m("star")
