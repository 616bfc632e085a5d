"""The trade-off: each design is the one that sizing gives; figure 1 of the paper comes out; sums by hand."""

from __future__ import annotations

import numpy as np
import pytest
from plain_boxes import box_part
from scipy.spatial.transform import RigidTransform

from optics.camera import camera_from_spec
from optics.layout import Layout
from optics.mesh import Group, Role
from optics.sizing.gaze_range import GazeRange
from optics.sizing.limits import Request
from optics.sizing.sizing import size_mirrors
from optics.sizing.trade_off import plate_part, swept_cylinder_m3, swept_sphere_m3, trade_off
from optics.sizing.window import fraction_window
from rigs import Rig

AQUA2 = Rig.load("aqua2")
REQUEST = Request(
    window=fraction_window(camera_from_spec(AQUA2.camera), 0.15),
    gaze=GazeRange(first=tuple(np.radians([-45, 45])), second=tuple(np.radians([-10, 30])), in_joints=False),
)
HULL = [box_part([-0.325, -0.225, -0.065], [0.325, 0.225, 0.065], group=Group.FIXED, role=Role.HULL)]
D1_MM, D2_MM = [80.0, 95.0, 150.0], [100.0, 125.0]


@pytest.fixture(scope="module")
def result():
    return trade_off(AQUA2, REQUEST, HULL, d1_mm=D1_MM, d2_mm=D2_MM)


def test_each_design_has_the_sizes_that_sizing_gives(result):
    """The trade-off's grid is coarser by 0.1 %; half a millimetre of rounding may tip over."""
    for j, i in ((0, 0), (1, 1), (1, 2)):
        rig = AQUA2.with_gaze(
            fold_mirror={"distance_mm": D1_MM[i]},
            gaze_mirror={"distance_mm": D2_MM[j]},
        )
        sized = size_mirrors(rig, REQUEST).rig
        for found, plate in ((result.m1_mm, sized.gaze.fold_mirror), (result.m2_mm, sized.gaze.gaze_mirror)):
            np.testing.assert_allclose(found[j, i], [plate.width_mm, plate.height_mm], atol=0.5)


def test_near_mirrors_see_the_robot_and_far_ones_are_large(result):
    """Figure 1 of Cortes-Perez & Torres-Mendez 2021."""
    assert (np.diff(result.hull_share, axis=1) < 0).all()
    assert (result.hull_share > 0.03).all()
    assert (np.diff(result.m1_cm2, axis=1) > 0).all()
    assert (np.diff(result.m2_cm2, axis=1) > 0).all() and (np.diff(result.m2_cm2, axis=0) > 0).all()
    np.testing.assert_array_equal(result.m1_mm[0], result.m1_mm[1])


def test_mass_and_moment_are_those_of_two_glass_plates(result):
    """2.5 kg to the litre; the camera 60 mm left of the middle, M1 d1 ahead of it, M2 d2 below M1."""
    for j, d2 in enumerate(D2_MM):
        for i, d1 in enumerate(D1_MM):
            masses = [2.5e-6 * 3 * np.prod(size[j, i]) for size in (result.m1_mm, result.m2_mm)]
            x = (302 + d1) / 1000
            moment = [x * sum(masses), 0.06 * sum(masses), -d2 / 1000 * masses[1]]
            assert result.mass_kg[j, i] == pytest.approx(sum(masses))
            np.testing.assert_allclose(result.moment_kg_m[j, i], moment, atol=1e-12)


def test_swept_volumes_of_aqua2():
    """Half diagonal of 80 x 100 x (twice 3) mm; a cylinder of radius 40 + 4 + the servo's height, 100 + 3 + 4 high."""
    radius = np.sqrt(40**2 + 50**2 + 3**2)
    assert swept_sphere_m3(AQUA2.gaze.gaze_mirror) == pytest.approx(4 / 3 * np.pi * radius**3 * 1e-9)
    cylinder = np.pi * (44 + AQUA2.gaze.servos.tilt.size_mm[2]) ** 2 * 107
    assert swept_cylinder_m3(AQUA2) == pytest.approx(cylinder * 1e-9)


def test_a_plate_is_a_closed_box_behind_its_face():
    pose = Layout.from_rig(AQUA2).body_from_m1
    part = plate_part("fold_mirror", AQUA2.gaze.fold_mirror, RigidTransform.identity(), Group.FIXED)
    np.testing.assert_allclose(part.vertices_m.min(axis=0), [-0.04, -0.045, -0.003])
    np.testing.assert_allclose(part.vertices_m.max(axis=0), [0.04, 0.045, 0.0])
    corners = part.vertices_m[part.faces]
    # Divergence theorem: positive when all faces are counter-clockwise seen from outside.
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(0.08 * 0.09 * 0.003)
    placed = plate_part("fold_mirror", AQUA2.gaze.fold_mirror, pose, Group.FIXED)
    np.testing.assert_allclose(placed.vertices_m, pose.apply(part.vertices_m))


def test_what_does_not_fit_is_named(result):
    near = trade_off(AQUA2, REQUEST, [], d1_mm=[95.0], d2_mm=[15.0])
    assert near.constraint == (("clearance",),)
    assert not near.fits.any() and result.fits[1, 1]
    steep = GazeRange(first=(0.0, 0.0), second=tuple(np.radians([-65, 0])), in_joints=False)
    wide = Request(window=fraction_window(camera_from_spec(AQUA2.camera), 0.9), gaze=steep)
    grazing = trade_off(AQUA2, wide, [], d1_mm=[95.0], d2_mm=[125.0])
    assert grazing.constraint == (("grazing incidence",),)
    assert np.isnan(grazing.m2_mm).all() and np.isnan(grazing.hull_share).all()


def test_bad_distances_and_ranges_are_refused():
    with pytest.raises(ValueError, match=r"expected d1_mm of shape \(n,\), n > 0, positive, got \[-1.\]"):
        trade_off(AQUA2, REQUEST, [], d1_mm=[-1.0], d2_mm=[100.0])
    nowhere = Request(window=REQUEST.window, gaze=GazeRange(first=(2.0, 2.1), second=(0.0, 0.0), in_joints=True))
    with pytest.raises(ValueError, match="expected a range that the joints reach"):
        trade_off(AQUA2, nowhere, [], d1_mm=[95.0], d2_mm=[125.0])
