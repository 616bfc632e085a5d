"""The kernel of many poses against one pose at a time: `OpticalTrain.trace` and boxes as slabs, in float64."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from plain_boxes import box_part, slab_distance
from scipy.spatial.transform import RigidTransform

from optics.coverage.field import pixel_solid_angles
from optics.coverage.outcome import BLOCKERS, Outcome, outcome_at_part, outcomes_of_status
from optics.coverage.usable_fov import usable_fov
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.status import Region, Status
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


def plain_outcomes(rig: Rig, parts: list[PartMesh], q1: float, q2: float) -> NDArray[np.int32]:
    """`Outcome` of every cell at one pose: trace it, then try every box on every piece of its way, nearest first."""
    layout = Layout.from_rig(rig)
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    pixels = pixel_grid(train.camera, 64, 48)
    outcomes = outcomes_of_status(train.trace(pixels).status)
    rays = [dataclasses.replace(train, mirrors=train.mirrors[:count]).trace(pixels) for count in (0, 1, 2)]
    points = [layout.body_from_camera.apply(r.origin_m) for r in rays]
    directions = [layout.body_from_camera.rotation.apply(r.direction) for r in rays]
    frames = {
        Group.FIXED: layout.body_from_camera * layout.body_from_camera.inv(),
        Group.PAN: layout.body_from_pan(q1),
        Group.TILT: layout.body_from_m2(q1, q2),
    }
    # What misses a mirror is lost to its edge, whatever it meets.
    both = outcomes == Outcome.SEEN
    for stage in (2, 1, 0):
        length = (
            np.linalg.norm(points[stage + 1] - points[stage], axis=1) if stage < 2 else np.full(len(outcomes), np.inf)
        )
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
        blocked = (hits.min(axis=0) < length) & both
        blockers = np.array([outcome_at_part(part) for part in parts])[hits.argmin(axis=0)]
        outcomes = np.where(blocked, blockers, outcomes).astype(np.int32)
    return outcomes


def assert_same_views(rig: Rig, parts: list[PartMesh]) -> NDArray[np.int64]:
    fov = usable_fov(rig, parts, q1=Q1, q2=Q2)
    train = OpticalTrain.from_rig(rig)
    solid_angle = pixel_solid_angles(train.camera, train.port, 64, 48)
    for k, (q1, q2) in enumerate(zip(Q1, Q2, strict=True)):
        outcomes = plain_outcomes(rig, parts or [NOWHERE], q1, q2)
        np.testing.assert_array_equal(fov.pixels[k], np.bincount(outcomes, minlength=len(Outcome)))
        expected = np.bincount(outcomes, weights=solid_angle, minlength=len(Outcome))
        np.testing.assert_allclose(fov.solid_angle_by_outcome_sr[k], expected, atol=ROUNDING_SR)
    return fov.pixels


def begins_inside(rig: Rig, group: Group, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Whether rays leave the port inside a box at one of the poses."""
    layout, train = Layout.from_rig(rig), OpticalTrain.from_rig(rig)
    exits = layout.body_from_camera.apply(
        dataclasses.replace(train, mirrors=()).trace(pixel_grid(train.camera, 64, 48)).origin_m
    )
    for q1, q2 in zip(Q1, Q2, strict=True):
        frame = {
            Group.FIXED: RigidTransform.identity(),
            Group.PAN: layout.body_from_pan(q1),
            Group.TILT: layout.body_from_m2(q1, q2),
        }[group]
        points = frame.inv().apply(exits)
        if ((points > low) & (points < high)).all(axis=1).any():
            return True
    return False


NOWHERE = box_part([50, 50, 50], [51, 51, 51], group=Group.FIXED, role=Role.HULL)


def test_bare_mirrors_agree_with_the_trace_of_each_pose(rig: Rig) -> None:
    pixels = assert_same_views(rig, [])
    assert (pixels[0, [Outcome.SEEN, Outcome.MISSED_M2]] > 0).all()
    assert pixels[:, list(BLOCKERS)].sum() == 0


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
        if begins_inside(rig, group, low, low + size):
            # No part can be there, and a ray that leaves it within 0.05 mm is taken to have begun outside.
            continue
        parts.append(box_part(low, low + size, group=group, role=role, name=f"box {k}"))
    pixels = assert_same_views(rig, parts)
    assert 0 < pixels[:, outcome_at_part(parts[0])].sum() < 0.9 * pixels[:, : Outcome.HULL].sum()


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
    assert (pixels[0, [Outcome.HULL, Outcome.SERVO, Outcome.MIRROR_PLATE]] > 0).all()


@pytest.mark.parametrize("group", [Group.FIXED, Group.PAN])
def test_what_stands_between_port_and_fold_mirror_blocks(rig: Rig, group: Group) -> None:
    layout = Layout.from_rig(rig)
    middle = (layout.body_from_camera.translation + 3 * layout.body_from_m1.translation) / 4
    if group is Group.PAN:
        # A mast on the yoke, so high that it stands in the camera's view of M1 when the pan is at zero.
        middle = middle - layout.body_from_gimbal.translation
    half = np.array([0.002, 0.004, 0.004])
    pixels = assert_same_views(rig, [box_part(middle - half, middle + half, group=group, role=Role.MOUNT)])
    assert pixels[0, Outcome.MOUNT] > 0


def plain_regions(rig: Rig, part: PartMesh, q1: float, q2: float) -> NDArray[np.int64]:
    """Cells by `Region` and whether a fixed box hides what they show, shape (4, 2), each piece of way tried alone."""
    layout = Layout.from_rig(rig)
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    pixels = pixel_grid(train.camera, 64, 48)
    whole = train.trace(pixels)
    hidden = np.zeros(len(pixels), dtype=bool)
    for count, last_way in enumerate((Region.DIRECT, Region.FOLD, Region.GAZE)):
        rays, onwards = (
            dataclasses.replace(train, mirrors=train.mirrors[:k]).trace(pixels) for k in (count, count + 1)
        )
        start = layout.body_from_camera.apply(rays.origin_m)
        direction = layout.body_from_camera.rotation.apply(rays.direction)
        length = np.linalg.norm(onwards.origin_m - rays.origin_m, axis=1) if count < 2 else np.inf
        length = np.where(whole.region == last_way, np.inf, length)
        hidden |= (whole.region >= last_way) & (slab_distance(part, start, direction) < length)
    table = np.zeros((len(Region), 2), dtype=np.int64)
    np.add.at(table, (whole.region, hidden.astype(int)), 1)
    return table


@pytest.mark.parametrize("size", [0.02, 0.1])
@pytest.mark.parametrize("offset", [(0.05, 0.0, -0.3), (0.3, 0.05, 0.0), (0.25, 0.0, -0.1)])
def test_each_region_shows_what_stands_before_it(rig: Rig, offset: tuple[float, float, float], size: float) -> None:
    """Boxes ahead (direct view), below (fold view) and in the gaze's way, against slabs in NumPy and float64."""
    layout = Layout.from_rig(rig)
    middle = layout.body_from_m1.translation + np.array(offset)
    box = box_part(middle - size, middle + size, group=Group.FIXED, role=Role.HULL)
    fov = usable_fov(rig, [box], q1=Q1, q2=Q2)
    solid_angle = pixel_solid_angles(
        *(getattr(OpticalTrain.from_rig(rig), name) for name in ("camera", "port")), 64, 48
    )
    bare = usable_fov(rig, [], q1=Q1, q2=Q2)
    np.testing.assert_allclose(fov.solid_angle_by_region_sr.sum(axis=-1), bare.solid_angle_by_region_sr.sum(axis=-1))
    for k, (q1, q2) in enumerate(zip(Q1, Q2, strict=True)):
        expected = plain_regions(rig, box, q1, q2)
        shown = fov.solid_angle_by_region_sr[k]
        for region in (Region.DIRECT, Region.FOLD, Region.GAZE):
            # Cells differ by tens of per cent in solid angle: compare what no other number of cells could give.
            assert (shown[region, Outcome.HULL] == 0) == (expected[region, 1] == 0)
            assert shown[region, Outcome.HULL] <= expected[region, 1] * solid_angle.max() * (1 + ROUNDING_SR)
            assert shown[region, Outcome.HULL] >= expected[region, 1] * solid_angle.min() * (1 - ROUNDING_SR)
            assert shown[region, Outcome.SEEN] <= expected[region, 0] * solid_angle.max() * (1 + ROUNDING_SR)


def test_every_region_loses_everything_to_an_opaque_world(rig: Rig) -> None:
    around = box_part([-50, -50, -50], [50, 50, 50], group=Group.FIXED, role=Role.SERVO)
    bare, hidden = (usable_fov(rig, parts, q1=Q1, q2=Q2) for parts in ([], [around]))
    for region in (Region.DIRECT, Region.FOLD, Region.GAZE):
        shown = hidden.solid_angle_by_region_sr[:, region]
        np.testing.assert_allclose(shown[:, Outcome.SERVO], bare.solid_angle_by_region_sr[:, region, Outcome.SEEN])
        assert (shown[:, Outcome.SEEN] == 0).all()
    # What misses the mirrors is lost to their edges all the same.
    np.testing.assert_array_equal(hidden.pixels[:, Outcome.MISSED_M2], bare.pixels[:, Outcome.MISSED_M2])
    np.testing.assert_array_equal(hidden.pixels[:, Outcome.SERVO], bare.pixels[:, Outcome.SEEN])


def test_a_mast_on_the_yoke_stands_in_the_direct_view(rig: Rig) -> None:
    """A moving part far out: the direct view, the same at all poses without it, follows the pan."""
    mast = box_part([0.28, -0.02, 0.0], [0.32, 0.02, 0.5], group=Group.PAN, role=Role.MOUNT)
    fov = usable_fov(rig, [mast], q1=np.radians([0.0, 5.0, 40.0]), q2=[0.0, 0.0, 0.0])
    hidden = fov.solid_angle_by_region_sr[:, Region.DIRECT, Outcome.MOUNT]
    assert fov.solid_angle_by_region_sr[:, [Region.FOLD, Region.GAZE], Outcome.MOUNT].shape == (3, 2)
    assert hidden[0] != hidden[2]
    assert hidden.max() > 0
    total = fov.solid_angle_by_region_sr[:, Region.DIRECT].sum(axis=-1)
    np.testing.assert_allclose(total, total[0])


def test_parts_are_told_apart(rig: Rig) -> None:
    wall = {"low": [5.0, -50.0, -50.0], "high": [6.0, 50.0, 50.0], "group": Group.FIXED}
    for name, role, outcome in [
        ("fold_bracket", Role.MOUNT, Outcome.FOLD_BRACKET),
        ("yoke", Role.MOUNT, Outcome.MOUNT),
        ("pan_servo", Role.SERVO, Outcome.SERVO),
        ("hull", Role.HULL, Outcome.HULL),
        ("fold_mirror", Role.MIRROR, Outcome.MIRROR_PLATE),
    ]:
        part = box_part(wall["low"], wall["high"], group=Group.FIXED, role=role, name=name)
        pixels = usable_fov(rig, [part], q1=[0.0], q2=[0.0]).pixels[0]
        assert pixels[outcome] > 0
        assert pixels[outcome] == pixels[list(BLOCKERS)].sum()


def test_the_housing_is_told_apart() -> None:
    """The port's rim takes what passes a small window; total reflection has a column of its own."""
    rig = Rig.load("aqua2")
    small = rig.model_copy(update={"port": rig.port.model_copy(update={"aperture_diameter_mm": 12.0})})
    pixels = usable_fov(small, [], q1=[0.0], q2=[0.0]).pixels[0]
    train = OpticalTrain.from_rig(small)
    status = train.trace(pixel_grid(train.camera, 64, 48)).status
    assert pixels[Outcome.PORT_RIM] == (status == Status.MISSED_PORT).sum() > 0
    assert pixels[Outcome.TOTAL_REFLECTION] == pixels[Outcome.OUTSIDE_CAMERA_MODEL] == 0
    assert outcomes_of_status(np.array([Status.TOTAL_REFLECTION, Status.OUTSIDE_CAMERA_MODEL])).tolist() == [
        Outcome.TOTAL_REFLECTION,
        Outcome.OUTSIDE_CAMERA_MODEL,
    ]


def mirror_plate(rig: Rig, group: Group) -> PartMesh:
    """Plate of M1 (fixed) or M2 (tilt) with its face exactly where the mirror is."""
    plate = rig.gaze.fold_mirror if group is Group.FIXED else rig.gaze.gaze_mirror
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


def test_gaze_straight_up_hits_the_fold_mirror(rig: Rig) -> None:
    """The axis comes back the way it went: in the middle of its view the camera sees itself."""
    up = {"q1": [0.0], "q2": [np.pi / 4]}
    # So thin that only its face can be hit: the sides of a real plate face the water, too.
    thin = rig.with_gaze(fold_mirror={"thickness_mm": 1e-3})
    fov, bare = (usable_fov(rig, parts, **up) for parts in ([mirror_plate(thin, Group.FIXED)], []))
    train = OpticalTrain.from_rig(rig, q2=np.pi / 4)
    rays = train.trace(pixel_grid(train.camera, 64, 48))
    m1_from_camera = Layout.from_rig(rig).camera_from_m1.inv()
    start, direction = m1_from_camera.apply(rays.origin_m), m1_from_camera.rotation.apply(rays.direction)
    crossing = start - direction * (start[:, 2] / direction[:, 2])[:, np.newaxis]
    half = np.array([rig.gaze.fold_mirror.width_mm, rig.gaze.fold_mirror.height_mm]) / 2000
    on_m1 = (np.abs(crossing[:, :2]) <= half).all(axis=1) & (rays.status == Status.OK)
    assert 0 < on_m1.sum() == fov.pixels[0, Outcome.MIRROR_PLATE]
    assert fov.pixels[0, Outcome.SEEN] == bare.pixels[0, Outcome.SEEN] - on_m1.sum()


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
