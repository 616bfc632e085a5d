"""Worlds by name and from the user's files."""

import numpy as np
import pytest
import trimesh

from optics.kernels.backend import another_thread, dr, mi
from scenes.light.materials import Material
from scenes.surfaces.surface import enclosed_volume_m3
from scenes.worlds import world_named
from scenes.worlds.mesh_file import linear

DEPTH_M = 7.0

MITSUBA_SCENE = """<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective" id="camera"/>
  <emitter type="constant" id="sky"/>
  <shape type="cube" id="crate">
    <bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.2, 0.7"/></bsdf>
  </shape>
  <shape type="sphere" id="buoy"/>
</scene>
"""


@pytest.fixture
def block():
    """Box of 2 x 1 x 0.5 m, red above its middle and blue below."""
    mesh = trimesh.creation.box(extents=(2.0, 1.0, 0.5))
    mesh.visual.vertex_colors = np.where(mesh.vertices[:, 2:] > 0, [255, 0, 0, 255], [0, 0, 128, 255]).astype(np.uint8)
    return mesh


def test_blue_water_is_empty():
    world = world_named("blue", DEPTH_M)
    assert world.vertices_m.shape == world.faces.shape == world.colour.shape == (0, 3)
    assert world.material.shape == world.instance.shape == (0,)
    assert world.instance_names == ()


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb"])
def test_a_mesh_file_comes_back_where_the_robot_is(tmp_path, block, suffix):
    """Round trip through each format; GLB is written as its standard says, y up, and comes back with z up."""
    path = tmp_path / f"wreck{suffix}"
    if suffix == ".glb":
        block.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    block.export(path)
    world = world_named(path, DEPTH_M)
    assert world.name == "wreck"
    assert len(world.faces) == 12
    # Text formats keep 8 digits, binary ones single precision.
    np.testing.assert_allclose(world.vertices_m.max(axis=0), [1.0, 0.5, 0.25 - DEPTH_M], atol=1e-6)
    np.testing.assert_allclose(world.vertices_m.min(axis=0), [-1.0, -0.5, -0.25 - DEPTH_M], atol=1e-6)
    assert enclosed_volume_m3(world.vertices_m, world.faces) == pytest.approx(1.0, rel=1e-5)
    if suffix == ".stl":  # which has no colours
        assert (world.material == Material.ROCK).all()
        assert (world.colour == 1).all()
    else:
        assert (world.material == Material.COLOURED).all()
        above = world.vertices_m[:, 2] > -DEPTH_M
        np.testing.assert_allclose(world.colour[above], np.broadcast_to([1, 0, 0], (above.sum(), 3)), atol=0.01)
        # sRGB 128 of 255 is 0.2159 in linear light (IEC 61966-2-1).
        np.testing.assert_allclose(world.colour[~above], np.broadcast_to([0, 0, 0.2159], (8 - 4, 3)), atol=0.01)


def test_srgb_is_linear_below_its_knee():
    """IEC 61966-2-1: 10/255 lies on the straight part (1/12.92), 255 is 1, 188 is 0.503."""
    np.testing.assert_allclose(linear([10, 188, 255]), [10 / 255 / 12.92, 0.5029, 1.0], atol=1e-4)


def test_a_colour_for_each_face_stays_on_its_face(tmp_path):
    mesh = trimesh.creation.box(extents=(1.0, 1.0, 1.0))
    mesh.visual.face_colors = np.tile([[255, 0, 0, 255], [0, 255, 0, 255]], (6, 1)).astype(np.uint8)
    mesh.export(tmp_path / "die.ply")
    world = world_named(tmp_path / "die.ply", DEPTH_M)
    corners = world.colour[world.faces]
    np.testing.assert_array_equal(corners.min(axis=1), corners.max(axis=1))
    np.testing.assert_array_equal(corners[0, 0], [1, 0, 0])
    np.testing.assert_array_equal(corners[1, 0], [0, 1, 0])


def test_a_texture_is_taken_at_the_vertices(tmp_path):
    from PIL import Image

    image = np.zeros((8, 8, 3), dtype=np.uint8)
    image[:, :4, 0], image[:, 4:, 1] = 255, 255  # left half red, right half green
    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    mesh.visual = trimesh.visual.TextureVisuals(
        uv=[[0.05, 0.5], [0.95, 0.5], [0.95, 0.9], [0.05, 0.9]], image=Image.fromarray(image)
    )
    mesh.export(tmp_path / "tile.obj")
    world = world_named(tmp_path / "tile.obj", DEPTH_M)
    left = world.vertices_m[:, 0] < 0.5
    np.testing.assert_array_equal(world.colour[left], np.broadcast_to([1, 0, 0], (left.sum(), 3)))
    np.testing.assert_array_equal(world.colour[~left], np.broadcast_to([0, 1, 0], ((~left).sum(), 3)))


def test_units_are_stated_and_doubted(tmp_path, block):
    path = tmp_path / "wreck.stl"
    block.apply_scale(1000)
    block.export(path)
    world = world_named(path, DEPTH_M, unit="mm")
    assert np.ptp(world.vertices_m[:, 0]) == pytest.approx(2.0, rel=1e-6)
    block.apply_scale(10)
    block.export(path)
    with pytest.raises(ValueError, match=r"expected a size of 0.2 to 2000 m, got 2e\+04 m with unit m; mm or inch"):
        world_named(path, DEPTH_M)
    with pytest.raises(ValueError, match=r"expected a unit \(m, mm, inch\), got 'feet'"):
        world_named(path, DEPTH_M, unit="feet")


def test_parts_of_a_file_are_instances(tmp_path, block):
    scene = trimesh.Scene()
    scene.add_geometry(block, geom_name="hull", node_name="hull")
    mast = trimesh.creation.cylinder(radius=0.1, height=3.0)
    pose = trimesh.transformations.translation_matrix([0, 2.0, 0])
    scene.add_geometry(mast, geom_name="mast", node_name="mast", transform=pose)
    scene.export(tmp_path / "ship.glb")
    world = world_named(tmp_path / "ship.glb", DEPTH_M)
    assert world.instance_names == ("hull", "mast")
    of_mast = world.vertices_m[world.faces[world.instance == 1]].reshape(-1, 3)
    np.testing.assert_allclose(of_mast.mean(axis=0)[2], 2.0 - DEPTH_M, atol=1e-6)


def test_a_mitsuba_scene_gives_its_triangles_and_names_the_rest(tmp_path):
    path = tmp_path / "harbour.xml"
    path.write_text(MITSUBA_SCENE)
    world = world_named(path, DEPTH_M)
    assert world.instance_names == ("crate",)
    assert len(world.faces) == 12
    assert enclosed_volume_m3(world.vertices_m, world.faces) == pytest.approx(8.0, rel=1e-6)
    np.testing.assert_allclose(world.vertices_m.mean(axis=0), [0, 0, -DEPTH_M], atol=1e-6)
    np.testing.assert_allclose(world.colour, np.broadcast_to([0.1, 0.2, 0.7], world.colour.shape), atol=1e-6)
    (note,) = world.notes
    for name in ("shape buoy (no triangles)", "emitter sky", "sensor camera"):
        assert name in note


TEXTURED = """<scene version="3.0.0">
  <shape type="cube" id="crate">
    <bsdf type="diffuse"><texture type="bitmap" name="reflectance">
      <string name="filename" value="paint.exr"/><boolean name="raw" value="true"/>
    </texture></bsdf>
  </shape>
</scene>
"""


@pytest.mark.timeout(60)
def test_textures_of_a_mitsuba_scene_are_read_by_a_single_thread(tmp_path):
    """As on a machine with one core: without another thread Mitsuba's reader of OpenEXR waits for ever."""
    paint = mi.Bitmap(np.full((64, 64, 3), 0.25, dtype=np.float32))
    with another_thread():
        paint.write(str(tmp_path / "paint.exr"))
    (tmp_path / "harbour.xml").write_text(TEXTURED)
    threads = dr.thread_count()
    dr.set_thread_count(1)
    try:
        world = world_named(tmp_path / "harbour.xml", DEPTH_M)
    finally:
        dr.set_thread_count(threads)
    np.testing.assert_allclose(world.colour, 0.25, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("absent.obj", None, r"absent.obj: expected a file, found nothing"),
        ("moon", None, r"expected a world \(blue, reef, tank\) or a file that ends in .obj, .*\.xml, got 'moon'"),
        ("text.ply", b"not a mesh", r"text.ply: expected a mesh, got what cannot be read as one"),
        ("empty.obj", b"v 0 0 0\n", r"empty.obj: expected"),
        ("nan.obj", b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", r"nan.obj: expected finite coordinates"),
        ("bad.xml", b"<scene version='3.0.0'><shape type='blob'/></scene>", r"bad.xml: expected a Mitsuba scene"),
        ("none.xml", b"<scene version='3.0.0'/>", r"none.xml: expected triangle meshes, got none"),
        (
            "line.obj",
            b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
            r"line.obj: expected triangles that have an area, got none; export it again",
        ),
    ],
)
def test_bad_files_are_refused_with_a_sentence(tmp_path, monkeypatch, name, content, message):
    monkeypatch.chdir(tmp_path)
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        world_named(name, DEPTH_M)
