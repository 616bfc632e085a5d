"""Coverage of the sphere: occluders whose shadow is known, symmetry, and convergence with pixels and poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from plain_boxes import bowl_part, box_part

from optics.coverage import poses, sphere_views
from optics.coverage.coverage import Coverage, compute_coverage, stepped_joints
from optics.coverage.field import pixels_per_degree
from optics.coverage.gaze_cone import gaze_cone
from optics.coverage.outcome import Outcome
from optics.coverage.sphere import cell_count, cell_directions, cell_solid_angle_sr, cells_of
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig.load("aqua2")


def joint_grid(rig: Rig, count: int) -> dict[str, NDArray[np.float64]]:
    return {"q1": rig.gaze.joints.pan.values(count), "q2": rig.gaze.joints.tilt.values(count)}


def shadow(rig: Rig, part: PartMesh, count: int = 31, **options: object) -> tuple[Coverage, Coverage]:
    """Coverage without and with a part."""
    grid = joint_grid(rig, count)
    return tuple(compute_coverage(rig, parts, **grid, **options) for parts in ([], [part]))  # type: ignore[arg-type,return-value]


def test_a_cell_is_seen_where_its_centre_projects_to_a_pixel(rig: Rig) -> None:
    """One pose at a time by `OpticalTrain.project`: a far point in the direction of every cell's centre.

    It solves for the ray with Newton at the port's window where the sphere's kernel has Snell's closed form, and works
    in the camera's frame. A thousand kilometres away, the camera's place turns a direction by less than 1e-6 rad.
    """
    q1, q2 = np.radians([-40.0, -39.0, 0.0, 33.0]), np.radians([-20.0, -19.0, 70.0])
    found = compute_coverage(rig, [], q1=q1, q2=q2, nside=32)
    layout = Layout.from_rig(rig)
    centres = layout.body_from_camera.inv().rotation.apply(cell_directions(32))
    seeing, best = (np.zeros(cell_count(32)) for _ in range(2))
    for a, b in ((a, b) for a in q1 for b in q2):
        train = OpticalTrain.from_rig(rig, q1=a, q2=b)
        image = train.project(1e6 * centres)
        seen = image.status == Status.OK
        seeing += seen
        column, row = ((image.pixels[seen] + 0.5) / [rig.camera.width_px / 64, rig.camera.height_px / 48]).T
        resolution = pixels_per_degree(train.camera, train.port, 64, 48).reshape(48, 64)
        best[seen] = np.maximum(best[seen], resolution[row.astype(int), column.astype(int)])
    np.testing.assert_array_equal(found.poses_seeing, seeing)
    # Kept in float32.
    np.testing.assert_allclose(found.pixels_per_degree, best, rtol=1e-7)
    assert found.poses_by_outcome.sum() == found.poses_seeing.sum()
    assert seeing.max() > 3


OTHERS = {
    "decentred dome": ("bluerov2", {"port": {"centre_mm": (2.0, -3.0, -8.0)}}),
    "tilted window with a narrow rim": ("aqua2", {"port": {"aperture_diameter_mm": 8.0, "normal": (0.1, -0.1, 1.0)}}),
    "distorting lens": ("aqua2", {"camera": {"distortion": (-0.2, 0.05, 1e-3, -1e-3, 0.0)}}),
    "fisheye": ("aqua2", {"camera": {"model": "fisheye", "distortion": (-0.02, 0.005, 0.0, 0.0)}}),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_ports_and_lenses_see_what_they_project(name: str) -> None:
    """As above for one pose, where port, rim and lens are not the simplest."""
    preset, changes = OTHERS[name]
    numbers = Rig.load(preset).model_dump()
    rig = Rig.model_validate(numbers | {section: numbers[section] | change for section, change in changes.items()})
    found = compute_coverage(rig, [], q1=[0.3], q2=[0.1], nside=128)
    centres = Layout.from_rig(rig).body_from_camera.inv().rotation.apply(cell_directions(128))
    image = OpticalTrain.from_rig(rig, q1=0.3, q2=0.1).project(1e6 * centres)
    np.testing.assert_array_equal(found.covered, image.status == Status.OK)
    assert found.covered.sum() > 50


def narrow(rig: Rig) -> Rig:
    """Without a port, and with a view so narrow that it passes both mirrors whole."""
    camera = rig.camera.model_copy(update={"fx_px": 3000.0, "fy_px": 3000.0})
    return Rig.model_validate({**rig.model_dump(), "camera": camera.model_dump(), "port": {"shape": "none"}})


@pytest.mark.parametrize("nside", [16, 64])
def test_the_area_seen_has_no_bias(rig: Rig, nside: int) -> None:
    """Cells seen by a pose, against the solid angle of the pyramid through the image's corners.

    Rationale: a cell at the rim counts when its centre is seen, so that the sum of cells is an unbiased measure. A rule
    that counts every cell into which some ray looks is too large by half a cell all along the rim.
    Expected: over 400 poses the mean is right within four standard errors; a cell at the rim has a variance of at most
    1/4, and a rim of length l passes l / h cells. That rule's excess would be larger than what is allowed.
    """
    rig = narrow(rig)
    q = np.random.default_rng(5).uniform(size=(2, 20))
    q1, q2 = np.radians(-70 + 140 * q[0]), np.radians(-10 + 45 * q[1])
    found = compute_coverage(rig, [], q1=q1, q2=q2, nside=nside, columns=4, rows=4)
    half_u, half_v = 320 / 3000, 240 / 3000
    exact = 4 * np.arctan(half_u * half_v / np.sqrt(1 + half_u**2 + half_v**2))
    # Every cell of the image is seen, so that its solid angle is the same pyramid's.
    np.testing.assert_allclose(found.solid_angle_sr, exact, rtol=1e-12)
    width = np.sqrt(cell_solid_angle_sr(nside))
    error = found.poses_seeing.sum() * width**2 / 400 - exact
    rim = 4 * (half_u + half_v)
    allowed = 4 * np.sqrt(rim / width / 400) * width**2 / 2
    print(f"{error=:.2e} {allowed=:.2e} {exact=:.4f} excess of counting all touched: {rim * width / 2:.2e}")
    assert abs(error) < allowed < rim * width / 2


def test_the_gaze_s_cone_holds_all_that_is_seen(rig: Rig) -> None:
    """What no ray of the cone can reach is never looked at: rays of a fine grid that reach M2 must lie in it."""
    layout = Layout.from_rig(rig)
    for q1, q2 in np.radians([[0.0, 0.0], [-77.0, -32.0], [60.0, 122.0], [20.0, 45.0]]):
        train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
        cone = gaze_cone(train, layout)
        assert cone is not None
        pixels = pixel_grid(train.camera, 320, 240)
        seen = train.trace(pixels).status == Status.OK
        behind_port = replace(train, mirrors=()).trace(pixels[seen]).direction
        assert (np.arccos(behind_port @ cone.axis) < cone.half_angle).all()


def test_mirrors_that_the_image_misses_show_nothing(rig: Rig) -> None:
    # A lens turned so far aside in its image that no pixel reaches M2.
    camera = rig.camera.model_copy(update={"cx_px": 9000.0})
    found = compute_coverage(rig.model_copy(update={"camera": camera}), [], q1=[0.0], q2=[0.0], nside=8)
    assert found.covered_fraction == 0
    assert (found.pixels_per_degree == 0).all()


def test_an_opaque_world_is_counted_where_it_hides(rig: Rig) -> None:
    # All that a bare rig sees is hidden by a box all around: the same rays to the same cells, by another outcome.
    around = box_part([-50, -50, -50], [50, 50, 50], group=Group.FIXED, role=Role.HULL)
    bare, hidden = shadow(rig, around, 5, nside=8)
    np.testing.assert_array_equal(hidden.poses_by_outcome[Outcome.HULL], bare.poses_by_outcome[Outcome.SEEN])
    assert hidden.covered_fraction == 0
    assert hidden.poses_seeing.sum() == 0


def test_a_sea_floor_up_to_the_horizon_takes_the_lower_half(rig: Rig) -> None:
    # A bowl 2 km wide with its brim at the height of the gimbal: from 5 cm around it the horizon is off by 5e-5 rad.
    height = float(Layout.from_rig(rig).body_from_gimbal.translation[2])
    bare, below = shadow(rig, bowl_part(1000.0, height, axis=2, group=Group.FIXED, role=Role.HULL))
    assert bare.lower_fraction > 0.5
    z = cell_directions(64)[:, 2]
    assert not below.covered[z < 0].any()
    # The next ring's centres are half a degree above the horizon, which is off by 5e-5 rad.
    np.testing.assert_array_equal(below.covered[z > 0], bare.covered[z > 0])
    lost = below.pixels[..., Outcome.HULL]
    np.testing.assert_array_equal(lost + below.pixels[..., Outcome.SEEN], bare.pixels[..., Outcome.SEEN])
    hidden, seen = below.poses_by_outcome[Outcome.HULL], bare.poses_by_outcome[Outcome.SEEN]
    np.testing.assert_array_equal(hidden[z < 0], seen[z < 0])
    assert below.poses_by_outcome[Outcome.HULL, z > 0].sum() == 0


def test_a_post_takes_the_angle_it_subtends(rig: Rig) -> None:
    # 2 m wide, 20 m away: 2 atan(1 / 20) = 5.72 degrees; the viewpoint moves 5 cm sideways, 0.14 degrees.
    x, y, _ = Layout.from_rig(rig).body_from_gimbal.translation
    post = box_part([x + 20, y - 1, -2000], [x + 20.01, y + 1, 2000], group=Group.FIXED, role=Role.MOUNT)
    bare, behind = shadow(rig, post, 91, nside=128)
    directions = cell_directions(128)
    azimuth = np.degrees(np.arctan2(directions[:, 1], directions[:, 0]))
    horizon = np.abs(directions[:, 2]) < 0.1
    lost = horizon & bare.covered & ~behind.covered
    assert bare.covered[horizon & (np.abs(azimuth) < 10)].all()
    half = np.degrees(np.arctan(1 / 20))
    assert lost[horizon & (np.abs(azimuth) < half - 0.14)].all()
    assert not lost[np.abs(azimuth) > half + 0.14].any()


def test_what_turns_with_the_pan_takes_the_same_at_every_pan(rig: Rig) -> None:
    # All that lies behind the yoke; seen over the zenith at 80 degrees of tilt, not seen at a horizontal gaze.
    wall = bowl_part(1000.0, -0.5, axis=0, group=Group.PAN, role=Role.MOUNT)
    q1 = np.radians([-77.5, -30.0, 0.0, 10.0, 77.5])
    bare = compute_coverage(rig, [], q1=q1, q2=np.radians([0.0, 80.0]))
    turned = compute_coverage(rig, [wall], q1=q1, q2=np.radians([0.0, 80.0]))
    np.testing.assert_array_equal(turned.pixels[0], bare.pixels[0])
    np.testing.assert_array_equal(turned.pixels[1, :, Outcome.MOUNT], bare.pixels[1, :, Outcome.SEEN])
    assert turned.pixels[1, :, Outcome.SEEN].sum() == 0


def test_bare_mirrors_cover_left_and_right_alike(rig: Rig) -> None:
    # Camera, mirrors and limits of this rig are symmetric to the plane y = y of the camera.
    found = compute_coverage(rig, [], **joint_grid(rig, 21), nside=16)
    np.testing.assert_array_equal(found.pixels, found.pixels[:, ::-1])
    np.testing.assert_allclose(found.solid_angle_sr, found.solid_angle_sr[:, ::-1], rtol=1e-12)
    other_side = cells_of(cell_directions(16) * [1, -1, 1], 16)
    # Centres come in pairs, or lie in the plane of symmetry.
    np.testing.assert_array_equal(found.covered, found.covered[other_side])
    np.testing.assert_array_equal(found.poses_by_outcome, found.poses_by_outcome[:, other_side])


def test_fractions_are_those_of_the_hemispheres(rig: Rig) -> None:
    found = compute_coverage(rig, [], **joint_grid(rig, 11), nside=8)
    assert found.covered_fraction == pytest.approx((found.upper_fraction + found.lower_fraction) / 2)
    assert found.blind_fraction == pytest.approx(1 - found.covered_fraction)
    assert (found.pixels.sum(axis=-1) == 64 * 48).all()
    assert found.pixels.shape[:2] == found.solid_angle_sr.shape == (11, 11)
    whole = found.solid_angle_by_outcome_sr.sum(axis=-1)
    np.testing.assert_allclose(found.solid_angle_by_region_sr.sum(axis=(-2, -1)), whole, rtol=1e-12)
    np.testing.assert_allclose(whole, whole[0, 0], rtol=1e-12)


def test_mean_solid_angle_is_that_of_the_ranges(rig: Rig) -> None:
    # Steps that differ must not weigh alike: a value in the middle of nothing changes no integral much.
    grid = joint_grid(rig, 9)
    found = compute_coverage(rig, [], **grid)
    expected = np.trapezoid(np.trapezoid(found.solid_angle_sr, grid["q1"], axis=1), grid["q2"])
    expected /= np.ptp(grid["q1"]) * np.ptp(grid["q2"])
    assert found.mean_solid_angle_sr == pytest.approx(expected, rel=1e-12)
    single = compute_coverage(rig, [], q1=[0.0], q2=[0.0])
    assert single.mean_solid_angle_sr == pytest.approx(single.solid_angle_sr[0, 0])


@pytest.mark.parametrize(("step_deg", "count"), [(1.0, 156), (0.999, 157), (155.0, 2), (200.0, 2), (2.0, 79)])
def test_steps_are_at_most_as_large_as_asked(rig: Rig, step_deg: float, count: int) -> None:
    q1, q2 = stepped_joints(rig, step_deg)
    assert len(q1) == len(q2) == count
    assert np.degrees([q1[0], q1[-1], q2[0], q2[-1]]) == pytest.approx([-77.5, 77.5, -32.5, 122.5])
    assert np.degrees(np.diff(q2)).max() <= step_deg + 1e-9


@pytest.mark.parametrize("step_deg", [0.0, -1.0, np.nan, np.inf])
def test_steps_that_lead_nowhere_are_refused(rig: Rig, step_deg: float) -> None:
    with pytest.raises(ValueError, match="expected a step of the joints > 0 degrees"):
        stepped_joints(rig, step_deg)


def test_covered_fraction_converges_with_the_poses(rig: Rig) -> None:
    """Gaps between poses close as these multiply.

    Expected: halving the steps of the poses adds to the covered fraction, and adds less each time, at the finest step
    under 0.006. Cells of the image do not matter: no ray of theirs decides a cell of the sphere.
    """
    fractions = [
        compute_coverage(rig, [], **joint_grid(rig, count), columns=4, rows=4, nside=32).covered_fraction
        for count in (11, 21, 41, 81, 161)
    ]
    gains = np.diff(fractions)
    print(fractions, gains)
    assert (gains > 0).all()
    assert (np.diff(gains) < 0).all()
    assert gains[-1] < 0.006
    coarse, fine = (
        compute_coverage(rig, [], **joint_grid(rig, 11), columns=k, rows=k, nside=32).poses_by_outcome for k in (4, 48)
    )
    np.testing.assert_array_equal(coarse, fine)


def test_launches_add_up(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = joint_grid(rig, 7)
    part = box_part([-0.2, -0.2, -0.2], [-0.1, 0.2, 0.2], group=Group.PAN, role=Role.MOUNT)
    whole = compute_coverage(rig, [part], **grid, nside=8)
    monkeypatch.setattr(poses, "LANES_PER_LAUNCH", 20_000)
    monkeypatch.setattr(sphere_views, "LANES_PER_LAUNCH", 1_000)
    steps: list[tuple[int, int]] = []
    pieces = compute_coverage(rig, [part], **grid, nside=8, progress=lambda done, total: steps.append((done, total)))
    assert len(steps) > 2
    assert steps[-1] == (49, 49)
    np.testing.assert_array_equal(pieces.pixels, whole.pixels)
    for name in ("solid_angle_by_region_sr", "poses_by_outcome", "pixels_per_degree"):
        # To the bit: the counters are integers, so that no order of adding them up differs.
        np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name))


def test_wrong_grids_are_refused(rig: Rig) -> None:
    for q1, q2, message in [
        ([], [0.0], r"q1 of shape \(n,\), n > 0"),
        ([0.0], [np.nan], "q2 of shape .* finite"),
        ([0.0], [0.0, 3.0], r"q2 \(tilt\) between -32\.5 and 122\.5 deg, got 171\.887"),
    ]:
        with pytest.raises(ValueError, match=message):
            compute_coverage(rig, [], q1=q1, q2=q2)
    for nside in (0, 12, 2048):
        with pytest.raises(ValueError, match=f"nside to be a power of two from 1 to 1024, got {nside}"):
            compute_coverage(rig, [], q1=[0.0], q2=[0.0], nside=nside)
    with pytest.raises(ValueError, match="columns > 0, got 0"):
        compute_coverage(rig, [], q1=[0.0], q2=[0.0], columns=0)
