"""Outlines of mirrors: areas, rims and distances in closed form, and what is traced over them."""

import numpy as np
import pytest
from matplotlib.path import Path
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import PinholeCamera
from optics.coverage.coverage import compute_coverage
from optics.coverage.outcome import Outcome
from optics.layout import Layout
from optics.mirror import PlaneMirror
from optics.mirror_outline import OUTLINES, Ellipse, Octagon, Polygon, Rectangle, mirror_outline
from optics.ports.port import NoPort
from optics.status import Status
from optics.train import OpticalTrain
from rigs import Rig

ROUNDING = 1e-12
HALVES = [(0.04, 0.05), (0.05, 0.02), (0.03, 0.03)]
AQUA2 = Rig.load("aqua2")


def shoelace(corners):
    x, y = corners.T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@pytest.mark.parametrize("half", HALVES)
def test_areas_and_radii_are_those_of_the_rims(half):
    width, height = half
    for outline in (Rectangle, Octagon):
        made = outline(half_width=width, half_height=height)
        assert made.area_m2 == pytest.approx(shoelace(made.rim()), rel=ROUNDING)
        assert made.radius_m == pytest.approx(np.linalg.norm(made.rim(), axis=1).max(), rel=ROUNDING)
    ellipse = Ellipse(half_width=width, half_height=height)
    # A polygon of n corners on an ellipse has n sin(2 pi / n) / 2 pi of its area.
    assert shoelace(ellipse.rim(96)) == pytest.approx(
        ellipse.area_m2 * 96 * np.sin(2 * np.pi / 96) / 2 / np.pi, rel=ROUNDING
    )
    assert ellipse.radius_m == max(half)


def test_a_square_makes_a_regular_octagon():
    corners = Octagon(half_width=1.0, half_height=1.0).rim()
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    np.testing.assert_allclose(sides, 2 * np.tan(np.pi / 8), rtol=ROUNDING)
    assert np.linalg.norm(corners, axis=1) == pytest.approx(1 / np.cos(np.pi / 8), rel=ROUNDING)


@pytest.mark.parametrize("half", HALVES)
def test_the_octagon_holds_the_ellipse_of_its_sides(half):
    width, height = half
    x, y = Ellipse(half_width=width, half_height=height).rim(720).T
    assert max(np.max(each) for each in Octagon(half_width=width, half_height=height).beyond(x, y)) < ROUNDING


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("half", HALVES)
def test_inside_is_what_another_rule_says(name, half):
    """Against matplotlib's winding rule along the rim, and the polygon of the rim."""
    outline = OUTLINES[name](half_width=half[0], half_height=half[1])
    points = np.random.default_rng(3).uniform(-1.1, 1.1, (4000, 2)) * half
    x, y = points.T
    rim = outline.rim(2000)
    inside = Path(rim).contains_points(points)
    assert (outline.contains(x, y) == inside).mean() > 0.999
    assert (Polygon.of(rim).contains(x, y) == inside).all()
    assert 0.5 < inside.mean() < 0.9
    # Drawn in, all are inside or on the rim, and those inside have not moved.
    drawn = np.array(outline.drawn_in(x, y))
    assert outline.contains(*(drawn * (1 - ROUNDING))).all()
    kept = outline.contains(x, y)
    np.testing.assert_array_equal(drawn[:, kept], points[kept].T)


def test_distances_are_metres():
    """Along a normal of each line of the rim; beside an ellipse to the first order."""
    octagon = Octagon(half_width=0.05, half_height=0.02)
    middle = octagon.rim()[1:3].mean(axis=0)
    out = middle + 0.003 * np.array([1, -1]) / np.sqrt(2)
    assert max(octagon.beyond(*out)) == pytest.approx(0.003, abs=ROUNDING)
    ellipse = Ellipse(half_width=0.05, half_height=0.02)
    angle = 0.7
    on_rim = np.array([0.05 * np.cos(angle), 0.02 * np.sin(angle)])
    normal = np.array([0.02 * np.cos(angle), 0.05 * np.sin(angle)])
    out = on_rim + 1e-5 * normal / np.linalg.norm(normal)
    assert ellipse.beyond(*out)[0] == pytest.approx(1e-5, rel=1e-2)
    assert ellipse.beyond(0.0, 0.0)[0] < -1


@pytest.mark.parametrize(
    "outline", [Ellipse(half_width=0.04, half_height=0.05), Octagon(half_width=0.04, half_height=0.05)]
)
def test_a_traced_mirror_ends_at_its_rim_and_fills_its_area(outline):
    """A pinhole looks square at a mirror 1 m away, of which a pixel shows 1 mm: area in pixels, rays beside the rim."""
    camera = PinholeCamera(width_px=200, height_px=200, fx_px=1000, fy_px=1000, cx_px=99.5, cy_px=99.5)
    pose = RigidTransform.from_components([0, 0, 1], Rotation.from_euler("x", 180, degrees=True))
    train = OpticalTrain(camera=camera, port=NoPort(), mirrors=(PlaneMirror.from_pose(pose, outline),))
    u, v = np.meshgrid(np.arange(200.0), np.arange(200.0))
    hit = train.trace(np.column_stack([u.ravel(), v.ravel()])).status == Status.OK
    # Gauss's circle problem: the count is off by some of the 280 pixels on the rim, which cancel.
    assert hit.sum() == pytest.approx(1e6 * outline.area_m2, rel=2e-3)
    for factor, status in ((1 - 1e-9, Status.OK), (1 + 1e-9, Status.MISSED_M1)):
        pixels = 99.5 + 1000 * factor * outline.rim() * [1, -1]
        assert set(train.trace(pixels).status) == {status}


@pytest.mark.parametrize("name", ["octagon", "ellipse"])
def test_coverage_lies_between_those_of_the_rectangles_inside_and_around(name):
    """Each direction is seen from at least as many poses as over the inscribed rectangles, at most as around."""

    def seen(outline, factor):
        gaze = AQUA2.gaze
        tables = {
            key: {"outline": outline, "width_mm": factor * mirror.width_mm, "height_mm": factor * mirror.height_mm}
            for key, mirror in (("fold_mirror", gaze.fold_mirror), ("gaze_mirror", gaze.gaze_mirror))
        }
        rig = AQUA2.with_gaze(**tables)
        layout = Layout.from_rig(rig)
        q1, q2 = layout.pan.values(5), layout.tilt.values(7)
        return compute_coverage(rig, [], q1=q1, q2=q2, columns=16, rows=12, nside=16).poses_by_outcome[Outcome.SEEN]

    inside, own, around = seen("rectangle", 0.5**0.5), seen(name, 1.0), seen("rectangle", 1.0)
    assert (inside <= own).all() and (own <= around).all()
    assert inside.sum() < own.sum() < around.sum()


def test_a_rigs_outline_is_the_file_s():
    for name, outline in OUTLINES.items():
        mirror = AQUA2.gaze.gaze_mirror.model_copy(update={"outline": name})
        assert mirror_outline(mirror) == outline(half_width=0.04, half_height=0.05)
