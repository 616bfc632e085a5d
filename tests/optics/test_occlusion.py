"""Occluders against Möller and Trumbore's test of every ray with every triangle, in NumPy and float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from optics.kernels.backend import Array3f64, Bool, Float64
from optics.mesh import Group, PartMesh, Role
from optics.occlusion import ROLES, Occluder, blocks, first_hit

Array = NDArray[np.float64]

FLOAT32_AT_ONE_METRE = 5e-7
"""Rays start about 1 m away in float32, good to 6e-8 m; a hit is this near to the triangle's plane, so that along the
ray it is off by this over the cosine of incidence."""


def triangles(count: int, *, role: Role, seed: int, group: Group = Group.FIXED) -> PartMesh:
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-0.5, 0.5, (count, 1, 3))
    vertices = (centres + rng.uniform(-0.2, 0.2, (count, 3, 3))).reshape(-1, 3)
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return PartMesh(name=f"{role}", group=group, role=role, vertices_m=vertices, faces=faces)


def distances(part: PartMesh, origin: Array, direction: Array) -> tuple[Array, Array]:
    """Distance along each ray to the part, and its tolerance; Möller & Trumbore, J. Graphics Tools 2, 21, 1997."""
    a, b, c = part.vertices_m[part.faces].transpose(1, 0, 2)
    p = np.cross(direction[:, np.newaxis], c - a)
    determinant = (p * (b - a)).sum(axis=-1)
    s = origin[:, np.newaxis] - a
    u = (s * p).sum(axis=-1) / determinant
    q = np.cross(s, b - a)
    v = (direction[:, np.newaxis] * q).sum(axis=-1) / determinant
    t = (q * (c - a)).sum(axis=-1) / determinant
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    cosine = np.abs(determinant) / np.linalg.norm(np.cross(b - a, c - a), axis=-1)
    nearest = np.arange(len(t)), t.argmin(axis=1)
    return t[nearest], FLOAT32_AT_ONE_METRE / cosine[nearest]


def rays(count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(3)
    origin = rng.normal(size=(count, 3))
    origin /= np.linalg.norm(origin, axis=1, keepdims=True)
    towards = rng.uniform(-0.5, 0.5, (count, 3)) - origin
    return origin, towards / np.linalg.norm(towards, axis=1, keepdims=True)


def test_first_hits_agree_with_every_triangle_tried() -> None:
    parts = [triangles(40, role=Role.HULL, seed=1), triangles(25, role=Role.SERVO, seed=2)]
    origin, direction = rays(4000)
    expected, tolerance = np.stack([distances(part, origin, direction) for part in parts], axis=1)
    found = first_hit(Occluder(parts).parameters(), Array3f64(*origin.T), Array3f64(*direction.T), np.inf, Bool(True))
    distance = np.array(found.distance)
    hit = np.isfinite(distance)
    # A ray within 1e-7 m of a triangle's edge might go either way; none of these 4000 is.
    np.testing.assert_array_equal(hit, np.isfinite(expected.min(axis=0)))
    assert 500 < hit.sum() < 3900
    nearest = expected.argmin(axis=0), np.arange(len(origin))
    assert (np.abs(distance[hit] - expected[nearest][hit]) <= tolerance[nearest][hit]).all()
    np.testing.assert_array_equal(np.array(found.part)[hit], expected.argmin(axis=0)[hit])
    roles = np.array([ROLES.index(Role.HULL), ROLES.index(Role.SERVO)])
    np.testing.assert_array_equal(np.array(found.role)[hit], roles[expected.argmin(axis=0)[hit]])


def test_blocking_ends_at_the_given_distance() -> None:
    part = triangles(40, role=Role.MOUNT, seed=1)
    origin, direction = rays(2000)
    expected, tolerance = distances(part, origin, direction)
    far = np.linspace(0.2, 1.5, len(origin))
    clear = np.abs(expected - far) > tolerance
    found = blocks(
        Occluder([part]).parameters(), Array3f64(*origin.T), Array3f64(*direction.T), Float64(far), Bool(True)
    )
    np.testing.assert_array_equal(np.array(found)[clear], (expected < far)[clear])


def test_inactive_rays_hit_nothing() -> None:
    parameters = Occluder([triangles(40, role=Role.MOUNT, seed=1)]).parameters()
    origin, direction = (Array3f64(*array.T) for array in rays(100))
    assert not np.array(blocks(parameters, origin, direction, np.inf, Bool([False] * 100))).any()
    assert np.isinf(np.array(first_hit(parameters, origin, direction, np.inf, Bool([False] * 100)).distance)).all()


def test_a_group_without_parts_blocks_nothing() -> None:
    parameters = Occluder.of_group([triangles(4, role=Role.MOUNT, seed=1)], Group.PAN).parameters()
    origin, direction = (Array3f64(*array.T) for array in rays(10))
    assert not np.array(blocks(parameters, origin, direction, np.inf, Bool(True))).any()
    assert np.isinf(np.array(first_hit(parameters, origin, direction, np.inf, Bool(True)).distance)).all()


def test_parts_of_two_groups_are_refused() -> None:
    parts = [triangles(1, role=Role.MOUNT, seed=1), triangles(1, role=Role.MOUNT, seed=1, group=Group.TILT)]
    with pytest.raises(ValueError, match="parts of one group, got fixed and tilt"):
        Occluder(parts)
