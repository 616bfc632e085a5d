"""The whole train: trace against the virtual camera and plain planes, project against trace, a status for all else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import plain_optics
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.camera import FisheyeCamera, PinholeCamera
from optics.gaze.kinematics import virtual_camera
from optics.layout import Layout
from optics.mirror import PlaneMirror
from optics.mirror_outline import Rectangle
from optics.ports.port import DomePort, FlatPort, NoPort
from optics.status import Region, Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

AFFINE = {"width_px": 640, "height_px": 480, "fx_px": 500.0, "fy_px": 500.0, "cx_px": 319.5, "cy_px": 239.5}

CAMERAS = {
    "pinhole": PinholeCamera(**AFFINE),
    "five": PinholeCamera(**AFFINE, distortion=(-0.28, 0.09, 8e-4, -6e-4, -0.012)),
    "eight": PinholeCamera(**AFFINE, distortion=(0.35, -0.2, 8e-4, -6e-4, 0.01, 0.6, -0.15, 0.02)),
    "fisheye": FisheyeCamera(**AFFINE, distortion=(-0.013, 0.002, -0.0014, 0.0002)),
}

PORTS = {
    "none": NoPort(),
    "flat": FlatPort(distance_m=0.02, thickness_m=0.008),
    "tilted": FlatPort(distance_m=0.02, thickness_m=0.008, normal=(0.1, -0.15, 1.0)),
    "dome": DomePort(centre_m=(0.002, -0.003, -0.008), radius_m=0.05, thickness_m=0.005),
}

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)

ROUND_TRIP_PX = 1e-9
"""The promise of the design for a projection's root; about 1e-12 px is seen."""

ROUNDING = 1e-12
"""The promise of the design for positions and directions (metres, unit vectors); about 1e-15 is seen."""


def mirrors(count, q1=0.3, q2=0.1):
    poses = (LAYOUT.camera_from_m1, LAYOUT.camera_from_m2(q1, q2))
    # Half a metre wide: everything the camera sees after M1 also strikes M2.
    return tuple(PlaneMirror.from_pose(pose, Rectangle(half_width=0.25, half_height=0.25)) for pose in poses[:count])


def distances(count, seed=3):
    """From 0.2 to 10 m, as many near as far."""
    return np.exp(np.random.default_rng(seed).uniform(np.log(0.2), np.log(10), (count, 1)))


def names(status):
    return [Status(value).name for value in status]


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("mirror_count", [0, 1, 2])
def test_project_undoes_trace(camera, port, mirror_count):
    """Every pixel that reaches the water, followed 0.2 to 10 m further, projects back to itself."""
    train = OpticalTrain(camera=CAMERAS[camera], port=PORTS[port], mirrors=mirrors(mirror_count))
    pixels = pixel_grid(train.camera, 64, 48)
    rays = train.trace(pixels)
    seen = rays.status == Status.OK
    assert seen.mean() > 0.6
    image = train.project((rays.origin_m + distances(len(pixels)) * rays.direction)[seen])
    assert (image.status == Status.OK).all()
    np.testing.assert_allclose(image.pixels, pixels[seen], rtol=0, atol=ROUND_TRIP_PX)


@given(q1=st.floats(-1.35, 1.35), q2=st.floats(-0.56, 1.3), port=st.sampled_from(sorted(PORTS)))
def test_mirrors_move_the_rays_as_they_move_the_virtual_camera(q1, q2, port):
    """Two reflections are one rigid motion: the lines behind M2 are the unmirrored ones seen by the virtual camera.

    The motion comes from `gaze`, which knows 4 x 4 matrices; the lines from surface after surface.
    """
    bare = OpticalTrain(camera=CAMERAS["five"], port=PORTS[port])
    train = replace(bare, mirrors=mirrors(2, q1, q2))
    pixels = pixel_grid(bare.camera, 16, 12)
    straight, rays = bare.trace(pixels), train.trace(pixels)
    seen = rays.status == Status.OK
    motion = LAYOUT.body_from_camera.inv() * virtual_camera(LAYOUT, q1, q2)
    np.testing.assert_allclose(
        rays.direction[seen], motion.rotation.apply(straight.direction)[seen], rtol=0, atol=ROUNDING
    )
    between = rays.origin_m - motion.apply(straight.origin_m)
    np.testing.assert_allclose(np.cross(between, rays.direction)[seen], 0, rtol=0, atol=ROUNDING)


def test_the_whole_train_of_the_aqua2_by_hand():
    """The second formulation of the port, then mirrors as planes in plain NumPy, with all statuses that they give.

    The aperture is made smaller than the aqua2's, which bounds none of its pixels.
    """
    narrow = AQUA2.port.model_copy(update={"aperture_diameter_mm": 26.0})
    train = OpticalTrain.from_rig(AQUA2.model_copy(update={"port": narrow}), q1=0.4, q2=0.2)
    pixels = pixel_grid(train.camera, 24, 18)
    rays = train.trace(pixels)
    port = train.port
    surface = plain_optics.PlainFlat(
        normal=[0.0, 0.0, 1.0],
        distance=port.distance_m,
        thickness=port.thickness_m,
        indices=(port.n_inside, port.n_port, port.n_water),
    )
    for pixel, origin, direction, status in zip(pixels, rays.origin_m, rays.direction, rays.status, strict=True):
        slope = np.array([*(pixel - [319.5, 239.5]) / 500, 1.0])
        _, outer, outgoing = plain_optics.faces(surface, list(slope / np.linalg.norm(slope)))
        start, heading = np.array(outer, dtype=float), np.array(outgoing, dtype=float)
        expected = Status.OK if np.hypot(*start[:2]) <= 0.013 else Status.MISSED_PORT
        for pose, size, missed in (
            (LAYOUT.camera_from_m1, (0.08, 0.09), Status.MISSED_M1),
            (LAYOUT.camera_from_m2(0.4, 0.2), (0.08, 0.1), Status.MISSED_M2),
        ):
            if expected != Status.OK:
                break
            local_start, local_heading = pose.inv().apply(start), pose.rotation.inv().apply(heading)
            reach = -local_start[2] / local_heading[2]
            struck = local_start + reach * local_heading
            within = reach > 0 and (np.abs(struck[:2]) <= np.array(size) / 2).all()
            if not within or local_heading[2] > 0:
                expected = Status.BACK_OF_MIRROR if within else missed
                break
            start, heading = pose.apply(struck), pose.rotation.apply(local_heading * [1, 1, -1])
        assert status == expected
        np.testing.assert_allclose(direction, heading, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(origin, start, rtol=0, atol=ROUNDING)
    assert {Status.OK, Status.MISSED_PORT, Status.MISSED_M1} <= set(rays.status)


def test_regions_are_those_of_figure_8():
    """Behind a narrow port the aqua2 has all four kinds of pixel: corners, sides, far end and middle."""
    narrow = AQUA2.port.model_copy(update={"aperture_diameter_mm": 32.0})
    train = OpticalTrain.from_rig(AQUA2.model_copy(update={"port": narrow}), q1=1.3, q2=0.3)
    region = train.trace(pixel_grid(train.camera)).region.reshape(480, 640)
    assert set(region.ravel()) == {Region.HOUSING, Region.DIRECT, Region.FOLD, Region.GAZE}
    assert (region[0, 0], region[240, 10], region[240, 320]) == (Region.HOUSING, Region.DIRECT, Region.GAZE)
    # A ray that reaches M1 is gaze or fold, whatever M2 does with it.
    ahead = OpticalTrain(camera=train.camera, port=train.port, mirrors=train.mirrors[:1])
    folded = ahead.trace(pixel_grid(train.camera)).status.reshape(480, 640) == Status.OK
    assert (folded == ((region == Region.FOLD) | (region == Region.GAZE))).all()


def test_the_axis_of_the_aqua2_looks_where_the_gaze_says():
    """The principal ray crosses the port at a right angle, and leaves from the centre of M2."""
    for q1, q2 in ((0.0, 0.0), (0.5, 0.4), (-1.0, -0.3)):
        train = OpticalTrain.from_rig(AQUA2, q1=q1, q2=q2)
        rays = train.trace([[319.5, 239.5]])
        direction = LAYOUT.body_from_camera.rotation.apply(rays.direction[0])
        expected = [np.cos(2 * q2) * np.cos(q1), np.cos(2 * q2) * np.sin(q1), np.sin(2 * q2)]
        np.testing.assert_allclose(direction, expected, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(rays.origin_m[0], [0, 0.125, 0.095], rtol=0, atol=ROUNDING)


BAD_POINTS = [[np.nan, 0, 1], [0, np.inf, 1], [np.inf, -np.inf, 1], [0, 0, -np.inf]]


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("mirror_count", [0, 1, 2])
def test_what_is_not_finite_has_a_status_of_its_own(camera, port, mirror_count):
    train = OpticalTrain(camera=CAMERAS[camera], port=PORTS[port], mirrors=mirrors(mirror_count))
    image = train.project(BAD_POINTS)
    assert names(image.status) == ["INVALID_INPUT"] * 4
    assert np.isnan(image.pixels).all()
    rays = train.trace([[np.nan, 1], [1, np.inf], [-np.inf, np.inf]])
    assert names(rays.status) == ["INVALID_INPUT"] * 3


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("mirror_count", [0, 1, 2])
def test_ok_means_numbers(camera, port, mirror_count):
    """Points and pixels anywhere, absurd ones too: OK comes with finite numbers, NaN never with OK."""
    train = OpticalTrain(camera=CAMERAS[camera], port=PORTS[port], mirrors=mirrors(mirror_count))
    rng = np.random.default_rng(8)
    scale = 10.0 ** rng.integers(-300, 300, (300, 1))
    image = train.project(np.vstack([rng.normal(size=(3000, 3)), rng.normal(size=(300, 3)) * scale, np.zeros((1, 3))]))
    assert np.isfinite(image.pixels[image.status == Status.OK]).all()
    no_pixel = [Status.INVALID_INPUT, Status.INSIDE_HOUSING, Status.NOT_CONVERGED, Status.OUTSIDE_CAMERA_MODEL]
    assert np.isnan(image.pixels[np.isin(image.status, no_pixel)]).all()
    pixels = np.vstack([rng.normal(300, 600, (3000, 2)), rng.normal(size=(300, 2)) * scale])
    rays = train.trace(pixels)
    for values in (rays.origin_m, rays.direction):
        assert np.isfinite(values[rays.status == Status.OK]).all()
    lengths = np.linalg.norm(rays.direction[rays.status == Status.OK], axis=1)
    np.testing.assert_allclose(lengths, 1, rtol=0, atol=ROUNDING)
    passed = train.transmittance(pixels)
    assert (passed[rays.status == Status.OK] > 0).all()
    assert (passed >= 0).all()
    assert (passed <= 1 + ROUNDING).all()


def test_points_behind_the_gaze_mirror_are_not_seen():
    """Also those whose mirror image happens to lie in the port's view, and those behind the camera."""
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=PORTS["flat"], mirrors=mirrors(2, 0.0, 0.0))
    pose = LAYOUT.camera_from_m2(0.0, 0.0)
    local = np.random.default_rng(9).uniform([-1, -1, -2], [1, 1, -1e-6], (500, 3))
    image = train.project(pose.apply(local))
    assert set(names(image.status)) == {"BACK_OF_MIRROR"}
    assert names(train.project([pose.translation]).status) == ["BACK_OF_MIRROR"]


def test_a_gaze_mirror_that_turns_its_back_says_so():
    """Tilted to 122.5 degrees the face looks up and back; at 140 it would show its back to the folded view."""
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=PORTS["flat"], mirrors=mirrors(2, 0.0, np.radians(140)))
    assert names(train.trace([[319.5, 239.5]]).status) == ["BACK_OF_MIRROR"]


@pytest.mark.parametrize(
    ("port", "point", "expected"),
    [
        ("flat", (0, 0, 0.024), "INSIDE_HOUSING"),  # in the window
        ("flat", (0, 0, 0.01), "INSIDE_HOUSING"),  # in the air
        ("flat", (0.1, 0.1, -1), "INSIDE_HOUSING"),  # behind the camera: not in the water in front of the plane
        ("dome", (0.01, 0, 0.02), "INSIDE_HOUSING"),
        ("dome", (0, 0, -1), "OUTSIDE_CAMERA_MODEL"),  # water behind a dome, where a pinhole has no image
        ("none", (0, 0, -1), "OUTSIDE_CAMERA_MODEL"),
        ("none", (0, 0, 0), "INSIDE_HOUSING"),  # the pinhole itself
        ("flat", (0, 0, 1), "OK"),
        ("flat", (2, 0, 1), "OUTSIDE_IMAGE"),
        ("dome", (0, -2, 1), "OUTSIDE_IMAGE"),
        ("none", (-2, 0, 1), "OUTSIDE_IMAGE"),
    ],
)
def test_a_point_that_is_not_seen_says_why(port, point, expected):
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=PORTS[port])
    assert names(train.project([point]).status) == [expected]


def test_a_mirror_in_the_air_has_an_image_that_is_in_no_water():
    """A point in front of M2 whose image after unfolding lies behind the window: no ray of the camera comes from it."""
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=PORTS["flat"], mirrors=mirrors(2, 0.0, 0.0))
    m1, m2 = (mirror.reflection for mirror in train.mirrors)
    image = np.array([0.0, -1.0, -0.5])
    assert names(train.project([m2.apply(m1.apply(image))]).status) == ["INSIDE_HOUSING"]


def test_a_point_outside_the_image_keeps_its_pixel():
    """The edge of the image is half a pixel beyond the outermost centres."""
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=NoPort())
    u = np.array([-0.5 - 1e-9, -0.5 + 1e-9, 639.5 - 1e-9, 639.5 + 1e-9])
    points = np.stack([(u - 319.5) / 500, np.zeros(4), np.ones(4)], axis=1)
    image = train.project(points)
    assert names(image.status) == ["OUTSIDE_IMAGE", "OK", "OK", "OUTSIDE_IMAGE"]
    np.testing.assert_allclose(image.pixels[:, 0], u, rtol=0, atol=ROUND_TRIP_PX)


def test_points_outside_the_aperture_or_a_mirror_keep_their_pixel():
    small = FlatPort(distance_m=0.02, thickness_m=0.008, aperture_radius_m=0.005)
    image = OpticalTrain(camera=CAMERAS["pinhole"], port=small).project([[0, 0, 1], [0.35, 0, 1]])
    assert names(image.status) == ["OK", "MISSED_PORT"]
    assert np.isfinite(image.pixels).all()
    tiny = replace(mirrors(1)[0], outline=Rectangle(half_width=1e-3, half_height=1e-3))
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=PORTS["flat"], mirrors=(tiny,))
    image = train.project([[0, 1, 0.095], [0, 1, 0.3]])
    assert names(image.status) == ["OK", "MISSED_M1"]


@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("mirror_count", [0, 2])
@pytest.mark.parametrize("counts", [(1, 7, 0, 300, 1), (300, 1, 0, 7), (0, 5)])
def test_a_kernel_serves_batches_of_any_width_in_any_order(port, mirror_count, counts):
    """A frozen kernel remembers what it was first called with: the second width must not come out as the first."""
    train = OpticalTrain(
        camera=PinholeCamera(**AFFINE | {"width_px": 641}), port=PORTS[port], mirrors=mirrors(mirror_count)
    )
    reference, all_passed = (look(pixel_grid(train.camera, 20, 15)) for look in (train.trace, train.transmittance))
    for count in counts:
        pixels = pixel_grid(train.camera, 20, 15)[:count]
        rays = train.trace(pixels)
        assert rays.origin_m.shape == rays.direction.shape == (count, 3)
        passed = train.transmittance(pixels)
        assert rays.status.shape == passed.shape == rays.region.shape == (count,)
        np.testing.assert_array_equal(rays.direction, reference.direction[:count])
        np.testing.assert_array_equal(rays.origin_m, reference.origin_m[:count])
        np.testing.assert_array_equal(passed, all_passed[:count])
        image = train.project(rays.origin_m + rays.direction)
        assert image.pixels.shape == (count, 2)
        assert image.status.shape == (count,)
        seen = rays.status == Status.OK
        np.testing.assert_allclose(image.pixels[seen], pixels[seen], rtol=0, atol=ROUND_TRIP_PX)


def test_the_numbers_of_a_train_are_not_baked_into_its_kernel():
    """One kernel per kind: another train of the same kind must give its own answer, not the first one's."""
    for distance in (0.02, 0.05):
        for q1 in (0.0, 0.5):
            port = FlatPort(distance_m=distance, thickness_m=0.008)
            train = OpticalTrain(camera=CAMERAS["pinhole"], port=port, mirrors=mirrors(2, q1, 0.1))
            bare = OpticalTrain(camera=CAMERAS["pinhole"], port=port)
            pixels = [[350.0, 220.0]]
            motion = LAYOUT.body_from_camera.inv() * virtual_camera(LAYOUT, q1, 0.1)
            expected = motion.rotation.apply(bare.trace(pixels).direction)
            np.testing.assert_allclose(train.trace(pixels).direction, expected, rtol=0, atol=ROUNDING)


def test_pixels_of_a_grid_are_centres():
    camera = CAMERAS["pinhole"]
    grid = pixel_grid(camera)
    assert grid.shape == (640 * 480, 2)
    assert grid[0].tolist() == [0, 0]
    assert grid[1].tolist() == [1, 0]
    assert grid[-1].tolist() == [639, 479]
    np.testing.assert_allclose(pixel_grid(camera, 2, 1), [[159.5, 239.5], [479.5, 239.5]])


def test_wrong_arguments_are_refused():
    train = OpticalTrain(camera=CAMERAS["pinhole"], port=NoPort())
    with pytest.raises(ValueError, match=r"expected pixels of shape \(n, 2\), got \(4, 3\)"):
        train.trace(np.zeros((4, 3)))
    with pytest.raises(ValueError, match=r"expected points_m of shape \(n, 3\), got \(3,\)"):
        train.project([0, 0, 1])
    with pytest.raises(ValueError, match="expected at most 2 mirrors, got 3"):
        OpticalTrain(camera=CAMERAS["pinhole"], port=NoPort(), mirrors=mirrors(2) + mirrors(1))
    with pytest.raises(ValueError, match=r"expected q1 \(pan\) between"):
        OpticalTrain.from_rig(AQUA2, q1=2.0)


def test_a_rig_without_mirrors_is_a_camera_behind_a_port():
    train = OpticalTrain.from_rig(Rig.load("bench"))
    assert train.mirrors == ()
    assert (train.trace([[train.camera.cx_px, train.camera.cy_px]]).status == Status.OK).all()


def test_many_poses_in_one_kernel_are_one_pose_at_a_time():
    """Poses x pixels, pose by pose, at the outline as without it; both make M2's axes with rounding of their own."""
    rig = Rig.load("aqua2")
    layout, bounded = Layout.from_rig(rig), OpticalTrain.from_rig(rig)
    q1, q2 = np.radians([[-60.0, 0.0, 45.0], [-20.0, 30.0, 100.0]])
    pixels = pixel_grid(bounded.camera, 16, 12)
    for unbounded in (False, True):
        train = bounded.unbounded() if unbounded else bounded
        found = train.trace_poses(pixels, layout.camera_from_m2_at(q1, q2))
        for k, (a, b) in enumerate(zip(q1, q2, strict=True)):
            alone = OpticalTrain.from_rig(rig, q1=a, q2=b)
            alone = (alone.unbounded() if unbounded else alone).trace(pixels)
            some = found[k * len(pixels) : (k + 1) * len(pixels)]
            np.testing.assert_array_equal(some.status, alone.status)
            np.testing.assert_allclose(some.origin_m, alone.origin_m, atol=1e-14)
            np.testing.assert_allclose(some.direction, alone.direction, atol=1e-14)


def test_many_poses_need_a_gaze_mirror():
    with pytest.raises(ValueError, match="expected a train of 2 mirrors, got 0"):
        OpticalTrain.bare(Rig.load("aqua2")).trace_poses([[0, 0]], np.eye(4)[np.newaxis])
