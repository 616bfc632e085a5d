"""Flanges on flat, curved, sloping and cylindrical hulls: they touch, they do not enter, and what fits not is named."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from cad.hulls.anchors import base_anchor, fold_anchor
from cad.parts.contact import (
    DEGREE,
    FLAT_MM,
    PlaneContact,
    SurfaceContact,
    _bernstein,
    surface_contact,
    surface_heights,
)
from cad.parts.flange import (
    FLANGE_LENGTH_MM,
    FLANGE_WIDTH_MM,
    Seat,
    base_seat,
    fastener_room,
    flange,
    fold_seat,
    hull_side,
)
from rigs import FileHull, Rig

TOUCHING_MM3 = 1e-6
PLACE = "mount.fold_anchor_mm"


def sphere(radius_mm: float) -> trimesh.Trimesh:
    """Ball that touches z = 0 from below, its facets 2.4 degrees wide at most."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=radius_mm)
    ball.apply_translation([0, 0, -radius_mm])
    return ball


def on(contact, wall_mm: float = 4.0) -> Seat:
    return Seat(body_from_seat=RigidTransform.identity(), contact=contact, attachment="screws", wall_mm=wall_mm)


def patch_heights(contact: SurfaceContact, points: np.ndarray) -> np.ndarray:
    u, v = (points[:, axis] / (2 * contact.half_size_mm[axis]) + 0.5 for axis in (0, 1))
    return np.einsum("ni,nj,ij->n", _bernstein(u), _bernstein(v), contact.poles_mm)


def test_heights_are_those_of_a_sphere():
    """Closed form z = sqrt(R^2 - r^2) - R; the facets lie below it by at most their sagitta."""
    radius, points = 150.0, np.random.default_rng(0).uniform(-25, 25, (60, 2))
    expected = np.sqrt(radius**2 - (points**2).sum(axis=1)) - radius
    sagitta = radius * (1 - np.cos(np.radians(2.4) / 2))
    found = surface_heights(sphere(radius), points)
    assert (found <= expected + 1e-9).all()
    assert (found >= expected - 2 * sagitta).all()


@pytest.mark.parametrize("radius_mm", [80.0, 150.0, 400.0])
def test_a_fitted_patch_touches_a_sphere_from_outside(radius_mm):
    """Between the samples too; a bicubic leaves the fourth order of the sphere, x^4 / 8 R^3, and the facets."""
    surface = sphere(radius_mm)
    contact = surface_contact(surface, FLANGE_LENGTH_MM, FLANGE_WIDTH_MM, PLACE)
    assert isinstance(contact, SurfaceContact)
    sagitta = radius_mm * (1 - np.cos(np.radians(2.4) / 2))
    assert contact.error_mm < 36.0**4 / (8 * radius_mm**3) + 2 * sagitta
    points = np.random.default_rng(1).uniform([-25, -23], [25, 23], (400, 2))
    gap = patch_heights(contact, points) - surface_heights(surface, points)
    assert gap.min() > -0.2 * contact.error_mm
    assert gap.max() < 1.2 * contact.error_mm


def test_a_flange_on_a_curved_hull_is_one_solid_beside_it():
    contact = surface_contact(sphere(120.0), FLANGE_LENGTH_MM, FLANGE_WIDTH_MM, PLACE)
    seat = on(contact)
    part = flange(seat)
    assert part.is_valid
    assert len(part.solids()) == 1
    for room in (hull_side(seat), fastener_room(seat)):
        common = part & room
        assert common is None or sum(solid.volume for solid in common.solids()) < TOUCHING_MM3
    # As thick as the wall over the anchor, thicker where the ball falls away under 50 x 46 mm; holes and corners.
    sag = (FLANGE_LENGTH_MM**2 + FLANGE_WIDTH_MM**2) / 24 / 120.0
    expected = FLANGE_LENGTH_MM * FLANGE_WIDTH_MM * (4.0 + sag)
    assert part.volume == pytest.approx(expected, rel=0.1)


def test_a_flat_hull_in_a_file_gets_a_flat_flange():
    slab = trimesh.creation.box((200, 200, 20))
    slab.apply_translation([0, 0, -10 + FLAT_MM / 2])
    assert surface_contact(slab, FLANGE_LENGTH_MM, FLANGE_WIDTH_MM, PLACE) == PlaneContact()


def test_a_hull_that_ends_under_the_flange_or_has_a_step_is_refused():
    half = trimesh.creation.box((200, 200, 20))
    half.apply_translation([100, 0, -10])
    with pytest.raises(
        ValueError, match=r"mount\.fold_anchor_mm: expected hull under the whole flange.*none under 48%"
    ):
        surface_contact(half, FLANGE_LENGTH_MM, FLANGE_WIDTH_MM, PLACE)
    step = trimesh.creation.box((200, 200, 14))
    step.apply_translation([-100, 0, -13])
    with pytest.raises(
        ValueError, match=r"mount\.fold_anchor_mm: expected a hull that is smooth.*steps of [345]\.\d mm"
    ):
        surface_contact(trimesh.util.concatenate([half, step]), FLANGE_LENGTH_MM, FLANGE_WIDTH_MM, PLACE)


def test_bernsteins_polynomials_are_a_partition_of_one():
    assert _bernstein(np.linspace(0, 1, 7)).shape == (7, DEGREE + 1)
    np.testing.assert_allclose(_bernstein(np.linspace(0, 1, 7)).sum(axis=1), 1, rtol=0, atol=1e-15)


def test_a_torpedo_is_strapped_and_its_saddle_lies_on_the_cylinder():
    rig = Rig.load("torpedo")
    radius = rig.gaze.hull.diameter_mm / 2
    for seat, side in ((fold_seat(rig), 1), (base_seat(rig, (1.0, 0.0, 0.0)), -1)):
        assert seat.strapped
        part = flange(seat)
        assert part.is_valid
        assert len(part.solids()) == 1
        distances = [np.hypot(vertex.Y, vertex.Z) for vertex in part.vertices()]
        assert min(distances) == pytest.approx(radius, abs=1e-6)
        assert max(distances) == pytest.approx(radius + seat.height_mm, abs=1e-6)
        assert all(side * vertex.Z > 0 for vertex in part.vertices())


def test_a_torpedo_can_be_screwed_on_and_no_clamp_fits_a_box_or_a_nose():
    torpedo, box = Rig.load("torpedo"), Rig.load("aqua2")
    screwed = torpedo.with_gaze(mount={"fold_attachment": "screws"})
    assert not fold_seat(screwed).strapped
    saddle = box.with_gaze(mount={"base_attachment": "clamps"})
    with pytest.raises(ValueError, match=r"mount\.base_attachment = 'clamps': expected a cylindrical hull.*'box'"):
        base_seat(saddle, (1.0, 0.0, 0.0))
    nose = torpedo.gaze.mount.model_copy(update={"fold_anchor_mm": (700.0, 0.0, 115.0)})
    with pytest.raises(ValueError, match=r"mount\.fold_anchor_mm = \(700.*expected x from -370 to 655"):
        fold_seat(torpedo.with_gaze(mount=nose))


def test_a_seat_stands_on_its_anchor(tmp_path):
    """Origin and z are the anchor's point and normal, for a hull from a file that is turned in the body too."""
    ball = sphere(150.0)
    ball.export(tmp_path / "ball.stl")
    rig = Rig.load("aqua2")
    turn = Rotation.from_euler("y", 20, degrees=True)
    point = turn.apply([0, 0, 150.0]) + np.array([100.0, 60.0, 0.0])
    hull = FileHull(shape="file", file=tmp_path / "ball.stl", unit="mm", position_mm=(100.0, 60.0, 150.0))
    mount = rig.gaze.mount.model_copy(update={"fold_anchor_mm": tuple(point)})
    turned = rig.with_gaze(hull=hull, mount=mount)
    seat, anchor = fold_seat(turned), fold_anchor(turned)
    np.testing.assert_allclose(1000 * seat.body_from_seat.translation, anchor.point_mm, rtol=0, atol=1e-9)
    np.testing.assert_allclose(seat.normal, anchor.normal, rtol=0, atol=1e-12)
    assert base_anchor(rig).normal == (0.0, 0.0, -1.0)
