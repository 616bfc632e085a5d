"""Targets: closed, centred, of their stated size, and the user's own."""

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from optics.mesh import double_area_vectors
from scenes.light.materials import Material, albedo_table
from scenes.stage.targets import TARGETS, Ball, MeshShape, target_named
from scenes.surfaces.surface import enclosed_volume_m3

MESHES = sorted(set(TARGETS) - {"ball"})
SIZES_M = {"buoy": (0.18, 0.18, 0.30), "diver": (2.1, 0.67, 0.62), "fish": (0.3, 0.043, 0.11)}
"""As the page on worlds states them: length, width, height."""
ROUNDED = 0.02
"""They are stated to two figures."""


@pytest.fixture(scope="module", params=MESHES)
def shape(request):
    return target_named(request.param)


def test_the_ball_is_the_papers():
    assert target_named("ball") == Ball(radius_m=0.1)
    with pytest.raises(ValueError, match="expected radius_m > 0, got -1"):
        Ball(radius_m=-1)


def test_targets_are_centred_and_of_their_size(shape):
    low, high = shape.surface.vertices_m.min(axis=0), shape.surface.vertices_m.max(axis=0)
    np.testing.assert_allclose(low + high, 0, atol=1e-12)
    np.testing.assert_allclose(high - low, SIZES_M[shape.name], rtol=ROUNDED)


def test_targets_are_closed_with_normals_outward(shape):
    """Every edge is met by its reverse, and every connected piece encloses a positive volume."""
    faces = shape.surface.faces
    directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    np.testing.assert_array_equal(np.sort(directed @ [1, 10**6]), np.sort(directed[:, ::-1] @ [1, 10**6]))
    graph = coo_array((np.ones(len(directed)), directed.T), shape=(faces.max() + 1,) * 2)
    piece = connected_components(graph, directed=False)[1][faces[:, 0]]
    for each in np.unique(piece):
        assert enclosed_volume_m3(shape.surface.vertices_m, faces[piece == each]) > 0
    # A square of 0.01 mm: single precision at arm's length is 1e-7 m.
    assert np.linalg.norm(double_area_vectors(shape.surface.vertices_m[faces]), axis=1).min() > 1e-10


def test_colours_are_reflectances_of_several_materials(shape):
    surface = shape.surface
    assert len(np.unique(surface.material)) >= 2
    brightest = albedo_table()[surface.material].max(axis=1) * surface.colour[surface.faces].max(axis=(1, 2))
    assert surface.colour.min() > 0
    assert brightest.max() < 1


def test_fish_and_diver_look_forward():
    """Eyes and mask lie ahead of the middle, fins behind it, the tank on the diver's back."""
    fish, diver = target_named("fish").surface, target_named("diver").surface

    def middle(surface, material):
        return surface.vertices_m[surface.faces[surface.material == material]].mean(axis=(0, 1))

    assert middle(fish, Material.NEOPRENE)[0] > 0.1
    assert middle(diver, Material.BLUE_CORAL)[0] > 0.5
    assert middle(diver, Material.TILE_YELLOW)[0] < -0.5
    assert middle(diver, Material.STEEL)[2] > 0.1


def test_own_mesh_is_centred_with_its_colours(tmp_path):
    mesh = trimesh.creation.cone(radius=0.2, height=1.0)
    mesh.visual.vertex_colors = np.tile([0, 255, 0, 255], (len(mesh.vertices), 1)).astype(np.uint8)
    mesh.export(tmp_path / "cone.ply")
    shape = target_named(tmp_path / "cone.ply")
    assert isinstance(shape, MeshShape)
    assert shape.name == "cone"
    # trimesh's cone stands on its origin; the target's middle is half its height.
    assert shape.surface.vertices_m[:, 2].min() == pytest.approx(-0.5, abs=1e-6)
    assert (shape.surface.material == Material.COLOURED).all()
    np.testing.assert_array_equal(shape.surface.colour, np.broadcast_to([0, 1, 0], shape.surface.colour.shape))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("shark", r"expected a target \(ball, buoy, diver, fish\) or a file that ends in .obj, .*, got 'shark'"),
        ("shark.stl", r"shark.stl: expected a file, found nothing"),
        ("shark.xml", r"expected a target"),
    ],
)
def test_unknown_targets_are_refused_with_a_sentence(name, message):
    with pytest.raises(ValueError, match=message):
        target_named(name)


def test_a_target_of_a_kilometre_is_doubted(tmp_path):
    trimesh.creation.box(extents=(1000.0, 1.0, 1.0)).export(tmp_path / "crate.stl")
    with pytest.raises(ValueError, match=r"expected a size of 0.01 to 50 m, got 1e\+03 m with unit m; mm or inch"):
        target_named(tmp_path / "crate.stl")
