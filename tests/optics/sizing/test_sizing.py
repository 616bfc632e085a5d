"""Sizes are traced back: mirrors of exactly that size pass the window at every pose, smaller ones do not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import camera_from_spec
from optics.gaze.kinematics import inverse_gaze
from optics.layout import Layout
from optics.mirror import PlaneMirror
from optics.mirror_outline import Polygon
from optics.ports.port import port_from_spec
from optics.sizing.footprint import gaze_footprint
from optics.sizing.gaze_range import GazeRange
from optics.sizing.limits import Request, larger_than_bed, with_mirrors
from optics.sizing.sizing import passed_share, size_mirrors
from optics.sizing.window import Window, fraction_window
from optics.status import Status
from optics.train import OpticalTrain
from rigs import NoPortSpec, Rig

AQUA2 = Rig.load("aqua2")
IN_FRONT = AQUA2.camera.model_copy(update={"position_mm": (330.0, 60.0, 0.0)})
WITHOUT_PORT = AQUA2.model_copy(update={"port": NoPortSpec(shape="none"), "camera": IN_FRONT})
"""Cones are cones; the pinhole stands in front of the hull, as a bare camera must."""

RANGE = GazeRange(first=tuple(np.radians([-60, 60])), second=tuple(np.radians([-30, 45])), in_joints=False)

BETWEEN_POSES = 5e-6
"""How much wider a mirror is made before poses between the grid's must pass: the last zoom's arcs rise 1e-6."""


def image_part(fraction, rig=AQUA2):
    return fraction_window(camera_from_spec(rig.camera), fraction)


@pytest.fixture(scope="module")
def exact():
    """Sizes without margins, of a fifth of the image."""
    sizing = size_mirrors(AQUA2, Request(window=image_part(0.2), gaze=RANGE, margin_m=0.0, angle_tolerance=0.0))
    assert sizing.bindings == ()
    return sizing


def poses(count):
    """Random directions of the range and its edges, and the joint values nearest to rest that look there."""
    layout, rng = Layout.from_rig(AQUA2), np.random.default_rng(11)
    inner = rng.uniform([RANGE.first[0], RANGE.second[0]], [RANGE.first[1], RANGE.second[1]], (count, 2))
    edges = [(a, e) for a in (*RANGE.first, 0.0) for e in (*RANGE.second, 0.0)]
    found = []
    for azimuth, elevation in [*inner, *edges]:
        solutions = inverse_gaze(layout, azimuth, elevation)
        found.append(solutions[np.abs(solutions).max(axis=1).argmin()])
    return found


def statuses(m1_m, m2_m, poses, window):
    """Trace every tenth pixel of the window and its corners, at each pose, over mirrors with outlines in metres."""
    layout, bare = Layout.from_rig(AQUA2), OpticalTrain.bare(AQUA2)
    of_m2 = [layout.camera_from_m2(q1, q2) for q1, q2 in poses]
    mirrors = tuple(
        PlaneMirror.from_pose(pose, Polygon.of(outline))
        for pose, outline in ((layout.camera_from_m1, m1_m), (of_m2[0], m2_m))
    )
    pixels = np.concatenate([window.boundary(7), window.cells(13, 10)])
    matrices = np.array([pose.as_matrix() for pose in of_m2])
    return dataclasses.replace(bare, mirrors=mirrors).trace_poses(pixels, matrices).status


@pytest.mark.parametrize("kind", ["rectangle", "octagon", "ellipse", "free rectangle", "convex"])
def test_mirrors_of_that_size_pass_the_window_at_every_pose(exact, kind):
    """The convex outline follows the grid of poses, 3 degrees apart: its arcs rise 4e-4 of their radius in between."""
    grown = 1 + (1e-3 if kind == "convex" else BETWEEN_POSES)
    m1, m2 = grown * exact.m1.corners_m(kind), grown * exact.m2.corners_m(kind)
    assert (statuses(m1, m2, poses(60), exact.request.window) == Status.OK).all()


@pytest.mark.parametrize(
    ("mirror", "axis", "missed"), [("m1", 0, Status.MISSED_M1), ("m1", 1, Status.MISSED_M1),
                                   ("m2", 0, Status.MISSED_M2), ("m2", 1, Status.MISSED_M2)]
)  # fmt: skip
def test_mirrors_one_percent_smaller_lose_some_of_it(exact, mirror, axis, missed):
    corners = {name: (1 + BETWEEN_POSES) * getattr(exact, name).corners_m("rectangle") for name in ("m1", "m2")}
    corners[mirror][:, axis] *= 0.99
    found = statuses(corners["m1"], corners["m2"], poses(0) + grid_poses(), exact.request.window)
    assert set(found) == {Status.OK, missed}


def test_the_furthest_pose_is_found_between_those_of_the_first_grid():
    """A corner of the window reaches furthest sideways at a pan inside the range: 20000 pans say where, and no further.

    The last zoom's steps are 0.1 degrees, over which an arc rises 4e-7 of its radius.
    """
    joints = GazeRange(first=(-1.2, 0.97), second=(-0.2, 0.3), in_joints=True)
    request = Request(window=image_part(0.2), gaze=joints, margin_m=0.0, angle_tolerance=0.0)
    width = size_mirrors(AQUA2, request).m2.sides_m("rectangle")[0]
    corners = OpticalTrain.bare(AQUA2).trace(request.window.boundary(1))
    pans = np.linspace(-1.2, 0.97, 20001)
    widest = max(
        2 * np.abs(gaze_footprint(AQUA2, corners, q1=pans, q2=np.full(len(pans), tilt)).points_m[..., 0]).max()
        for tilt in joints.second
    )
    assert width == pytest.approx(widest, rel=1e-6)


def grid_poses():
    """Pan every 2.5 degrees at the range's ends in tilt: where a corner of the window reaches furthest sideways."""
    tilts = [elevation / 2 for elevation in RANGE.second]
    return [(q1, q2) for q1 in np.radians(np.arange(-60, 60.1, 2.5)) for q2 in tilts]


def test_margins_keep_the_window_when_mounts_are_off():
    """Camera and M1 turned by the tolerance in random directions, M2 too: the grown mirrors still pass everything.

    The growth is the first-order bound of the worst case; the second order, some tolerance^2, is 2e-5 of 0.3 m.
    """
    tolerance = np.radians(0.25)
    request = Request(window=image_part(0.2), gaze=RANGE, margin_m=2e-5, angle_tolerance=tolerance)
    sizing = size_mirrors(AQUA2, request)
    layout, bare, rng = Layout.from_rig(AQUA2), OpticalTrain.bare(AQUA2), np.random.default_rng(2)
    pixels = request.window.boundary(7)

    def off():
        axis = rng.normal(size=3)
        return RigidTransform.from_rotation(Rotation.from_rotvec(tolerance * axis / np.linalg.norm(axis)))

    for q1, q2 in poses(30):
        # The camera is turned by turning everything else the other way about the pinhole.
        turned = off()
        mirrors = tuple(
            PlaneMirror.from_pose(turned * pose * off(), outlines.centred["octagon"])
            for pose, outlines in ((layout.camera_from_m1, sizing.m1), (layout.camera_from_m2(q1, q2), sizing.m2))
        )
        assert (dataclasses.replace(bare, mirrors=mirrors).trace(pixels).status == 0).all()


def test_the_share_that_mirrors_pass_is_what_the_train_counts(exact):
    """Whole at the size asked for; with half of M1 the share of cells whose rays a train of M1 alone reflects."""
    assert (
        passed_share(
            with_mirrors(AQUA2, exact.m1.sides_m("rectangle"), exact.m2.sides_m("rectangle")), image_part(0.2), RANGE
        )
        == 1
    )
    width, height = exact.m1.sides_m("rectangle")
    halved = with_mirrors(AQUA2, (width / 2, height / 2), exact.m2.sides_m("rectangle"))
    train = OpticalTrain.from_rig(halved)
    alone = dataclasses.replace(train, mirrors=train.mirrors[:1])
    expected = np.mean(alone.trace(image_part(0.2).cells(24, 18)).status == Status.OK)
    assert 0.2 < expected < 0.4
    assert passed_share(halved, image_part(0.2), RANGE) == pytest.approx(expected, abs=1e-12)


def binding_of(rig=AQUA2, window=None, gaze=RANGE, **request):
    return size_mirrors(rig, Request(window=window or image_part(0.2), gaze=gaze, **request))


def names(sizing):
    return {binding.constraint for binding in sizing.bindings}


def test_grazing_incidence_is_named_with_the_largest_window_and_range():
    """A square window's corner may lie 12.5 degrees from the axis at q2 = -32.5 degrees, no further, at any mirror."""
    joints = GazeRange(first=(0.0, 0.0), second=tuple(np.radians([-32.5, 30])), in_joints=True)
    half = 500 * np.tan(np.radians(12.6))
    window = Window(left_px=319, right_px=320, top_px=239.5 - half, bottom_px=239.5 + half)
    sizing = binding_of(WITHOUT_PORT, window, joints)
    assert names(sizing) == {"grazing incidence on M2"}
    assert "q2 -32.5 to -32.5 deg" in sizing.bindings[0].message
    assert sizing.m2 is None and sizing.rig is None
    assert 0 < sizing.window_factor < np.tan(np.radians(12.5)) / np.tan(np.radians(12.6))
    assert sizing.second_range[0] > np.radians(-32.5) and sizing.second_range[1] == pytest.approx(np.radians(30))


def test_a_view_wider_than_45_degrees_never_hits_m1():
    wide = IN_FRONT.model_copy(update={"fx_px": 200.0, "fy_px": 200.0})
    rig = WITHOUT_PORT.model_copy(update={"camera": wide})
    sizing = binding_of(rig, image_part(1.0, rig))
    assert names(sizing) == {"grazing incidence on M1"}
    assert 0 < sizing.window_factor < 200 / 240
    assert sizing.second_range is None


def test_mirrors_without_room_to_turn_are_named():
    near = AQUA2.with_gaze(gaze_mirror={"distance_mm": 70.0})
    sizing = binding_of(near)
    assert names(sizing) == {"clearance"}
    assert "expected room to turn: the sphere of" in sizing.bindings[0].message


def test_what_would_fit_fits_and_a_little_more_does_not():
    """A bed of 120 x 160 mm, where M2, far below the hull, has to be longer."""
    mount = AQUA2.gaze.mount.model_copy(update={"printer_bed_mm": (60.0, 120.0, 160.0)})
    m2 = AQUA2.gaze.gaze_mirror.model_copy(update={"distance_mm": 200.0})
    rig = AQUA2.with_gaze(mount=mount, gaze_mirror=m2)
    sizing = binding_of(rig)
    assert names(sizing) == {"printer bed"}
    window, (low, high) = image_part(0.2), sizing.second_range
    # Bisected to 1 / 256; the range to one of 40 steps.
    step = np.radians(75 / 40)
    assert binding_of(rig, window.scaled(0.99 * sizing.window_factor)).bindings == ()
    assert binding_of(rig, window.scaled(sizing.window_factor + 1 / 128)).bindings != ()
    assert binding_of(rig, gaze=dataclasses.replace(RANGE, second=(low, high))).bindings == ()
    assert np.radians(-30) < low and high == pytest.approx(np.radians(45))
    assert binding_of(rig, gaze=dataclasses.replace(RANGE, second=(low - 1.01 * step, high))).bindings != ()


def test_joints_that_do_not_reach_are_named_with_their_share():
    gaze = GazeRange(first=tuple(np.radians([-155, 155])), second=(0.0, 0.0), in_joints=True)
    (binding,) = binding_of(gaze=gaze).bindings
    # 21 of the 41 values lie within +-77.5 degrees.
    assert (binding.constraint, "51%" in binding.message) == ("joint range", True)
    nowhere = GazeRange(first=tuple(np.radians([80, 100])), second=(0.0, 0.0), in_joints=True)
    sizing = binding_of(gaze=nowhere)
    assert names(sizing) == {"joint range"}
    assert (sizing.m1, sizing.m2, sizing.second_range, sizing.passed_now) == (None, None, None, 0)


def test_a_port_that_cuts_the_window_is_named_with_what_passes():
    """The port's rim in the image is a circle: 20 tan(a) + 8 tan(p) = 5 mm, sin(a) = n sin(p)."""
    port = AQUA2.port.model_copy(update={"aperture_diameter_mm": 10.0})
    rig = AQUA2.model_copy(update={"port": port})
    index = port_from_spec(port, rig.water).n_port
    rim = np.tan(brentq(lambda a: 20 * np.tan(a) + 8 * np.tan(np.arcsin(np.sin(a) / index)) - 5, 0.0, 1.0))
    side = 0.9 * rim
    window = Window(
        left_px=319.5 - 500 * side, right_px=319.5 + 500 * side, top_px=239.5 - 500 * side, bottom_px=239.5 + 500 * side
    )
    level = GazeRange(first=(-0.5, 0.5), second=(0.3, 0.5), in_joints=False)
    sizing = binding_of(rig, window, level)
    (binding,) = [b for b in sizing.bindings if b.constraint == "port aperture"]
    share = float(binding.message.split("%")[0].split()[-1]) / 100
    # The circle less four segments beyond the square, over the square.
    half_angle = np.arccos(0.9)
    passed = rim**2 * (np.pi - 4 * (half_angle - np.sin(half_angle) * np.cos(half_angle))) / (2 * side) ** 2
    # 64 x 48 cells along a rim of some 90 of them.
    assert share == pytest.approx(passed, abs=0.01)
    assert sizing.second_range is None
    # Bisected to 1 / 256.
    assert sizing.window_factor == pytest.approx(rim / side / np.sqrt(2), abs=1 / 256)


def test_a_tray_larger_than_the_printers_bed_is_named():
    message = larger_than_bed(with_mirrors(AQUA2, (0.04, 0.04), (0.2101, 0.230)))[0].message
    assert message.startswith("M2 of 210.5 x 230 mm needs a tray larger than the 250 x 210 mm")
    assert larger_than_bed(with_mirrors(AQUA2, (0.04, 0.04), (0.21, 0.25))) == []


def test_rectangles_are_rounded_up_and_thicker_than_their_plates():
    rig = with_mirrors(AQUA2, (0.0401, 0.045), (0.001, 0.0300001))
    assert (rig.gaze.fold_mirror.width_mm, rig.gaze.fold_mirror.height_mm) == (40.5, 45.0)
    assert (rig.gaze.gaze_mirror.width_mm, rig.gaze.gaze_mirror.height_mm) == (6.5, 30.5)


@pytest.mark.parametrize("change", [{"margin_m": -0.001}, {"angle_tolerance": np.nan}])
def test_bad_margins_are_refused(change):
    with pytest.raises(ValueError, match=f"expected {next(iter(change))} of at least 0, got"):
        Request(window=image_part(0.2), gaze=RANGE, **change)


def test_a_window_beyond_the_image_and_a_rig_without_mirrors_are_refused():
    with pytest.raises(ValueError, match="expected a window within the image"):
        binding_of(window=image_part(0.9).scaled(1.5))
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        binding_of(Rig.load("bench"))
