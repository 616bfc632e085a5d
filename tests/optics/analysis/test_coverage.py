"""Coverage of the sphere: occluders whose shadow is known, symmetry, and convergence with pixels and poses."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from plain_boxes import bowl_part, box_part

from optics.analysis import Coverage, Fate, coverage, poses
from optics.analysis.sphere import cell_centres, cell_solid_angle_sr
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

FLOAT32_SHARE = 1e-4
"""Share of directions so near to a border between two cells of the sphere that float32 puts them into the other one:
borders every 1e-2 and directions good to 3e-7 make it 6e-5."""


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
    q1, q2 = np.radians([-40.0, 0.0, 33.0]), np.radians([-20.0, 70.0])
    found = coverage(rig, [], q1=q1, q2=q2, sphere=(36, 18))
    expected = np.zeros((18, 36))
    layout = Layout.from_rig(rig)
    for j, b in enumerate(q2):
        for i, a in enumerate(q1):
            train = OpticalTrain.from_rig(rig, q1=a, q2=b)
            rays = train.trace(pixel_grid(train.camera, 64, 48))
            x, y, z = layout.body_from_camera.rotation.apply(rays.direction[rays.status == 0]).T
            assert found.pixels[j, i, Fate.SEEN] == len(x)
            limits = [[-1, 1], [-np.pi, np.pi]]
            expected += np.histogram2d(z, np.arctan2(y, x), bins=(18, 36), range=limits)[0]
    assert found.sphere.sum() == expected.sum() == found.pixels[..., Fate.SEEN].sum()
    assert np.abs(found.sphere - expected).sum() <= 2 * np.ceil(FLOAT32_SHARE * expected.sum())


def test_cells_of_the_sphere_have_equal_areas() -> None:
    azimuth, elevation = cell_centres(36, 18)
    assert azimuth[18] == pytest.approx(np.radians(5))
    assert np.sin(elevation[[0, 17]]) == pytest.approx([-17 / 18, 17 / 18])
    assert cell_solid_angle_sr(36, 18) * 36 * 18 == pytest.approx(4 * np.pi)


def test_a_sea_floor_up_to_the_horizon_takes_the_lower_half(rig: Rig) -> None:
    # A bowl 2 km wide with its brim at the height of the gimbal: from 5 cm around it the horizon is off by 5e-5 rad.
    height = float(Layout.from_rig(rig).body_from_gimbal.translation[2])
    bare, below = shadow(rig, bowl_part(1000.0, height, axis=2, group=Group.FIXED, role=Role.HULL))
    assert bare.lower_fraction > 0.5
    assert below.lower_fraction == 0
    # Rays within 5e-5 rad of the horizon may be lost on its upper side, too few to empty a cell.
    np.testing.assert_array_equal(below.covered[90:], bare.covered[90:])
    lost = below.pixels[..., Fate.HULL]
    np.testing.assert_array_equal(lost + below.pixels[..., Fate.SEEN], bare.pixels[..., Fate.SEEN])
    assert lost.sum() == pytest.approx(bare.sphere[:90].sum(), rel=FLOAT32_SHARE)


def test_a_post_takes_the_angle_it_subtends(rig: Rig) -> None:
    # 2 m wide, 20 m away: 2 atan(1 / 20) = 5.72 degrees; the viewpoint moves 5 cm sideways, 0.14 degrees.
    x, y, _ = Layout.from_rig(rig).body_from_gimbal.translation
    post = box_part([x + 20, y - 1, -2000], [x + 20.01, y + 1, 2000], group=Group.FIXED, role=Role.MOUNT)
    bare, behind = shadow(rig, post, 61, sphere=(720, 60))
    horizon = slice(25, 35)
    lost = bare.covered[horizon] & ~behind.covered[horizon]
    azimuth = np.degrees(cell_centres(720, 60)[0])
    assert bare.covered[horizon][:, np.abs(azimuth) < 10].all()
    # Columns are 0.5 degrees wide: one at either edge is seen in part.
    width = 0.5 * lost.sum(axis=1)
    assert (np.abs(width - 2 * np.degrees(np.arctan(1 / 20))) <= 1.0 + 0.28).all()
    assert not lost[:, np.abs(azimuth) > 2.86 + 0.14 + 0.25].any()


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
    found = coverage(rig, [], **joint_grid(rig, 21), sphere=(90, 46))
    np.testing.assert_array_equal(found.pixels, found.pixels[:, ::-1])
    np.testing.assert_allclose(found.solid_angle_sr, found.solid_angle_sr[:, ::-1], rtol=1e-12)
    difference = np.abs(found.sphere - found.sphere[:, ::-1]).sum()
    assert difference <= 2 * FLOAT32_SHARE * found.sphere.sum()


def test_fractions_are_those_of_the_hemispheres(rig: Rig) -> None:
    found = coverage(rig, [], **joint_grid(rig, 11), sphere=(36, 18))
    assert found.covered_fraction == pytest.approx((found.upper_fraction + found.lower_fraction) / 2)
    assert found.blind_fraction == pytest.approx(1 - found.covered_fraction)
    assert (found.pixels.sum(axis=-1) == 64 * 48).all()
    assert found.pixels.shape[:2] == found.solid_angle_sr.shape == (11, 11)


def test_covered_fraction_converges_with_rays_and_poses(rig: Rig) -> None:
    """False holes close as rays multiply.

    Rationale: a cell counts when the centre of a cell of the image looks into it, so that too few rays leave holes.
    Expected: doubling the cells of the image, or halving the steps of the poses, adds to the covered fraction, and
    adds less each time; at the finest step under 0.005.
    """
    by_rays = [
        coverage(rig, [], **joint_grid(rig, 41), columns=8 * k, rows=6 * k, sphere=(180, 90)).covered_fraction
        for k in (1, 2, 4, 8, 16)
    ]
    by_poses = [
        coverage(rig, [], **joint_grid(rig, count), columns=32, rows=24, sphere=(180, 90)).covered_fraction
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
    whole = coverage(rig, [part], **grid, sphere=(36, 18))
    monkeypatch.setattr(poses, "LANES_PER_LAUNCH", 20_000)
    steps: list[tuple[int, int]] = []
    pieces = coverage(rig, [part], **grid, sphere=(36, 18), progress=lambda done, total: steps.append((done, total)))
    assert len(steps) > 2
    assert steps[-1] == (49, 49)
    np.testing.assert_array_equal(pieces.pixels, whole.pixels)
    np.testing.assert_array_equal(pieces.sphere, whole.sphere)
    np.testing.assert_allclose(pieces.solid_angle_sr, whole.solid_angle_sr, rtol=1e-12)


def test_wrong_grids_are_refused(rig: Rig) -> None:
    for q1, q2, message in [
        ([], [0.0], r"q1 of shape \(n,\), n > 0"),
        ([0.0], [np.nan], "q2 of shape .* finite"),
        ([0.0], [0.0, 3.0], r"q2 \(tilt\) between -32\.5 and 122\.5 deg, got 171\.887"),
    ]:
        with pytest.raises(ValueError, match=message):
            coverage(rig, [], q1=q1, q2=q2)
    with pytest.raises(ValueError, match="even number of rows of the sphere, got 45"):
        coverage(rig, [], q1=[0.0], q2=[0.0], sphere=(90, 45))
    with pytest.raises(ValueError, match="sphere_columns > 0, got 0"):
        coverage(rig, [], q1=[0.0], q2=[0.0], sphere=(0, 90))
