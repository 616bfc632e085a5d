"""The kernel of many poses against one pose at a time: `OpticalTrain.trace` and boxes as slabs, in float64."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from plain_boxes import box_part, slab_distance

from optics.analysis import Fate, usable_fov
from optics.analysis.fate import FATE_OF_ROLE, fates_of_status
from optics.analysis.field import pixel_solid_angles
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

Array = NDArray[np.float64]

POSES_DEG = np.array(
    [[0, 0], [30, -10], [-77.5, 122.5], [77.5, -32.5], [12, 45], [-50, 80], [5, 100], [60, 20], [-20, -30]]
)
Q1, Q2 = np.radians(POSES_DEG).T

ROUNDING_SR = 1e-12
"""Sums of 3072 solid angles of 1e-4 sr in float64."""


@pytest.fixture(scope="module", params=["aqua2", "bluerov2"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return Rig.load(request.param)


def plain_fates(rig: Rig, parts: list[PartMesh], q1: float, q2: float) -> NDArray[np.int32]:
    """`Fate` of every cell at one pose: trace it, then try every box on every piece of its way, nearest first."""
    layout = Layout.from_rig(rig)
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    pixels = pixel_grid(train.camera, 64, 48)
    fates = fates_of_status(train.trace(pixels).status)
    rays = [dataclasses.replace(train, mirrors=train.mirrors[:count]).trace(pixels) for count in (0, 1, 2)]
    points = [layout.body_from_camera.apply(r.origin_m) for r in rays]
    directions = [layout.body_from_camera.rotation.apply(r.direction) for r in rays]
    frames = {
        Group.FIXED: layout.body_from_camera * layout.body_from_camera.inv(),
        Group.PAN: layout.body_from_pan(q1),
        Group.TILT: layout.body_from_m2(q1, q2),
    }
    # How far a ray got before it was lost: a ray that misses M2 is not followed beyond M1.
    stages = np.select([fates == Fate.SEEN, fates == Fate.MISSED_M1, fates == Fate.PORT], [3, 0, 0], 1)
    for stage in (2, 1, 0):
        length = np.linalg.norm(points[stage + 1] - points[stage], axis=1) if stage < 2 else np.full(len(fates), np.inf)
        hits = np.stack(
            [
                slab_distance(
                    part,
                    frames[part.group].inv().apply(points[stage]),
                    frames[part.group].inv().rotation.apply(directions[stage]),
                )
                for part in parts
            ]
        )
        blocked = (hits.min(axis=0) < length) & (stages > stage)
        blockers = np.array([FATE_OF_ROLE[part.role] for part in parts])[hits.argmin(axis=0)]
        fates = np.where(blocked, blockers, fates).astype(np.int32)
    return fates


def assert_same_views(rig: Rig, parts: list[PartMesh]) -> NDArray[np.int64]:
    fov = usable_fov(rig, parts, q1=Q1, q2=Q2)
    train = OpticalTrain.from_rig(rig)
    solid_angle = pixel_solid_angles(train.camera, train.port, 64, 48)
    for k, (q1, q2) in enumerate(zip(Q1, Q2, strict=True)):
        fates = plain_fates(rig, parts or [NOWHERE], q1, q2)
        np.testing.assert_array_equal(fov.pixels[k], np.bincount(fates, minlength=len(Fate)))
        expected = np.bincount(fates, weights=solid_angle, minlength=len(Fate))
        np.testing.assert_allclose(fov.solid_angle_by_fate_sr[k], expected, atol=ROUNDING_SR)
    return fov.pixels


NOWHERE = box_part([50, 50, 50], [51, 51, 51], group=Group.FIXED, role=Role.HULL)


def test_bare_mirrors_agree_with_the_trace_of_each_pose(rig: Rig) -> None:
    pixels = assert_same_views(rig, [])
    assert (pixels[0, [Fate.SEEN, Fate.MISSED_M2]] > 0).all()
    assert pixels[:, [Fate.HULL, Fate.MOUNT, Fate.FOLD_MIRROR]].sum() == 0


@pytest.mark.parametrize("group", list(Group))
@pytest.mark.parametrize("role", [Role.HULL, Role.SERVO])
def test_boxes_of_each_group_block_what_their_slabs_do(rig: Rig, group: Group, role: Role) -> None:
    # Boxes around the gimbal: beams from M1 and towards the water pass between and through them.
    centre = Layout.from_rig(rig).body_from_gimbal.translation if group is Group.FIXED else np.zeros(3)
    rng = np.random.default_rng(7)
    parts = []
    for k in range(12):
        low = centre + rng.uniform(-0.15, 0.15, 3)
        size = rng.uniform(0.01, 0.04, 3)
        if group is Group.TILT:
            # In front of the face: what crosses it would cut the mirror itself.
            low[2] = abs(low[2]) + 0.001
        if group is Group.PAN:
            low += 0.1 * np.sign(low)
        parts.append(box_part(low, low + size, group=group, role=role, name=f"box {k}"))
    pixels = assert_same_views(rig, parts)
    assert 0 < pixels[:, FATE_OF_ROLE[role]].sum() < 0.9 * pixels[:, :6].sum()


@pytest.mark.parametrize(("servo_m", "hull_m"), [(0.2, 0.3), (0.3, 0.2)])
def test_each_loss_goes_to_the_first_part_in_the_way(rig: Rig, servo_m: float, hull_m: float) -> None:
    origin = Layout.from_rig(rig).body_from_gimbal.translation
    post = np.array([[0, -0.02, -0.5], [0.02, 0.02, 0.5]])
    wide_post = post * [1, 3, 1]
    (servo_low, servo_high), (hull_low, hull_high) = (
        (wide_post if distance > 0.25 else post) + [distance, 0, 0] for distance in (servo_m, hull_m)
    )
    parts = [
        box_part(servo_low, servo_high, group=Group.PAN, role=Role.SERVO),
        box_part(origin + hull_low, origin + hull_high, group=Group.FIXED, role=Role.HULL),
        box_part([-0.01, -0.01, 0.02], [0.01, 0.01, 0.03], group=Group.TILT, role=Role.MIRROR),
    ]
    pixels = assert_same_views(rig, parts)
    assert (pixels[0, [Fate.HULL, Fate.MOUNT, Fate.FOLD_MIRROR]] > 0).all()


@pytest.mark.parametrize("group", [Group.FIXED, Group.PAN])
def test_what_stands_between_port_and_fold_mirror_blocks(rig: Rig, group: Group) -> None:
    layout = Layout.from_rig(rig)
    middle = (layout.body_from_camera.translation + 3 * layout.body_from_m1.translation) / 4
    if group is Group.PAN:
        # A mast on the yoke, so high that it stands in the camera's view of M1 when the pan is at zero.
        middle = middle - layout.body_from_gimbal.translation
    half = np.array([0.002, 0.004, 0.004])
    pixels = assert_same_views(rig, [box_part(middle - half, middle + half, group=group, role=Role.MOUNT)])
    assert pixels[0, Fate.MOUNT] > 0


def mirror_plate(rig: Rig, group: Group) -> PartMesh:
    """Plate of M1 (fixed) or M2 (tilt) with its face exactly where the mirror is."""
    plate = rig.fold_mirror if group is Group.FIXED else rig.gaze_mirror
    assert plate is not None
    half = np.array([plate.width_mm, plate.height_mm]) / 2000
    box = box_part([*-half, -plate.thickness_mm / 1000], [*half, 0.0], group=group, role=Role.MIRROR)
    if group is Group.TILT:
        return box
    return dataclasses.replace(box, vertices_m=Layout.from_rig(rig).body_from_m1.apply(box.vertices_m))


def test_a_mirror_does_not_block_its_own_face(rig: Rig) -> None:
    plates = [mirror_plate(rig, Group.FIXED), mirror_plate(rig, Group.TILT)]
    bare, with_plates = (usable_fov(rig, parts, q1=Q1, q2=Q2).pixels for parts in ([], plates))
    # Where the gaze is away from M1 nothing changes, not by one pixel.
    away = np.isin(np.arange(len(Q1)), [0, 1, 3, 8])
    np.testing.assert_array_equal(with_plates[away], bare[away])


def test_gaze_straight_up_meets_the_fold_mirror(rig: Rig) -> None:
    """The axis comes back the way it went: in the middle of its view the camera sees itself."""
    assert rig.fold_mirror is not None
    up = {"q1": [0.0], "q2": [np.pi / 4]}
    # So thin that only its face can be hit: the sides of a real plate face the water, too.
    thin = rig.model_copy(update={"fold_mirror": rig.fold_mirror.model_copy(update={"thickness_mm": 1e-3})})
    fov, bare = (usable_fov(rig, parts, **up) for parts in ([mirror_plate(thin, Group.FIXED)], []))
    train = OpticalTrain.from_rig(rig, q2=np.pi / 4)
    rays = train.trace(pixel_grid(train.camera, 64, 48))
    m1_from_camera = Layout.from_rig(rig).camera_from_m1.inv()
    start, direction = m1_from_camera.apply(rays.origin_m), m1_from_camera.rotation.apply(rays.direction)
    crossing = start - direction * (start[:, 2] / direction[:, 2])[:, np.newaxis]
    half = np.array([rig.fold_mirror.width_mm, rig.fold_mirror.height_mm]) / 2000
    on_m1 = (np.abs(crossing[:, :2]) <= half).all(axis=1) & (rays.status == Status.OK)
    assert 0 < on_m1.sum() == fov.pixels[0, Fate.FOLD_MIRROR]
    assert fov.pixels[0, Fate.SEEN] == bare.pixels[0, Fate.SEEN] - on_m1.sum()


@pytest.mark.parametrize(
    ("q1", "q2", "message"),
    [
        ([], [], r"expected q1 of shape \(n,\), n > 0"),
        ([np.nan], [0.0], "finite"),
        ([[0.0]], [0.0], r"shape \(n,\)"),
        ([0.0, 0.1], [0.0], "as many q1 as q2, got 2 and 1"),
        ([np.radians(80)], [0.0], r"q1 \(pan\) between -77\.5 and 77\.5 deg, got 80"),
    ],
)
def test_wrong_poses_are_refused(q1: list[float], q2: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        usable_fov(Rig.load("aqua2"), [], q1=q1, q2=q2)


def test_an_empty_image_and_a_rig_without_mirrors_are_refused() -> None:
    with pytest.raises(ValueError, match="columns > 0, got 0"):
        usable_fov(Rig.load("aqua2"), [], q1=[0.0], q2=[0.0], columns=0)
    with pytest.raises(ValueError, match="rig with mirrors, got 'bench'"):
        usable_fov(Rig.load("bench"), [], q1=[0.0], q2=[0.0])
