"""Meshes joined: faces keep their corners."""

from __future__ import annotations

import numpy as np

from optics.mesh import Group, PartMesh, Role, joined_triangles, merge

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3]], dtype=np.int32)


def test_faces_of_joined_triangles_keep_their_corners() -> None:
    pieces = [(CORNERS, FACES), (CORNERS[:3] + 5, FACES[:1]), (CORNERS - 7, FACES[1:])]
    vertices, faces = joined_triangles(pieces)
    expected = np.concatenate([corners[triangles] for corners, triangles in pieces])
    np.testing.assert_array_equal(vertices[faces], expected)
    assert len(vertices) == 4 + 3 + 4
    assert faces.dtype == np.int32


def test_merge_tells_whose_each_face_is() -> None:
    parts = [
        PartMesh(name=name, group=Group.FIXED, role=Role.MOUNT, vertices_m=CORNERS, faces=FACES[:count])
        for name, count in (("two", 2), ("none", 0), ("one", 1))
    ]
    vertices, _, owner = merge(iter(parts))
    assert owner.tolist() == [0, 0, 2]
    assert owner.dtype == np.int32
    assert len(vertices) == 12


def test_nothing_joined_is_empty() -> None:
    vertices, faces, owner = merge([])
    assert vertices.shape == faces.shape == (0, 3)
    assert owner.shape == (0,)
