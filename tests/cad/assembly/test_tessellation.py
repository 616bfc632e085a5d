"""Triangles of solids: closed where a solid touches itself along next to nothing."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from build123d import Pos, Rot

from cad.assembly.tessellation import LINEAR_TOLERANCE_MM, tessellated, without_pinches
from cad.parts.hardware import cap_screw
from cad.shapes import location_matrix


def pinched(along_mm: float) -> trimesh.Trimesh:
    """Two wedges, 10 mm deep and as long at their thin end as told, that have the edge of their thin ends in common."""
    corners = np.array([(0, 0, 0), (0, 0, 1), (10, -5, 0), (10, -5, 10), (10, 5, 0), (10, 5, 10)], dtype=float)
    corners[1, 2] = along_mm
    faces = np.array([(0, 2, 3), (0, 3, 1), (0, 1, 5), (0, 5, 4), (2, 4, 5), (2, 5, 3), (0, 4, 2), (1, 3, 5)])
    other = corners * [-1, -1, 1]
    # The first two corners of both are one.
    second = np.where(faces < 2, faces, faces + 4)
    return trimesh.Trimesh(np.vstack([corners, other[2:]]), np.vstack([faces, second]), process=False)


def test_triangles_do_not_tell_where_a_solid_was_before():
    """All rigs have the same screws: the first one's pose must not show in the files of the next."""
    screw, place = cap_screw("M3", 10).shape, Pos(100, 20, 3) * Rot(90, 0, 0)
    tessellated(screw, tolerance_mm=1.0)
    tessellated(Rot(10, 20, 30) * screw)
    after = tessellated(place * screw)
    alone = tessellated(place * cap_screw.__wrapped__("M3", 10).shape)
    assert np.array_equal(after.faces, alone.faces) and np.array_equal(after.vertices, alone.vertices)


def test_a_solid_that_stands_somewhere_has_its_triangles_there():
    screw, place = cap_screw("M3", 10).shape, Pos(100, 20, 3) * Rot(10, 20, 30)
    here, there, matrix = tessellated(screw), tessellated(place * screw), location_matrix(place)
    np.testing.assert_allclose(there.vertices, here.vertices @ matrix[:, :3].T + matrix[:, 3], atol=1e-9)
    box = (place * screw).bounding_box()
    np.testing.assert_allclose(there.bounds, [tuple(box.min), tuple(box.max)], atol=LINEAR_TOLERANCE_MM)


@pytest.mark.parametrize("along_mm", [0.013, 0.0226])
def test_a_surface_that_touches_itself_along_next_to_nothing_is_closed(along_mm):
    """The second is of a bracket on a robot's low-poly hull, where a strut's edge ended in the roof."""
    mesh = pinched(along_mm)
    closed = without_pinches(mesh)
    assert not mesh.is_watertight
    assert closed.is_watertight
    assert closed.volume == pytest.approx(mesh.volume, abs=10 * 10 * along_mm)


def test_a_surface_that_touches_itself_along_an_edge_is_not():
    assert not without_pinches(pinched(0.5)).is_watertight
