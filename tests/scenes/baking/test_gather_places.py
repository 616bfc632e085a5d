"""Places of a mesh at which light is gathered, and which vertices share it."""

import numpy as np
import pytest

from scenes.baking.gather_places import Places, double_areas_around, places_on
from scenes.light.materials import Material
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh, vertex_normals
from scenes.surfaces.shapes import unit_sphere

APART_M = 0.3


@pytest.fixture(scope="module")
def ball():
    vertices, faces = unit_sphere(3)
    return GroupMesh(
        vertices_m=vertices,
        faces=faces.astype(np.int32),
        material=np.full(len(faces), Material.NEOPRENE, dtype=np.int32),
        label=np.full(len(faces), Label.HULL, dtype=np.int32),
        instance=np.zeros(len(faces), dtype=np.int32),
        colour=None,
    )


def places(mesh: GroupMesh, apart_m: float) -> Places:
    normals = vertex_normals(mesh.vertices_m, mesh.faces)
    return places_on(mesh.vertices_m, normals, double_areas_around(mesh), apart_m)


def test_vertices_share_with_one_that_is_near_and_faces_about_the_same_way(ball):
    """Within the diagonal of a cell; components of normals within a step of 2/3."""
    normals = vertex_normals(ball.vertices_m, ball.faces)
    found = places(ball, APART_M)
    stand_for = found.vertices[found.owner]
    assert len(found.vertices) < 0.6 * len(normals)
    assert np.linalg.norm(ball.vertices_m[stand_for] - ball.vertices_m, axis=1).max() <= APART_M * 3**0.5
    assert np.abs(normals[stand_for] - normals).max() <= 2 / 3
    np.testing.assert_array_equal(stand_for[found.vertices], found.vertices)


def test_far_enough_apart_each_vertex_stands_for_itself(ball):
    found = places(ball, 1e-3)
    np.testing.assert_array_equal(found.vertices[found.owner], np.arange(len(ball.vertices_m)))


def test_of_a_cell_the_vertex_with_the_largest_faces_is_looked_from(ball):
    """A speck right above a corner of a large level square faces up as well: the corner stands for both."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    speck = square * 1e-3 + [1e-3, 1e-3, 1e-4]
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = GroupMesh(
        vertices_m=np.concatenate([speck, square]),
        faces=np.concatenate([faces, faces + 4]).astype(np.int32),
        material=np.zeros(4, dtype=np.int32),
        label=np.zeros(4, dtype=np.int32),
        instance=np.zeros(4, dtype=np.int32),
        colour=None,
    )
    found = places(mesh, 0.1)
    np.testing.assert_array_equal(found.vertices, [4, 5, 6, 7])
    np.testing.assert_array_equal(found.owner, [0, 0, 0, 0, 0, 1, 2, 3])
