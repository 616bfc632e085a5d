"""Light past what stands around, and shadows: closed forms of the parts that a frame's kernel is lit by."""

from dataclasses import replace

import numpy as np
import pytest

from optics.kernels.backend import Array3f32, Float32, UInt32
from optics.kernels.packing import AT_ONCE, Packing, rows_of
from optics.kernels.ray_scene import mesh_scene
from scenes.kernels.ambient_cube import ROW, SIDES, changed_irradiance
from scenes.kernels.grid import GridTable
from scenes.kernels.sun_map import SUN_MAP_VERSION, reached_by_sun, sun_map, sunlit_share
from scenes.light.sea import SeaState
from scenes.stage.clearance import Clearance
from scenes.stage.records import NO_BALL, WORLD, Pose, StateRecord
from scenes.surfaces.surface import surface
from scenes.worlds import world_named
from scenes.worlds.world import world_of

ROOF = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
FLOOR = ROOF * 4 - [0.0, 0.0, 2.0]
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture(scope="module")
def roof_over_floor():
    """Sun map of a square of 2 m, 2 m above a floor, under a sun in the zenith."""
    vertices = np.concatenate([ROOF, FLOOR])
    faces = np.concatenate([FACES, FACES + 4]).astype(np.int32)
    return sun_map(mesh_scene(vertices, faces), vertices, faces, np.array([0.0, 0.0, 1.0]))


def test_the_shadow_of_a_roof_is_as_large_as_the_roof(roof_over_floor):
    """A parallel beam throws a shadow of the same size; edges are as fine as the grid (4 mm)."""
    x = np.array([-1.5, -1.01, -0.99, 0.0, 0.99, 1.01, 1.5], dtype=np.float32)
    points = Array3f32(Float32(x), Float32(0), Float32(-2))
    share = reached_by_sun(roof_over_floor, points, Array3f32(0, 0, 1)).numpy()
    np.testing.assert_array_equal(share, [1, 1, 0, 0, 0, 1, 1])


def test_a_surface_does_not_shade_itself(roof_over_floor):
    share = reached_by_sun(roof_over_floor, Array3f32(0.3, 0.2, 0), Array3f32(0, 0, 1))
    assert share[0] == 1


def test_half_of_a_way_out_from_under_the_roof_is_sunlit(roof_over_floor):
    """From its middle 2 m to the side, without attenuation: 1 m in the shadow, 1 m in the light."""
    share = sunlit_share(roof_over_floor, Array3f32(0, 0, -1), Array3f32(1, 0, 0), Float32(2.0), Float32(0.0))
    assert share[0] == pytest.approx(0.5)


def test_a_world_too_large_for_fine_cells_has_no_map():
    assert sun_map(mesh_scene(ROOF * 100, FACES), ROOF * 100, FACES, np.array([0.0, 0.0, 1.0])) is None


def test_the_map_of_a_large_mesh_is_kept(roof_over_floor, tmp_path, monkeypatch, check_recorded):
    """The second time nothing is traced: there is no scene."""
    monkeypatch.setattr("scenes.kernels.sun_map.KEPT_FROM_FACES", 1)
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    vertices, faces = np.concatenate([ROOF, FLOOR]), np.concatenate([FACES, FACES + 4]).astype(np.int32)
    whole = (vertices, faces, np.array([0.0, 0.0, 1.0]))
    heights = [sun_map(scene, *whole).height.numpy() for scene in (mesh_scene(vertices, faces), None)]
    np.testing.assert_array_equal(heights[0], roof_over_floor.height.numpy())
    np.testing.assert_array_equal(heights[1], heights[0])
    some = heights[0].reshape(2048, 2048)[::61, ::61]
    check_recorded("sun map", SUN_MAP_VERSION, rel=1e-6, heights=np.where(np.isfinite(some), some, -100))


@pytest.mark.parametrize("name", ["tank", "reef"])
def test_clearance_is_a_lower_bound_and_not_an_empty_one(name):
    """Against random points of all faces: none is nearer, and the bound is not far below the nearest."""
    world = world_named(name, 5.0)
    rng = np.random.default_rng(1)
    share = rng.dirichlet([1, 1, 1], size=(20, len(world.faces)))
    points = np.einsum("sfk,fkd->sfd", share, world.vertices_m[world.faces])
    nearest = np.linalg.norm(points - [0, 0, -5.0], axis=-1).min()
    assert 0.5 * nearest < Clearance(world).metres(np.array([[0, 0, -5.0]]))[0] <= nearest


def test_clearance_on_the_way_is_a_lower_bound_too():
    """A robot that drifts: what is told near the last search is never more than what a search would find."""
    world = world_named("reef", 5.0)
    drifting = Clearance(world)
    way = np.array([0, 0, -5.0]) + np.cumsum(np.random.default_rng(2).normal(0, 0.03, (60, 3)), axis=0)
    told = np.array([drifting.metres(place[np.newaxis])[0] for place in way])
    searched = np.array([Clearance(world).metres(place[np.newaxis])[0] for place in way[::6]])
    assert (told[::6] <= searched + 1e-12).all()
    assert (told[::6] >= 0.75 * searched).all()


def test_open_water_keeps_any_distance():
    assert Clearance(world_of("blue", [])).metres(np.zeros((2, 3))).tolist() == [np.inf, np.inf]


def test_clearance_of_a_single_face_holds_in_its_middle():
    """Above the middle of a triangle all corners are farther than the face."""
    side = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]])
    world = world_of("face", [("face", surface(side, [[0, 1, 2]], 0))])
    assert Clearance(world).metres(side.mean(axis=0, keepdims=True) + np.array([0, 0, 0.4]))[0] <= 0.4


def test_ambient_cube_is_exact_for_a_linear_change():
    """Irradiance that grows with height on level planes: interpolation is linear, sides weigh as squared cosines."""
    counts = (2, 2, 3)
    axes = [np.arange(n, dtype=float) for n in counts]
    height = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)[:, 2]
    values = np.zeros((len(height), len(SIDES), 3))
    values[:, 2] = height[:, np.newaxis] * [1.0, 2.0, 3.0]  # upward-facing planes alone
    volume = GridTable.of(axes, rows_of(values.reshape(-1, 3), ROW))
    point = Array3f32(0.25, 0.75, 1.4)
    tilted = Array3f32(0.6, 0, 0.8)
    np.testing.assert_allclose(
        [c[0] for c in changed_irradiance(volume, point, tilted)], 0.64 * 1.4 * np.arange(1, 4), rtol=1e-5
    )
    assert [c[0] for c in changed_irradiance(volume, point, Array3f32(0, 0, -1))] == [0, 0, 0]
    assert [c[0] for c in changed_irradiance(volume, Array3f32(9, 0, 0), tilted)] == [0, 0, 0]


def test_other_numbers_than_a_packing_knows_are_refused():
    packing = Packing.of({"a": [1.0, 2.0], "b": 3.0})
    assert packing.width == AT_ONCE
    with pytest.raises(ValueError, match="expected numbers"):
        packing.records({"a": [1.0], "b": 3.0})


def test_packed_numbers_come_back_in_their_shapes():
    """A batch of two records: scalars, nested arrays and dataclasses in dicts, and what is None stays so."""
    matrices = np.arange(24, dtype=float).reshape(2, 3, 4)
    sea = SeaState(wave_turns=np.array([[1.0, 2.0], [3.0, 4.0]]), flicker_time_s=np.array([5.0, 6.0]))
    ball = replace(NO_BALL, centre=np.zeros((2, 3)), radius=np.ones(2), material=np.zeros(2), instance=np.zeros(2))
    poses = {WORLD: Pose(rotation=matrices[..., :3], translation=matrices[..., 3])}
    batch = StateRecord(
        poses=poses, mirrors={}, towards_sun=np.ones((2, 3)), clearance_m=np.zeros(2), ball=ball, sea=sea
    )
    packing = Packing.of(batch, batched=True)
    second = packing.unpack(packing.upload(batch, 2), UInt32(1))
    assert np.ravel(second.world.rotation).tolist() == matrices[1, :, :3].ravel().tolist()
    assert (np.ravel(second.sea.wave_turns).tolist(), second.sea.flicker_time_s[0]) == ([3, 4], 6)
    still = Packing.of(replace(batch, sea=None), batched=True)
    assert still != packing
    assert still.unpack(still.upload(replace(batch, sea=None), 2), UInt32(0)).sea is None
