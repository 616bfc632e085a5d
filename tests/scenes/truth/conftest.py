"""A plain renderer of geometry: room, ball and mirrors' plates, in float64 NumPy on the rays of the exact train.

It shares no code with the kernels of `scenes`, so that ground truth can be judged before and beside the fast renderer.
"""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.path import Path
from scipy.spatial.transform import RigidTransform, Rotation

from optics.layout import camera_pose
from optics.status import Region, Status
from optics.train import OpticalTrain, pixel_grid, regions
from rigs import Rig
from scenes.stage.frame import Frame, Label
from scenes.stage.state import State

HALF_ROOM_M = 4.0
FLOOR_M = -6.0
BALL_RADIUS_M = 0.15
BALL_INSTANCE = 6


def stations(train, pixels):
    """Exit rays over 0, 1, ... mirrors: origin, direction, path length from the port, and each pixel's region."""
    trains = [replace(train, mirrors=train.mirrors[:count]) for count in range(len(train.mirrors) + 1)]
    rays = [each.trace(pixels) for each in trains]
    if train.mirrors:
        region = regions(rays[-1].status)
    else:
        region = np.where(rays[0].status == Status.OK, Region.DIRECT, Region.HOUSING)
    count = np.clip(region - Region.DIRECT, 0, None)
    path = np.zeros(len(pixels))
    origin, direction = rays[0].origin_m.copy(), rays[0].direction.copy()
    for step in range(1, len(rays)):
        over = count >= step
        path[over] += np.linalg.norm(rays[step].origin_m - rays[step - 1].origin_m, axis=1)[over]
        origin[over], direction[over] = rays[step].origin_m[over], rays[step].direction[over]
    return origin, direction, path, region


def hit_room(origin, direction):
    """Distance to the room's faces from inside, which face, and its normal into the room."""
    low = np.array([-HALF_ROOM_M, -HALF_ROOM_M, FLOOR_M])
    high = np.array([HALF_ROOM_M, HALF_ROOM_M, 0.0])
    with np.errstate(divide="ignore"):
        times = np.where(direction > 0, (high - origin) / direction, (low - origin) / direction)
    axis = times.argmin(axis=1)
    lanes = np.arange(len(axis))
    upper = direction[lanes, axis] > 0
    normal = np.zeros_like(direction)
    normal[lanes, axis] = np.where(upper, -1.0, 1.0)
    return times[lanes, axis], 2 * axis + upper, normal


def hit_ball(origin, direction, centre, radius):
    offset = origin - centre
    half_b = np.einsum("ij,ij->i", offset, direction)
    depth2 = half_b**2 - np.einsum("ij,ij->i", offset, offset) + radius**2
    distance = -half_b - np.sqrt(np.maximum(depth2, 0))
    return np.where((depth2 > 0) & (distance > 0), distance, np.inf)


def hit_plates(origin, direction, region, mirrors):
    """Distance to the nearest mirror's plate but the one a ray comes from, and its normal towards the ray."""
    nearest, normal = np.full(len(origin), np.inf), np.zeros_like(origin)
    for position, mirror in enumerate(mirrors):
        axes = mirror.axes
        approach = direction @ axes[:, 2]
        reach = (np.asarray(mirror.point_m) - origin) @ axes[:, 2] / approach
        across = (origin + reach[:, np.newaxis] * direction - np.asarray(mirror.point_m)) @ axes[:, :2]
        inside = Path(mirror.outline.rim()).contains_points(across)
        hit = inside & (reach > 0) & (region != Region.FOLD + position) & (reach < nearest)
        nearest = np.where(hit, reach, nearest)
        normal[hit] = -np.sign(approach[hit, np.newaxis]) * axes[:, 2]
    return nearest, normal


def plain_frame(rig, state, shape, *, radius=BALL_RADIUS_M):
    """Frame of the room, the mirrors' plates and a ball at the state's target.

    Faces of the room are instances 0 to 5, the ball is 6.
    """
    train = OpticalTrain.from_rig(rig, q1=state.q1, q2=state.q2)
    rows, columns = shape
    origin, direction, path, region = stations(train, pixel_grid(train.camera, columns, rows))
    to_plate, plate_normal = hit_plates(origin, direction, region, train.mirrors)
    pose = state.world_from_body * camera_pose(rig.camera)
    origin, direction = pose.apply(origin), pose.rotation.apply(direction)
    reach, face, normal = hit_room(origin, direction)
    label = np.where(face == 5, Label.SURFACE, Label.WORLD)
    instance = face.copy()
    if state.world_from_target is not None:
        centre = state.world_from_target.translation
        to_ball = hit_ball(origin, direction, centre, radius)
        ball = to_ball < reach
        reach = np.where(ball, to_ball, reach)
        normal[ball] = (origin + reach[:, np.newaxis] * direction - centre)[ball] / radius
        label, instance = np.where(ball, Label.TARGET, label), np.where(ball, BALL_INSTANCE, instance)
    # A second look into a mirror's front ends on its plate as well: nothing here asks what that would show.
    plate = to_plate < reach
    reach = np.where(plate, to_plate, reach)
    normal[plate] = pose.rotation.apply(plate_normal[plate]) if plate.any() else 0
    label, instance = np.where(plate, Label.MIRROR_BACK, label), np.where(plate, -1, instance)
    sees = region != Region.HOUSING
    label, instance = np.where(sees, label, Label.HOUSING), np.where(sees, instance, -1)
    point = np.where(sees[:, np.newaxis], origin + reach[:, np.newaxis] * direction, np.nan)
    return Frame(
        radiance=np.zeros((*shape, 3), dtype=np.float32),
        distance_m=np.where(sees, path + reach, 0).astype(np.float32).reshape(shape),
        point_m=point.astype(np.float32).reshape(*shape, 3),
        normal=np.where(sees[:, np.newaxis], normal, 0).astype(np.float32).reshape(*shape, 3),
        label=label.astype(np.uint8).reshape(shape),
        region=region.astype(np.uint8).reshape(shape),
        instance=instance.astype(np.int32).reshape(shape),
        target_fraction=(label == Label.TARGET).astype(np.float32).reshape(shape),
    )


def state_at(q1_deg=0.0, q2_deg=0.0, *, position=(0.0, 0.0, -4.0), turn_deg=(0.0, 0.0, 0.0), ball=None, time_s=0.0):
    """State from plain numbers; `turn_deg` is yaw, pitch and roll of the body."""
    pose = RigidTransform.from_components(np.array(position), Rotation.from_euler("ZYX", turn_deg, degrees=True))
    target = None if ball is None else RigidTransform.from_translation(np.array(ball))
    return State(
        q1=np.radians(q1_deg),
        q2=np.radians(q2_deg),
        world_from_body=pose,
        world_from_target=target,
        time_s=time_s,
    )


@pytest.fixture(scope="session")
def plain():
    return plain_frame


@pytest.fixture(scope="session")
def make_state():
    return state_at


@pytest.fixture(scope="session")
def aqua2():
    return Rig.load("aqua2")
