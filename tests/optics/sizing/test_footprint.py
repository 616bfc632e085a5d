"""Footprints against closed forms of a cone on a tilted plane, and against `OpticalTrain` pose by pose."""

from __future__ import annotations

import numpy as np
import pytest

from optics.layout import Layout
from optics.sizing.footprint import centred_extents, fold_footprint, gaze_footprint
from optics.sizing.gaze_range import GazeRange, pairs, pose_grid
from optics.sizing.window import Window, fraction_window
from optics.train import OpticalTrain
from rigs import NoPortSpec, Rig

ROUNDING_M = 1e-14
"""Sums of lengths of some 0.1 m in float64."""


def without_port(**camera):
    """aqua2 with the optical axis in the middle of a distortion-free image and no port: cones are cones."""
    rig = Rig.load("aqua2").model_copy(update={"port": NoPortSpec(shape="none")})
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=camera)})


BARE, AQUA2 = without_port(), Rig.load("aqua2")


def edge_middles(tangent):
    """Pixels at the tangent of an angle right, left, below and above the axis."""
    half = 500.0 * tangent
    return np.array([319.5, 239.5]) + half * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])


@pytest.mark.parametrize("degrees", [1.0, 10.0, 25.0])
def test_a_cone_on_m1_has_the_near_and_far_edge_of_the_closed_form(degrees):
    """On the plane z = d1 + y a ray of slope t along y lands at z = d1 / (1 - t), sqrt(2) (z - d1) along the slope.

    So the far edge is at sqrt(2) d1 t / (1 - t) below the centre, the near one at sqrt(2) d1 t / (1 + t) above; and
    sideways at d1 t.
    """
    tangent, d1 = np.tan(np.radians(degrees)), BARE.gaze.fold_mirror.distance_mm / 1000
    rays = OpticalTrain.bare(BARE).trace(edge_middles(tangent))
    footprint = fold_footprint(BARE, rays)
    far, near = np.sqrt(2) * d1 * tangent / (1 - tangent), np.sqrt(2) * d1 * tangent / (1 + tangent)
    expected = [[d1 * tangent, 0], [-d1 * tangent, 0], [0, -far], [0, near]]
    np.testing.assert_allclose(footprint.points_m, expected, atol=ROUNDING_M)
    assert footprint.front.all()


def test_beyond_45_degrees_m1_is_not_hit():
    rays = OpticalTrain.bare(BARE).trace(np.array([[319.5, 239.5 + 501], [319.5, 239.5 + 499]]))
    np.testing.assert_array_equal(fold_footprint(BARE, rays).front, [False, True])


@pytest.mark.parametrize("tilt_deg", [-32.5, -10.0, 0.0, 45.0, 100.0])
def test_a_narrow_cone_on_m2_grows_as_the_cosine_of_incidence(tilt_deg):
    """Far from the pinhole by L = d1 + d2, a narrow cone is L t wide and L t / cos(i) high, i = 45 deg - tilt."""
    tangent = 1e-7
    rays = OpticalTrain.bare(BARE).trace(edge_middles(tangent))
    pose = {"q1": np.zeros(1), "q2": np.radians([tilt_deg])}
    footprint = gaze_footprint(BARE, rays, **pose)
    length = (BARE.gaze.fold_mirror.distance_mm + BARE.gaze.gaze_mirror.distance_mm) / 1000
    cosine = np.cos(np.radians(45 - tilt_deg))
    half = np.abs(footprint.points_m[0]).max(axis=0)
    # The next order is tan(i) t, 5e-7.
    np.testing.assert_allclose(half, [length * tangent, length * tangent / cosine], rtol=1e-6)
    np.testing.assert_allclose(footprint.cosine[0], cosine, rtol=1e-6)


@pytest.mark.parametrize("tangent", [0.05, 0.15, 0.2, 0.23])
def test_a_wide_cone_on_m2_at_its_limit_has_the_edges_of_the_closed_form(tangent):
    """At q2 = -32.5 deg light falls on M2 at i = 77.5 deg from its normal.

    In the plane of incidence a ray at the angle a from the axis lands L sin(a) / cos(i + a) from the centre (law of
    sines): it grows without bound as a comes to 12.5 deg, whose tangent is 0.2217.
    """
    rays = OpticalTrain.bare(BARE).trace(edge_middles(tangent))
    footprint = gaze_footprint(BARE, rays, q1=np.zeros(1), q2=np.radians([-32.5]))
    length = (BARE.gaze.fold_mirror.distance_mm + BARE.gaze.gaze_mirror.distance_mm) / 1000
    angle, incidence = np.arctan(tangent), np.radians(77.5)
    if angle + incidence > np.pi / 2:
        assert not footprint.front[0].all()
        return
    far, near = (length * np.sin(angle) / np.cos(incidence + sign * angle) for sign in (1, -1))
    assert footprint.front.all()
    # 1 / cos(i + a) magnifies rounding by its own size squared, some 1e4.
    np.testing.assert_allclose(sorted(np.abs(footprint.points_m[0, 2:, 1])), sorted([far, near]), rtol=1e-11)


def test_footprints_are_where_the_train_says_pose_by_pose():
    """Unbounded mirrors through the flat port of aqua2, and the points in the mirrors' own axes."""
    rays = OpticalTrain.bare(AQUA2).trace(fraction_window(OpticalTrain.bare(AQUA2).camera, 0.1).boundary(3))
    layout = Layout.from_rig(AQUA2)
    rng = np.random.default_rng(5)
    q1, q2 = np.radians(rng.uniform([[-77], [-20]], [[77], [110]], (2, 12)))
    footprint = gaze_footprint(AQUA2, rays, q1=q1, q2=q2)
    train = OpticalTrain.from_rig(AQUA2).unbounded()
    pixels = fraction_window(OpticalTrain.bare(AQUA2).camera, 0.1).boundary(3)
    traced = train.trace_poses(pixels, layout.camera_from_m2_at(q1, q2))
    assert footprint.front.all() and traced.passed.all()
    for k, (a, b) in enumerate(zip(q1, q2, strict=True)):
        local = layout.camera_from_m2(a, b).inv().apply(traced.origin_m.reshape(12, -1, 3)[k])
        # 1 / cos of 77 degrees and lengths of 0.2 m: some ten roundings.
        np.testing.assert_allclose(np.column_stack([footprint.points_m[k], np.zeros(12)]), local, atol=1e-13)


def test_extents_of_a_design_are_those_of_its_footprint():
    """The reduction in the kernel against NumPy on stored footprints, for several designs at once."""
    layout = Layout.from_rig(AQUA2)
    gaze = GazeRange(first=(-0.8, 0.8), second=(-0.3, 0.5), in_joints=False)
    grid = pose_grid(layout, gaze, 5)
    rays = OpticalTrain.bare(AQUA2).trace(fraction_window(OpticalTrain.bare(AQUA2).camera, 0.2).boundary(4))
    d1, d2 = np.array([0.08, 0.095, 0.2]), np.array([0.3, 0.125, 0.1])
    extents = centred_extents(
        AQUA2, rays, d1_m=d1, d2_m=d2, q1=grid.q1, q2=grid.q2, margin_m=0.002, angle_tolerance=0.01
    )
    for k in range(3):
        rig = AQUA2.with_gaze(
            fold_mirror={"distance_mm": 1000 * d1[k]},
            gaze_mirror={"distance_mm": 1000 * d2[k]},
        )
        for found, footprint in (
            (extents.m1_m[k], fold_footprint(rig, rays)),
            (extents.m2_m[k], gaze_footprint(rig, rays, q1=grid.q1, q2=grid.q2)),
        ):
            grown = np.abs(footprint.points_m) + (0.002 + 0.01 * footprint.spread_m)[..., np.newaxis]
            np.testing.assert_allclose(found, grown.reshape(-1, 2).max(axis=0), atol=ROUNDING_M)


def test_behind_a_centred_dome_mirrors_are_those_without_a_port_and_grow_with_the_distances():
    """A centred dome refracts nothing; from one pinhole everything is proportional to the distances."""
    domed = Rig.load("bluerov2")
    bare = domed.model_copy(update={"port": NoPortSpec(shape="none")})
    found = []
    for rig, factor in ((domed, 1.0), (bare, 1.0), (domed, 2.0)):
        rays = OpticalTrain.bare(rig).trace(fraction_window(OpticalTrain.bare(rig).camera, 0.1).boundary(4))
        extents = centred_extents(
            rig,
            rays,
            d1_m=np.array([0.13 * factor]),
            d2_m=np.array([0.2 * factor]),
            q1=np.array([0.0, 0.7]),
            q2=np.array([-0.3, 0.2]),
            margin_m=0.0,
            angle_tolerance=0.0,
        )
        found.append(np.concatenate([extents.m1_m, extents.m2_m]))
    np.testing.assert_allclose(found[1], found[0], atol=10 * ROUNDING_M)
    np.testing.assert_allclose(found[2], 2 * found[0], atol=10 * ROUNDING_M)


def test_extents_are_infinite_where_no_mirror_does():
    rays = OpticalTrain.bare(BARE).trace(edge_middles(0.3))
    extents = centred_extents(
        BARE,
        rays,
        d1_m=np.array([0.1]),
        d2_m=np.array([0.1]),
        q1=np.zeros(2),
        q2=np.radians([0, -32.5]),
        margin_m=0.0,
        angle_tolerance=0.0,
    )
    assert np.isfinite(extents.m1_m).all()
    assert np.isinf(extents.m2_m).all()


def test_the_windows_boundary_bounds_its_inside():
    """Behind a flat port lines become curves: the inside still lands within what the boundary holds."""
    train = OpticalTrain.bare(AQUA2)
    window = Window(left_px=100, top_px=50, right_px=500, bottom_px=350)
    edge = train.trace(window.boundary(24))
    inside = train.trace(window.cells(40, 30))
    on_edge, within = fold_footprint(AQUA2, edge).points_m, fold_footprint(AQUA2, inside).points_m
    assert (within.max(axis=0) < on_edge.max(axis=0)).all()
    assert (within.min(axis=0) > on_edge.min(axis=0)).all()


def test_gaze_ranges_are_reached_where_the_joints_reach():
    layout = Layout.from_rig(AQUA2)
    behind = GazeRange(first=np.radians([180, 180]), second=np.radians([20, 20]), in_joints=False)
    q1, q2 = behind.poses(layout, *pairs(*behind.values(5)))
    np.testing.assert_allclose(np.degrees([q1[0], q2[0]]), [0, 80], atol=1e-9)
    too_far = GazeRange(first=np.radians([-90, 0]), second=(0.0, 0.0), in_joints=True)
    np.testing.assert_array_equal(pose_grid(layout, too_far, 7).reached, [False] + 6 * [True])


@pytest.mark.parametrize(
    ("first", "second", "in_joints", "words"),
    [
        ((10, -10), (0, 0), False, "expected a range of azimuth from a lower to a higher angle, got 10 to -10 deg"),
        ((0, 0), (np.nan, 0), True, "expected a range of q2 from a lower to a higher angle"),
        ((0, 0), (-100, 0), False, "expected elevations between -90 and 90 deg, got -100 to 0"),
    ],
)
def test_bad_ranges_are_refused(first, second, in_joints, words):
    with pytest.raises(ValueError, match=words):
        GazeRange(first=tuple(np.radians(first)), second=tuple(np.radians(second)), in_joints=in_joints)
