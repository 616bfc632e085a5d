"""Light gathered from what stands around, where it is known otherwise: open water, a lid, a floor close by."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform

from optics.mesh import Group
from optics.mirror_outline import Rectangle
from scenes.baking.ambient import (
    NotKeptError,
    PlaceSizes,
    Surroundings,
    cached,
    kept_light_alone,
    with_ambient,
)
from scenes.baking.light_quality import LightQuality
from scenes.baking.robot_occlusion import DIVISION_VERSION, LONGEST_EDGE_M, at_rest, divided_faces, with_occlusion
from scenes.baking.source_volume import lit_world
from scenes.kernels.ambient_cube import ROW, SIDES
from scenes.light.materials import Material, albedo_table
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh
from scenes.stage.records import MirrorPlate

FULL = LightQuality.full()
EVERYWHERE = PlaceSizes(iterated=0.001, kept=0.001)
UP, DOWN, LEVEL = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]


@pytest.fixture(scope="module")
def light(aqua2_light):
    return aqua2_light


def gathered(mesh, origins, normals, light, source=None, *, directions=256):
    """Irradiance of planes by what they see in so many directions, shape (n, 3)."""
    depth_m = float(np.median(-origins[:, 2]))
    around = Surroundings.of(mesh, light, depth_m=depth_m)
    if source is not None:
        around = around.lit(mesh.ambient, source, depth_m=depth_m)
    return sum(around.irradiance(origins, normals, np.broadcast_to(directions, len(origins))))


def plate(half_m, height_m, material=Material.TILE_WHITE, *, cells=1):
    """Level square of small squares, seen from both sides."""
    x = np.linspace(-half_m, half_m, cells + 1)
    vertices = np.stack([*(axis.ravel() for axis in np.meshgrid(x, x)), np.full((cells + 1) ** 2, height_m)], axis=1)
    first = (np.arange(cells)[:, np.newaxis] * (cells + 1) + np.arange(cells)).ravel()
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + cells + 2], axis=1),
            np.stack([first, first + cells + 2, first + cells + 1], axis=1),
        ]
    )
    return GroupMesh(
        vertices_m=vertices,
        faces=faces.astype(np.int32),
        material=np.full(len(faces), material, dtype=np.int32),
        label=np.full(len(faces), Label.WORLD, dtype=np.int32),
        instance=np.zeros(len(faces), dtype=np.int32),
        colour=np.ones((len(vertices), 3), dtype=np.float32),
    )


def test_open_water_gathered_is_the_irradiance_of_its_solution(light):
    """Radiance of all directions, weighted by the cosine, against the irradiance that the solver tabulates.

    The glow about the sun is a few degrees wide: points look in 256 directions each, turned from point to point, and
    the mean of 200 of them is within 2 %.
    """
    normals = np.repeat([UP, DOWN, LEVEL], 200, axis=0)
    origins = np.tile([0.0, 0.0, -5.0], (len(normals), 1))
    expected = light.open_water_irradiance(-origins[:, 2], normals)
    found = gathered(None, origins, normals, light)
    means = [values.reshape(3, 200, 3).mean(axis=1) for values in (found, expected)]
    np.testing.assert_allclose(*means, rtol=0.02)


def test_places_that_look_in_different_numbers_of_directions_keep_their_order(light):
    """What each receives is open water's at its own depth, 3 m to 17 m: half of the light or more goes on the way."""
    origins = np.column_stack([np.zeros((8, 2)), -np.arange(3.0, 19.0, 2.0)])
    normals = np.tile(UP, (8, 1))
    directions = np.tile([4096, 2048], 4)
    expected = light.open_water_irradiance(-origins[:, 2], normals)
    np.testing.assert_allclose(gathered(None, origins, normals, light, directions=directions), expected, rtol=0.1)


def test_a_lid_takes_the_light_from_above(light):
    """0.1 m under a dark lid 6 m wide a thirtieth of a percent of the directions pass by its rim.

    What is left is the water's between, ``c h`` of open water's or less, and what the lid's dark underside sends back.
    Light from below lacks what the sun would have sent through the water that now lies in the lid's shadow: no more
    than its share, a third in red.
    """
    dark = plate(3.0, -4.9, Material.NEOPRENE)
    lid = with_ambient(dark, light, FULL, EVERYWHERE, lambda: Surroundings.of(dark, light))
    normals = np.array([UP, DOWN])
    origins = np.tile([0.0, 0.0, -5.0], (2, 1))
    under, open_water = (gathered(mesh, origins, normals, light) for mesh in (lid, None))
    assert (under[0] < 0.1 * open_water[0]).all()
    assert (under[1] < open_water[1]).all()
    assert (under[1] > 0.66 * open_water[1]).all()


def test_a_floor_close_by_sends_its_albedo(light):
    """A plane that faces a wide floor from 20 mm above receives what the floor sends: albedo times its irradiance."""
    depth = 5.0
    dark = plate(3.0, -depth, cells=6)
    floor = with_ambient(dark, light, FULL, EVERYWHERE, lambda: Surroundings.of(dark, light))
    uniforms = light.uniforms(depth)
    sun = uniforms.sun_irradiance * np.exp(-uniforms.sun_attenuation * depth) * light.towards_sun[2]
    ambient = light.open_water_irradiance(np.array([depth]), np.array([UP]))[0]
    received = uniforms.ambient_fraction * ambient.repeat(3) + sun
    white = albedo_table(light.bands)[int(Material.TILE_WHITE)]
    expected = (light.bands.weight @ (white * received)).ravel()
    found = gathered(floor, np.array([[0.0, 0.0, 0.02 - depth]]), np.array([DOWN]), light)[0]
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_a_mirror_close_by_sends_what_comes_from_above(light):
    """A plane that faces a wide level mirror from 20 mm above receives open water's light from above, less its loss.

    The loss is Fresnel's, at some cosine; 2 % for directions and the water between.
    """
    depth = 5.0
    level = MirrorPlate(
        centre=np.array([0, 0, -depth]),
        x=np.array([1, 0, 0]),
        y=np.array([0, 1, 0]),
        outline=Rectangle(half_width=3.0, half_height=3.0),
    )
    mirror = replace(plate(3.0, -depth - 1e-3, Material.MIRROR_BACK), mirrors={"M1": level})
    cosine = np.linspace(0.05, 1, 50)
    loss = [np.polynomial.polynomial.polyval(cosine, fit) for fit in light.uniforms(depth).mirror_fit]
    found = gathered(mirror, np.array([[0.0, 0.0, 0.02 - depth]]), np.array([DOWN]), light, directions=4096)[0]
    share = found / light.open_water_irradiance(np.array([depth]), np.array([UP]))[0]
    assert 0.98 * np.min(loss) < share.min()
    assert share.max() < 1.02 * np.max(loss)


def test_the_volume_over_a_floor_is_what_is_gathered_there(light):
    """At a node the volume holds the difference to open water; far above the middle of a small floor there is none."""
    floor, source, volume = lit_world(plate(0.4, -5.0), light, FULL)
    shape = [int(n[0]) for n in volume.count]
    values = np.array(volume.values).reshape(*shape, len(SIDES), ROW)[..., :3]
    corner, step = (np.array([float(x[0]) for x in axis]) for axis in (volume.corner, volume.inverse_step))
    point = corner + np.array([0, 0, 1]) / step
    there = np.array([point]), np.array([DOWN]), light
    expected = (gathered(floor, *there, source) - gathered(None, *there))[0]
    side = int(np.argmax(SIDES @ DOWN))
    # Each point looks in directions of its own: the difference is known to some per cent of itself.
    np.testing.assert_allclose(values[0, 0, 1, side], expected, rtol=0.2)
    assert (values[0, 0, 1, side] > 0).all()


def test_parts_under_a_roof_are_in_its_shade(light):
    """A plate right below a larger dark one receives next to nothing from above, the roof itself all of it."""
    roof, below = plate(1.5, 0.0, Material.NEOPRENE), plate(0.05, -0.05, Material.NEOPRENE)
    still = {str(Group.FIXED): RigidTransform.identity(), str(Group.PAN): RigidTransform.identity()}
    meshes = {str(Group.FIXED): roof, str(Group.PAN): below}
    lit, whole, _ = with_occlusion(meshes, still, None, light, FULL, world_from_body=at_rest(RigidTransform.identity()))
    top = lit[str(Group.FIXED)].unoccluded[lit[str(Group.FIXED)].faces].mean(axis=(0, 1))
    under = lit[str(Group.PAN)].unoccluded.mean(axis=0)
    np.testing.assert_allclose(top, 1, atol=0.03)
    assert (under < 0.1).all()
    assert len(whole.faces) >= len(roof.faces) + len(below.faces)


def test_what_is_kept_on_disk_is_of_the_places_too(light, tmp_path, monkeypatch, caplog):
    """Asked again it is not made again; for an eye elsewhere it is. What is made is told."""
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    caplog.set_level("INFO", logger="scenes")
    with kept_light_alone(), pytest.raises(NotKeptError, match="light"):
        cached(plate(1.0, 0.0), light, FULL, "light", lambda: pytest.fail("found"), places=[np.array([0.5])])
    made = [
        float(cached(plate(1.0, 0.0), light, FULL, "light", lambda k=k: np.array([k]), places=[np.array([eye_m])])[0])
        for k, eye_m in enumerate((0.5, 0.5, 0.6))
    ]
    assert made == [0, 0, 2]
    with kept_light_alone():
        assert (
            cached(plate(1.0, 0.0), light, FULL, "light", lambda: pytest.fail("found"), places=[np.array([0.6])]) == 2
        )
    assert [record.getMessage() for record in caplog.records] == ["finding the light; it is kept for the next time"] * 2


def test_a_part_is_divided_as_in_caches(check_recorded):
    """Edges of at most 5 cm, and three corners where three sides meet."""
    box = trimesh.creation.box(bounds=[[0, 0, 0], [0.12, 0.12, 0.12]])
    found = divided_faces(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32))
    corners = found["vertices_m"][found["faces"]]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max() <= LONGEST_EDGE_M
    assert (found["vertices_m"] == 0).all(axis=1).sum() == 3
    check_recorded("divided part", DIVISION_VERSION, rel=1e-9, **found)
