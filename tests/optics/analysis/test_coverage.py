"""Coverage of the sphere: occluders whose shadow is known, symmetry, and convergence with pixels and poses."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from plain_boxes import bowl_part, box_part

from optics.analysis import Coverage, Fate, coverage, poses
from optics.analysis.coverage import joint_grid as stepped_grid
from optics.analysis.field import pixels_per_degree
from optics.analysis.sphere import cell_count, cell_directions, cells_of
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

HORIZON_SHARE = 1e-4
"""Share of directions within 5e-5 rad of the horizon of a view some 20 degrees high, rounded up to twice."""


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig.load("aqua2")


def joint_grid(rig: Rig, count: int) -> dict[str, NDArray[np.float64]]:
    assert rig.joints is not None
    joints = {"q1": rig.joints.pan, "q2": rig.joints.tilt}
    return {name: np.radians(np.linspace(joint.min_deg, joint.max_deg, count)) for name, joint in joints.items()}


def shadow(rig: Rig, part: PartMesh, count: int = 31, **options: object) -> tuple[Coverage, Coverage]:
    """Coverage without and with a part."""
    grid = joint_grid(rig, count)
    return tuple(coverage(rig, parts, **grid, **options) for parts in ([], [part]))  # type: ignore[arg-type,return-value]


def test_sphere_counts_the_directions_of_each_trace(rig: Rig) -> None:
    """One pose at a time, in plain NumPy: rays, distinct poses and best resolution of every cell of the sphere."""
    q1, q2 = np.radians([-40.0, -39.0, 0.0, 33.0]), np.radians([-20.0, -19.0, 70.0])
    found = coverage(rig, [], q1=q1, q2=q2, nside=8)
    rays, poses_seeing, best = (np.zeros(cell_count(8)) for _ in range(3))
    layout = Layout.from_rig(rig)
    for j, b in enumerate(q2):
        for i, a in enumerate(q1):
            train = OpticalTrain.from_rig(rig, q1=a, q2=b)
            traced = train.trace(pixel_grid(train.camera, 64, 48))
            seen = traced.status == 0
            assert found.pixels[j, i, Fate.SEEN] == seen.sum()
            cells = cells_of(layout.body_from_camera.rotation.apply(traced.direction[seen]), 8)
            np.add.at(rays, cells, 1)
            poses_seeing[np.unique(cells)] += 1
            np.maximum.at(best, cells, pixels_per_degree(train.camera, train.port, 64, 48)[seen])
    np.testing.assert_array_equal(found.rays[Fate.SEEN], rays)
    np.testing.assert_array_equal(found.poses_seeing, poses_seeing)
    # Kept in float32.
    np.testing.assert_allclose(found.pixels_per_degree, best, rtol=1e-7)
    assert found.rays.sum() == found.rays[Fate.SEEN].sum()
    assert poses_seeing.max() > 3 and rays.max() > 10 * poses_seeing.max()


def test_an_opaque_world_is_counted_where_it_hides(rig: Rig) -> None:
    # All that a bare rig sees is hidden by a box all around: the same rays to the same cells, by another fate.
    around = box_part([-50, -50, -50], [50, 50, 50], group=Group.FIXED, role=Role.HULL)
    bare, hidden = shadow(rig, around, 5, nside=8)
    np.testing.assert_array_equal(hidden.rays[Fate.HULL], bare.rays[Fate.SEEN])
    assert hidden.covered_fraction == 0
    assert hidden.poses_seeing.sum() == 0


def test_a_sea_floor_up_to_the_horizon_takes_the_lower_half(rig: Rig) -> None:
    # A bowl 2 km wide with its brim at the height of the gimbal: from 5 cm around it the horizon is off by 5e-5 rad.
    height = float(Layout.from_rig(rig).body_from_gimbal.translation[2])
    bare, below = shadow(rig, bowl_part(1000.0, height, axis=2, group=Group.FIXED, role=Role.HULL))
    assert bare.lower_fraction > 0.5
    # No cell with its centre below the horizon reaches above it: belt rings meet there.
    z = cell_directions(64)[:, 2]
    assert not below.covered[z < 0].any()
    # Rays within 5e-5 rad of the horizon may be lost on its upper side, too few to empty a cell.
    np.testing.assert_array_equal(below.covered[z > 0], bare.covered[z > 0])
    lost = below.pixels[..., Fate.HULL]
    np.testing.assert_array_equal(lost + below.pixels[..., Fate.SEEN], bare.pixels[..., Fate.SEEN])
    downwards = bare.rays[Fate.SEEN, z < 0].sum() + bare.rays[Fate.SEEN, z == 0].sum() / 2
    # Rays into the ring on the horizon (1/255 of the sphere's height each way) need not be half and half.
    assert lost.sum() == pytest.approx(downwards, abs=0.1 * bare.rays[Fate.SEEN, z == 0].sum())
    np.testing.assert_array_equal(below.rays[Fate.HULL, z < 0], bare.rays[Fate.SEEN, z < 0])


def test_a_post_takes_the_angle_it_subtends(rig: Rig) -> None:
    # 2 m wide, 20 m away: 2 atan(1 / 20) = 5.72 degrees; the viewpoint moves 5 cm sideways, 0.14 degrees.
    x, y, _ = Layout.from_rig(rig).body_from_gimbal.translation
    post = box_part([x + 20, y - 1, -2000], [x + 20.01, y + 1, 2000], group=Group.FIXED, role=Role.MOUNT)
    bare, behind = shadow(rig, post, 91, nside=128, columns=128, rows=96)
    directions = cell_directions(128)
    azimuth = np.degrees(np.arctan2(directions[:, 1], directions[:, 0]))
    horizon = np.abs(directions[:, 2]) < 0.1
    lost = horizon & bare.covered & ~behind.covered
    assert bare.covered[horizon & (np.abs(azimuth) < 10)].all()
    half = np.degrees(np.arctan(1 / 20))
    # Cells of the belt reach 0.35 degrees to either side of their centre.
    assert lost[horizon & (np.abs(azimuth) < half - 0.14 - 0.36)].all()
    assert not lost[np.abs(azimuth) > half + 0.14 + 0.36].any()


def test_what_turns_with_the_pan_takes_the_same_at_every_pan(rig: Rig) -> None:
    # All that lies behind the yoke; seen over the zenith at 80 degrees of tilt, not seen at a horizontal gaze.
    wall = bowl_part(1000.0, -0.5, axis=0, group=Group.PAN, role=Role.MOUNT)
    q1 = np.radians([-77.5, -30.0, 0.0, 10.0, 77.5])
    bare = coverage(rig, [], q1=q1, q2=np.radians([0.0, 80.0]))
    turned = coverage(rig, [wall], q1=q1, q2=np.radians([0.0, 80.0]))
    np.testing.assert_array_equal(turned.pixels[0], bare.pixels[0])
    np.testing.assert_array_equal(turned.pixels[1, :, Fate.MOUNT], bare.pixels[1, :, Fate.SEEN])
    assert turned.pixels[1, :, Fate.SEEN].sum() == 0


def test_bare_mirrors_cover_left_and_right_alike(rig: Rig) -> None:
    # Camera, mirrors and limits of this rig are symmetric to the plane y = y of the camera.
    found = coverage(rig, [], **joint_grid(rig, 21), nside=16)
    np.testing.assert_array_equal(found.pixels, found.pixels[:, ::-1])
    np.testing.assert_allclose(found.solid_angle_sr, found.solid_angle_sr[:, ::-1], rtol=1e-12)
    other_side = cells_of(cell_directions(16) * [1, -1, 1], 16)
    # Cells meet in the plane of symmetry, and a ray in it goes to one side.
    np.testing.assert_array_equal(found.covered, found.covered[other_side])
    assert np.abs(found.rays - found.rays[:, other_side]).sum() <= 1e-3 * found.rays.sum()


def test_fractions_are_those_of_the_hemispheres(rig: Rig) -> None:
    found = coverage(rig, [], **joint_grid(rig, 11), nside=8)
    assert found.covered_fraction == pytest.approx((found.upper_fraction + found.lower_fraction) / 2)
    assert found.blind_fraction == pytest.approx(1 - found.covered_fraction)
    assert (found.pixels.sum(axis=-1) == 64 * 48).all()
    assert found.pixels.shape[:2] == found.solid_angle_sr.shape == (11, 11)
    whole = found.solid_angle_by_fate_sr.sum(axis=-1)
    np.testing.assert_allclose(found.solid_angle_by_region_sr.sum(axis=(-2, -1)), whole, rtol=1e-12)
    np.testing.assert_allclose(whole, whole[0, 0], rtol=1e-12)


def test_mean_solid_angle_is_that_of_the_ranges(rig: Rig) -> None:
    # Steps that differ must not weigh alike: a value in the middle of nothing changes no integral much.
    grid = joint_grid(rig, 9)
    found = coverage(rig, [], **grid)
    expected = np.trapezoid(np.trapezoid(found.solid_angle_sr, grid["q1"], axis=1), grid["q2"])
    expected /= np.ptp(grid["q1"]) * np.ptp(grid["q2"])
    assert found.mean_solid_angle_sr == pytest.approx(expected, rel=1e-12)
    single = coverage(rig, [], q1=[0.0], q2=[0.0])
    assert single.mean_solid_angle_sr == pytest.approx(single.solid_angle_sr[0, 0])


@pytest.mark.parametrize(("step_deg", "count"), [(1.0, 156), (0.999, 157), (155.0, 2), (200.0, 2), (2.0, 79)])
def test_steps_are_at_most_as_large_as_asked(rig: Rig, step_deg: float, count: int) -> None:
    q1, q2 = stepped_grid(rig, step_deg)
    assert len(q1) == len(q2) == count
    assert np.degrees([q1[0], q1[-1], q2[0], q2[-1]]) == pytest.approx([-77.5, 77.5, -32.5, 122.5])
    assert np.degrees(np.diff(q2)).max() <= step_deg + 1e-9


@pytest.mark.parametrize("step_deg", [0.0, -1.0, np.nan, np.inf])
def test_steps_that_lead_nowhere_are_refused(rig: Rig, step_deg: float) -> None:
    with pytest.raises(ValueError, match="expected a step of the joints > 0 degrees"):
        stepped_grid(rig, step_deg)


def test_covered_fraction_converges_with_rays_and_poses(rig: Rig) -> None:
    """False holes close as rays multiply.

    Rationale: a cell counts when the centre of a cell of the image looks into it, so that too few rays leave holes.
    Expected: doubling the cells of the image, or halving the steps of the poses, adds to the covered fraction, and
    adds less each time; at the finest step under 0.005.
    """
    by_rays = [
        coverage(rig, [], **joint_grid(rig, 41), columns=8 * k, rows=6 * k, nside=32).covered_fraction
        for k in (1, 2, 4, 8, 16)
    ]
    by_poses = [
        coverage(rig, [], **joint_grid(rig, count), columns=32, rows=24, nside=32).covered_fraction
        for count in (11, 21, 41, 81, 161)
    ]
    for fractions in (by_rays, by_poses):
        gains = np.diff(fractions)
        print(fractions, gains)
        assert (gains > 0).all()
        assert (np.diff(gains) < 0).all()
        assert gains[-1] < 0.005


def test_launches_add_up(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = joint_grid(rig, 7)
    part = box_part([-0.2, -0.2, -0.2], [-0.1, 0.2, 0.2], group=Group.PAN, role=Role.MOUNT)
    whole = coverage(rig, [part], **grid, nside=8)
    monkeypatch.setattr(poses, "LANES_PER_LAUNCH", 20_000)
    steps: list[tuple[int, int]] = []
    pieces = coverage(rig, [part], **grid, nside=8, progress=lambda done, total: steps.append((done, total)))
    assert len(steps) > 2
    assert steps[-1] == (49, 49)
    np.testing.assert_array_equal(pieces.pixels, whole.pixels)
    for name in ("solid_angle_by_region_sr", "rays", "poses_seeing", "pixels_per_degree"):
        # To the bit: the counters are integers, so that no order of adding them up differs.
        np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name))


def test_wrong_grids_are_refused(rig: Rig) -> None:
    for q1, q2, message in [
        ([], [0.0], r"q1 of shape \(n,\), n > 0"),
        ([0.0], [np.nan], "q2 of shape .* finite"),
        ([0.0], [0.0, 3.0], r"q2 \(tilt\) between -32\.5 and 122\.5 deg, got 171\.887"),
    ]:
        with pytest.raises(ValueError, match=message):
            coverage(rig, [], q1=q1, q2=q2)
    for nside in (0, 12, 2048):
        with pytest.raises(ValueError, match=f"nside to be a power of two from 1 to 1024, got {nside}"):
            coverage(rig, [], q1=[0.0], q2=[0.0], nside=nside)
    with pytest.raises(ValueError, match="columns > 0, got 0"):
        coverage(rig, [], q1=[0.0], q2=[0.0], columns=0)
