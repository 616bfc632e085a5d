"""Plates and cells of octagons and ellipses: volumes in closed form, clearance, removal path, what the lips hold."""

import pytest
from build123d import Pos

from cad.parts.mirror_sides import SMALLEST_CUT_SIDE_MM
from cad.parts.mirrors import (
    FIT_MM,
    LIP_OVERLAP_MM,
    clip_screws,
    mirror_clip,
    mirror_plate,
    mirror_tray,
    tray_half_width_mm,
    tray_straight_mm,
)
from optics.mirror_outline import mirror_outline
from rigs import Rig

WALL_MM = 4.0
M2 = Rig.load("aqua2").gaze.gaze_mirror
CUT = ("octagon", "ellipse")


def cut(outline, **values):
    return M2.model_copy(update={"outline": outline, **values})


def wider(mirror, growth_mm):
    return mirror.model_copy(
        update={"width_mm": mirror.width_mm + 2 * growth_mm, "height_mm": mirror.height_mm + 2 * growth_mm}
    )


def shared(tray, body):
    return sum(solid.volume for solid in solids_of(tray, body))


def solids_of(tray, body):
    common = tray.intersect(body)
    return [] if common is None else [solid for each in common for solid in each.solids()]


@pytest.fixture(scope="module", params=CUT)
def mirror(request):
    return cut(request.param)


@pytest.fixture(scope="module")
def tray(mirror):
    return mirror_tray(mirror, WALL_MM, "screws")


def test_a_plate_has_its_outlines_area_times_its_thickness(mirror):
    plate = mirror_plate(mirror)
    assert plate.volume == pytest.approx(1e6 * mirror_outline(mirror).area_m2 * mirror.thickness_mm, rel=1e-9)
    size = plate.bounding_box().size
    assert pytest.approx((mirror.width_mm, mirror.height_mm, mirror.thickness_mm), abs=1e-5) == (size.X, size.Y, size.Z)


def test_a_plate_slides_in_with_its_play(mirror, tray):
    """On its bed it touches no wall until it is as much wider as the fit says; from above nothing is in its way."""
    just_behind_the_lips = Pos(0, 0, -0.01)
    assert shared(tray, just_behind_the_lips * mirror_plate(wider(mirror, 0.99 * FIT_MM))) == pytest.approx(0, abs=1e-6)
    assert shared(tray, just_behind_the_lips * mirror_plate(wider(mirror, 1.2 * FIT_MM))) > 1
    for height in (1.0, 20.0, 50.0, 90.0):
        assert shared(tray, Pos(0, height, -0.01) * mirror_plate(mirror)) == pytest.approx(0, abs=1e-6)


def test_lips_hold_a_plate_on_both_sides_above_and_below_its_middle(mirror, tray):
    """What a plate pushed out would run into: a band on each side, as wide as the overlap, from below to above."""
    bands = solids_of(tray, Pos(0, 0, 1.0) * mirror_plate(mirror))
    assert len(bands) == 2
    for band in bands:
        box = band.bounding_box()
        assert -0.4 * mirror.height_mm > box.min.Y
        assert pytest.approx(tray_straight_mm(mirror), abs=1e-5) == box.max.Y
        assert 0.2 * mirror.height_mm < box.max.Y
        assert min(abs(box.min.X), abs(box.max.X)) < mirror.width_mm / 2 - LIP_OVERLAP_MM
        # Everywhere about as wide as the overlap; where an ellipse's is drawn by half axes, less by up to a tenth.
        length = band.volume / LIP_OVERLAP_MM
        assert 0.9 * 70 < length < 1.1 * 80


def test_the_clip_closes_the_upper_edge_and_its_screws_are_on_the_head(mirror, tray):
    clip = mirror_clip(mirror, WALL_MM)
    assert clip.is_valid and shared(tray, clip) == pytest.approx(0, abs=1e-6)
    assert shared(mirror_plate(mirror), Pos(0, 0, -0.5) * clip) > 1
    (left, _), (right, _) = clip_screws(mirror, WALL_MM)
    assert 2 * right == right - left > 10
    assert right < tray_half_width_mm(mirror)


def test_small_plates_without_corners_are_refused_with_a_sentence(mirror):
    small = mirror.model_copy(update={"width_mm": SMALLEST_CUT_SIDE_MM - 1})
    with pytest.raises(ValueError, match=r"gaze_mirror.width_mm = 29: expected at least 30, below which the holes"):
        mirror_tray(small, WALL_MM)
