"""Motion vectors against `OpticalTrain.project`, closed forms, and rays followed by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from optics.layout import Layout, camera_pose
from optics.mesh import Group, PartMesh, Role
from optics.status import Region, Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from scenes.stage.frame import Label
from scenes.truth import ground_truth
from scenes.truth.carriers import Carrier, carriers
from scenes.truth.motion import Seen

SHAPE = (60, 80)

ISSUE_BOUND_PX = 0.05
"""Known points against the exact projection, in pixels of the camera."""

SINGLE_PRECISION_PX = 1e-3
"""Pixels of the camera. World coordinates up to 8 m hold 2.4e-7 m in single precision; a wall 1 m and more away, a
focal length of up to 1000 px in air (1340 px in water) and three coordinates make 6e-4 px of it."""


def full_pixels(rig, motion, shape=SHAPE):
    """Where points appear in the other state, in the camera's pixels, shape (h, w, 2)."""
    rows, columns = shape
    per = np.array([rig.camera.width_px / columns, rig.camera.height_px / rows])
    centres = pixel_grid(OpticalTrain.from_rig(rig).camera, columns, rows).reshape(rows, columns, 2)
    return centres + np.stack([motion.du_px, motion.dv_px], axis=-1) * per


@settings(max_examples=12)
@given(
    name=st.sampled_from(["aqua2", "bluerov2"]),
    joints=st.tuples(st.floats(-40, 40), st.floats(-15, 8)),
    turn=st.tuples(st.floats(-180, 180), st.floats(-20, 20), st.floats(-20, 20)),
)
def test_pixels_points_return_to_their_pixels(plain, make_state, name, joints, turn):
    """No motion at all, and the same by `OpticalTrain.project` with the mirrors of the region: both within the bound.

    Expected: 0.05 px; measured below 0.0003 px, which is what single precision leaves of the points.
    """
    rig = Rig.load(name)
    state = make_state(*joints, turn_deg=turn, ball=(1.5, 0.4, -4.6))
    frame = plain(rig, state, SHAPE)
    still = ground_truth(frame, rig, state, next_state=state, next_frame=frame).forward
    sees = frame.region != Region.HOUSING
    assert (still.seen[sees] == Seen.YES).mean() > 0.995  # the rest lies on an edge of a mirror or the ball
    centres = pixel_grid(OpticalTrain.from_rig(rig).camera, SHAPE[1], SHAPE[0]).reshape(*SHAPE, 2)
    largest = np.linalg.norm((full_pixels(rig, still) - centres)[sees], axis=1).max()
    assert largest < SINGLE_PRECISION_PX < ISSUE_BOUND_PX

    train = OpticalTrain.from_rig(rig, q1=state.q1, q2=state.q2)
    to_camera = (state.world_from_body * camera_pose(rig.camera)).inv()
    for count, region in enumerate((Region.DIRECT, Region.FOLD, Region.GAZE)):
        here = frame.region == region
        image = replace(train, mirrors=train.mirrors[:count]).project(to_camera.apply(frame.point_m[here]))
        assert (image.status == Status.OK).mean() > 0.99
        assert np.abs(image.pixels - centres[here]).max() < ISSUE_BOUND_PX


def test_points_appear_where_the_train_projects_them(aqua2, plain, make_state):
    """Another pose of the robot and other joint values: the kernel's pixels are `OpticalTrain.project`'s."""
    state = make_state(10.0, -8.0, ball=(1.5, 0.4, -4.6))
    other = make_state(
        14.0, -6.0, position=(0.05, -0.03, -4.02), turn_deg=(2.0, -1.0, 1.0), ball=(1.5, 0.4, -4.6), time_s=0.1
    )
    frame, shown = plain(aqua2, state, SHAPE), plain(aqua2, other, SHAPE)
    forward = ground_truth(frame, aqua2, state, next_state=other, next_frame=shown).forward
    train = OpticalTrain.from_rig(aqua2, q1=other.q1, q2=other.q2)
    to_camera = (other.world_from_body * camera_pose(aqua2.camera)).inv()
    pixels = full_pixels(aqua2, forward)
    for count, region in enumerate((Region.DIRECT, Region.FOLD, Region.GAZE)):
        here = (frame.region == region) & (forward.seen < Seen.NO_IMAGE)
        image = replace(train, mirrors=train.mirrors[:count]).project(to_camera.apply(frame.point_m[here]))
        # Vectors of up to 1000 px in single precision.
        np.testing.assert_allclose(pixels[here], image.pixels, atol=1e-3)
        outside = image.status == Status.OUTSIDE_IMAGE
        assert ((forward.seen[here] == Seen.LEFT_IMAGE) == outside).all()
        assert here.sum() > 100


def test_there_and_back_again(aqua2, plain, make_state):
    """Forward flow leads to a pixel whose backward flow leads back, where surfaces are smooth: the room's walls."""
    state, other = make_state(10.0, -8.0), make_state(12.0, -7.0, position=(0.03, 0.0, -4.0), time_s=0.1)
    frame, shown = plain(aqua2, state, (120, 160)), plain(aqua2, other, (120, 160))
    forward = ground_truth(frame, aqua2, state, next_state=other, next_frame=shown).forward
    backward = ground_truth(shown, aqua2, other, previous_state=state, previous_frame=frame).backward
    v, u = np.nonzero((forward.seen == Seen.YES) & (frame.region == Region.GAZE))
    at_u, at_v = np.round(u + forward.du_px[v, u]).astype(int), np.round(v + forward.dv_px[v, u]).astype(int)
    same = (shown.instance[at_v, at_u] == frame.instance[v, u]) & (shown.region[at_v, at_u] == Region.GAZE)
    assert same.mean() > 0.9
    u, v, at_u, at_v = u[same], v[same], at_u[same], at_v[same]
    back_u = at_u + backward.du_px[at_v, at_u]
    # The pixel nearest to where it went is up to half a pixel off, and so is the way back; the image hardly stretches.
    assert np.abs(back_u - u).max() < 0.5 * 1.2
    assert (backward.seen[at_v, at_u] == Seen.YES).mean() > 0.97


def test_flow_of_a_distant_wall_under_a_turn_of_yaw(make_state, plain):
    """Closed form: behind a flat port on its axis a small turn w moves distant points by f n w (paraxial Snell)."""
    rig = Rig.load("bench")
    turn_deg = 0.2
    state, other = make_state(), make_state(turn_deg=(turn_deg, 0.0, 0.0))
    shape = (rig.camera.height_px // 8, rig.camera.width_px // 8)
    frame = plain(rig, state, shape)
    forward = ground_truth(frame, rig, state, next_state=other).forward
    middle = (shape[0] // 2, shape[1] // 2)
    assert frame.region[middle] == Region.DIRECT
    moved = forward.du_px[middle] * 8
    # The camera turns to the left about the body's origin, so that things move to the right; being ahead of the origin
    # it is also carried to the left, which adds the share lever / distance.
    lever = camera_pose(rig.camera).translation[0]
    n_water = OpticalTrain.from_rig(rig).port.n_water
    expected = rig.camera.fx_px * n_water * np.radians(turn_deg) * (1 + lever / (4.0 - lever))
    # Distances count from the port's virtual pinhole, up to some centimetres of 4 m away.
    assert moved == pytest.approx(expected, rel=0.02)


def test_hull_and_mirrors_carry_their_points(aqua2, plain, make_state):
    """What the robot carries does not move in its own image when the robot does; what turns with a joint does."""
    state = make_state(10.0, -8.0)
    moved = make_state(10.0, -8.0, position=(1.0, -0.5, -3.0), turn_deg=(60.0, 10.0, -20.0))
    turned = make_state(13.0, -5.0)
    frame = plain(aqua2, state, SHAPE)
    # A dot of each group a little before the wall it hides: only what carries it matters here.
    parts = [
        PartMesh(
            name=f"part {group}",
            group=group,
            role=Role.MOUNT,
            vertices_m=np.zeros((3, 3)),
            faces=np.eye(1, 3, dtype=np.int32),
        )
        for group in Group
    ]
    rng = np.random.default_rng(5)
    instance = rng.integers(0, 3, SHAPE).astype(np.int32)
    label = np.where(frame.region == Region.HOUSING, Label.HOUSING, Label.MOUNT).astype(np.uint8)
    robot = replace(frame, label=label, instance=instance)
    names = [part.name for part in parts]

    def towards(other):
        truth = ground_truth(robot, aqua2, state, parts=parts, instance_names=names, next_state=other)
        return truth.forward

    ride = towards(moved)
    seen = robot.region != Region.HOUSING
    assert np.hypot(ride.du_px[seen], ride.dv_px[seen]).max() < 10 * SINGLE_PRECISION_PX  # seen from twice the way
    turn = towards(turned)
    fixed, pan = (seen & (instance == k) & (robot.region == Region.FOLD) for k in (0, 1))
    assert np.hypot(turn.du_px[fixed], turn.dv_px[fixed]).max() < 10 * SINGLE_PRECISION_PX
    assert np.hypot(turn.du_px[pan], turn.dv_px[pan]).min() > 0.1
    # By hand: a point of the yoke turns about the gimbal's axis by three degrees, whatever the tilt does.
    layout = Layout.from_rig(aqua2)
    spin = layout.body_from_pan(turned.q1) * layout.body_from_pan(state.q1).inv()
    body_point = state.world_from_body.inv().apply(robot.point_m[pan].astype(float))
    train = OpticalTrain.from_rig(aqua2, q1=turned.q1, q2=turned.q2)
    camera_point = layout.body_from_camera.inv().apply(spin.apply(body_point))
    image = replace(train, mirrors=train.mirrors[:1]).project(camera_point)
    known = turn.seen[pan] < Seen.NO_IMAGE
    np.testing.assert_allclose(full_pixels(aqua2, turn)[pan][known], image.pixels[known], atol=1e-2)


def test_a_mirrors_back_rides_with_its_mirror(aqua2, plain, make_state):
    """Points put on M1's plate stay with the hull, points on M2's turn with both joints, others are nobody's."""
    state = make_state(20.0, -5.0, turn_deg=(40.0, 3.0, -8.0))
    layout = Layout.from_rig(aqua2)
    on_plate = np.random.default_rng(3).uniform(-0.05, 0.05, (*SHAPE, 3)) * [1, 1, 0]
    poses = [layout.body_from_m1, layout.body_from_m2(state.q1, state.q2)]
    frame = plain(aqua2, state, SHAPE)
    backs = replace(frame, label=np.full(SHAPE, Label.MIRROR_BACK, dtype=np.uint8), instance=np.full(SHAPE, -1))
    for pose, carrier in zip(poses, (Carrier.HULL, Carrier.TILT), strict=True):
        points = (state.world_from_body * pose).apply(on_plate.reshape(-1, 3)).reshape(*SHAPE, 3)
        plate = replace(backs, point_m=points.astype(np.float32))
        assert (carriers(plate, aqua2, state) == carrier).all()
    assert (carriers(backs, aqua2, state) == Carrier.NOTHING).mean() > 0.99


def test_a_part_nobody_named_has_no_motion(aqua2, plain, make_state):
    state = make_state()
    frame = plain(aqua2, state, SHAPE)
    servo = replace(frame, label=np.full(SHAPE, Label.SERVO, dtype=np.uint8))
    assert (ground_truth(servo, aqua2, state, next_state=state).forward.seen == Seen.NO_POINT).all()


def test_a_target_moves_with_its_pose(aqua2, plain, make_state):
    """Without a pose there, it has no vector; with one, its centre's neighbours go where the ball's centre goes."""
    state = make_state(0.0, 0.0, ball=(1.6, 0.0, -4.2))
    shifted = make_state(0.0, 0.0, ball=(1.6, 0.1, -4.15))
    frame = plain(aqua2, state, SHAPE)
    ball = frame.label == Label.TARGET
    assert ball.sum() > 20
    lost = ground_truth(frame, aqua2, state, next_state=replace(shifted, world_from_target=None)).forward
    assert (lost.seen[ball] == Seen.NO_POINT).all()
    forward = ground_truth(frame, aqua2, state, next_state=shifted).forward
    assert (forward.seen[ball & (frame.region == Region.GAZE)] != Seen.NO_POINT).all()
    train = OpticalTrain.from_rig(aqua2)
    to_camera = (state.world_from_body * camera_pose(aqua2.camera)).inv()
    before, after = (
        train.project(to_camera.apply(frame.point_m[ball].astype(float) + step)).pixels
        for step in (np.zeros(3), np.array([0.0, 0.1, 0.05]))
    )
    gaze = frame.region[ball] == Region.GAZE
    moved = np.stack([forward.du_px[ball], forward.dv_px[ball]], axis=-1) * 8  # 640 columns in 80
    np.testing.assert_allclose(moved[gaze], (after - before)[gaze], atol=2e-3)


def test_what_a_ball_hides_in_the_other_frame_is_hidden(aqua2, plain, make_state):
    """Rationale: a wall's point is hidden if the straight way to it, behind the last mirror, hits the ball.

    Expected: the status says so but for a rim of one pixel around the ball's outline; and only with the other frame.
    """
    shape = (240, 320)
    state = make_state(0.0, 0.0)
    other = make_state(2.0, 0.0, ball=(2.0, 0.1, -4.05))
    frame, shown = plain(aqua2, state, shape), plain(aqua2, other, shape)
    forward = ground_truth(frame, aqua2, state, next_state=other, next_frame=shown).forward
    unknown = ground_truth(frame, aqua2, state, next_state=other).forward
    train = OpticalTrain.from_rig(aqua2, q1=other.q1, q2=other.q2)
    gaze = (frame.region == Region.GAZE) & (forward.seen <= Seen.HIDDEN) & (forward.seen != Seen.LEFT_IMAGE)
    pose = other.world_from_body * camera_pose(aqua2.camera)
    origin = pose.apply(train.trace(full_pixels(aqua2, forward, shape)[gaze].astype(float)).origin_m)
    way = frame.point_m[gaze] - origin
    centre = other.world_from_target.translation
    along = np.clip(np.einsum("ij,ij->i", centre - origin, way) / np.einsum("ij,ij->i", way, way), 0, 1)
    apart = np.linalg.norm(origin + along[:, np.newaxis] * way - centre, axis=1)
    hidden = forward.seen[gaze] == Seen.HIDDEN
    # One pixel of 320 columns over 2.3 m of way: 2.3 m / (250 px * 1.34).
    rim = 1.5 * 2.3 / 335
    inner, outer = apart < 0.15 - rim, apart > 0.15 + rim
    assert inner.sum() > 300
    assert hidden[inner].all()
    assert not hidden[outer].any()
    assert not (unknown.seen == Seen.HIDDEN).any()


def test_leaving_a_mirror_is_another_region(aqua2, plain, make_state):
    """By the trace: the pixel where the gaze's train would show the point looks over fewer mirrors, or past them."""
    state, other = make_state(0.0, 0.0), make_state(6.0, 0.0)
    frame = plain(aqua2, state, SHAPE)
    forward = ground_truth(frame, aqua2, state, next_state=other).forward
    gaze = (frame.region == Region.GAZE) & (forward.seen < Seen.NO_IMAGE) & (forward.seen != Seen.LEFT_IMAGE)
    train = OpticalTrain.from_rig(aqua2, q1=other.q1, q2=other.q2)
    status = train.trace(full_pixels(aqua2, forward)[gaze].astype(float)).status
    expected = status != Status.OK
    assert ((forward.seen[gaze] == Seen.OTHER_REGION) == expected).mean() > 0.995  # single precision on the edges
    assert expected.any()
    assert not expected.all()


def test_what_is_behind_the_mirror_there_has_no_image(aqua2, plain, make_state):
    """By hand: the side of M2's plane on which a point lies, after the robot turned away from it."""
    state, other = make_state(), make_state(turn_deg=(80.0, 0.0, 0.0))
    frame = plain(aqua2, state, SHAPE)
    forward = ground_truth(frame, aqua2, state, next_state=other).forward
    gaze = frame.region == Region.GAZE
    mirror = OpticalTrain.from_rig(aqua2, q1=other.q1, q2=other.q2).mirrors[1]
    to_camera = (other.world_from_body * camera_pose(aqua2.camera)).inv()
    off = (to_camera.apply(frame.point_m[gaze].astype(float)) - mirror.point_m) @ mirror.axes[:, 2]
    assert (off < 0).any()
    assert (forward.seen[gaze][off < 0] == Seen.NO_IMAGE).all()
    assert np.isnan(forward.du_px[gaze][off < 0]).all()


def test_open_water_does_not_move(aqua2, plain, make_state):
    state = make_state()
    frame = plain(aqua2, state, SHAPE)
    water = replace(
        frame,
        label=np.full(SHAPE, Label.OPEN_WATER, dtype=np.uint8),
        distance_m=np.full(SHAPE, np.inf, dtype=np.float32),
        point_m=np.full((*SHAPE, 3), np.nan, dtype=np.float32),
    )
    forward = ground_truth(water, aqua2, state, next_state=state).forward
    assert (forward.seen == Seen.NO_POINT).all()
    assert np.isnan(forward.du_px).all()


def test_frames_of_different_size_are_refused(aqua2, plain, make_state):
    state = make_state()
    small, large = plain(aqua2, state, (6, 8)), plain(aqua2, state, SHAPE)
    with pytest.raises(ValueError, match=r"frames of one size, got \(6, 8\) and \(60, 80\)"):
        ground_truth(small, aqua2, state, next_state=state, next_frame=large)
    with pytest.raises(ValueError, match="a state for each frame"):
        ground_truth(small, aqua2, state, next_frame=small)
