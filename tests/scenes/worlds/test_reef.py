"""The reef: large enough, clear of the robot, below the surface, the same for the same seed."""

from itertools import pairwise

import numpy as np
import pytest

from optics.mesh import double_area_vectors
from scenes.light.materials import Material, albedo_table
from scenes.surfaces.noise import GradientNoise
from scenes.surfaces.poisson_disk import spaced
from scenes.surfaces.space_colonisation import PIPE_EXPONENT, grown_tree
from scenes.surfaces.surface import enclosed_volume_m3
from scenes.worlds import growths
from scenes.worlds.catalogue import world_named
from scenes.worlds.reef import (
    ARENA_FLOOR_M,
    ARENA_RADIUS_M,
    BOTTOM_BELOW_ROBOT_M,
    FORMS,
    FREE_RADIUS_M,
    REEF_VERSION,
    reef,
)
from scenes.worlds.terrain import RADIUS_M

DEPTH_M = 6.0
SMALLEST_DOUBLE_AREA_M2 = 1e-7
"""Triangles a tenth of a millimetre wide and a millimetre long: far above single precision at 20 m (2e-6 m)."""


@pytest.fixture(scope="module")
def world():
    return reef(DEPTH_M)


def test_reef_has_the_size_the_renderer_is_measured_with(world):
    """The issue asks for 300 000 triangles or more; the page on worlds promises less than 450 000."""
    assert 300_000 < len(world.faces) < 450_000
    assert len(world.material) == len(world.instance) == len(world.faces)
    assert world.colour.shape == world.vertices_m.shape
    assert world.colour.dtype == np.float32
    assert world.instance.dtype == np.int32


def test_reef_is_what_is_in_caches(world, check_recorded):
    arrays = {"vertices": world.vertices_m, "faces": world.faces, "material": world.material, "colour": world.colour}
    check_recorded("reef", REEF_VERSION, rel=1e-6, **arrays)


def test_a_kept_reef_is_the_reef(world, tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    monkeypatch.setattr("scenes.worlds.catalogue.reef", lambda depth_m, seed: world)
    made, kept = world_named("reef", DEPTH_M), world_named("reef", DEPTH_M)
    assert made is world
    assert (kept.name, kept.instance_names, kept.notes) == (world.name, world.instance_names, ())
    for name in ("vertices_m", "faces", "material", "colour", "instance"):
        np.testing.assert_array_equal(getattr(kept, name), getattr(world, name), strict=True)


@pytest.mark.parametrize(("depth_m", "seed"), [(0.5, 3), (30.0, 1)])
def test_reef_leaves_the_robot_room_and_stays_below_the_surface(depth_m, seed):
    made = reef(depth_m, seed)
    assert np.isfinite(made.vertices_m).all()
    assert made.vertices_m[:, 2].max() < -0.29
    assert np.abs(made.vertices_m[:, :2]).max() < RADIUS_M + 1
    assert np.linalg.norm(made.vertices_m - [0, 0, -depth_m], axis=1).min() > FREE_RADIUS_M
    arena = np.hypot(*made.vertices_m[:, :2].T) < ARENA_RADIUS_M
    assert made.vertices_m[arena, 2].max() < -(depth_m + BOTTOM_BELOW_ROBOT_M) + ARENA_FLOOR_M
    # Straight below, the bottom lies where it is promised, but for ripples and swells of sand.
    below = np.hypot(*made.vertices_m[:, :2].T) < 0.5
    assert made.vertices_m[below, 2].mean() == pytest.approx(-(depth_m + BOTTOM_BELOW_ROBOT_M), abs=0.25)


def test_there_is_a_ridge_ahead_and_open_water_to_the_right(world):
    """Horizontal rays: most hit something within 8 m ahead and to the left, few do to the right."""
    from optics.kernels.backend import mi
    from optics.kernels.ray_scene import mesh_scene

    scene = mesh_scene(world.vertices_m, world.faces)

    def share(low_deg, high_deg):
        azimuth = np.radians(np.linspace(low_deg, high_deg, 400))
        ray = mi.Ray3f(mi.Point3f(0, 0, -DEPTH_M), mi.Vector3f(np.cos(azimuth), np.sin(azimuth), np.zeros(400)))
        distance = np.array(scene.ray_intersect_preliminary(ray).t)
        assert distance.min() > FREE_RADIUS_M
        return (distance < 8).mean()

    assert share(0, 100) > 0.7
    assert share(-120, -60) < 0.3


def test_no_triangle_is_degenerate(world):
    assert np.linalg.norm(double_area_vectors(world.vertices_m[world.faces]), axis=1).min() > SMALLEST_DOUBLE_AREA_M2


def test_every_colour_is_a_reflectance(world):
    """Factors times the material's spectrum stay below 1 at every wavelength of the camera."""
    largest = albedo_table()[world.material].max(axis=1) * world.colour[world.faces].max(axis=(1, 2))
    assert largest.max() < 1
    assert world.colour.min() > 0


def test_red_things_compete_with_the_ball(world):
    """The ball's own spectrum is found on things of several kinds, some of them balls of its size."""
    red = world.material == Material.RED_SPONGE
    kinds = {world.instance_names[each].rstrip(" 0123456789") for each in np.unique(world.instance[red])}
    assert {"sea floor", "ball sponge", "sea fan", "tube sponge"} <= kinds


def test_instances_are_named_once_and_their_faces_lie_together(world):
    assert len(set(world.instance_names)) == len(world.instance_names) > 300
    assert all(later - earlier in (0, 1) for earlier, later in pairwise(world.instance.tolist()))
    assert world.instance[-1] == len(world.instance_names) - 1


def test_same_seed_same_bytes_another_seed_another_reef(world):
    again, other = reef(DEPTH_M), reef(DEPTH_M, seed=1)
    for field in ("vertices_m", "faces", "material", "colour", "instance"):
        assert getattr(again, field).tobytes() == getattr(world, field).tobytes()
    assert other.vertices_m.tobytes() != world.vertices_m.tobytes()


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize("detail", [0, 1, 2])
def test_growths_are_closed_with_normals_outward(form, detail):
    """Each directed edge is met by its reverse, and every connected piece encloses a positive volume."""
    made = form.make(np.random.default_rng(4), detail)
    directed = made.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    code = np.sort(directed @ [1, 1_000_000])
    np.testing.assert_array_equal(code, np.sort(directed[:, ::-1] @ [1, 1_000_000]))
    assert len(np.unique(code)) == len(code)
    for piece in connected(made.faces):
        assert enclosed_volume_m3(made.vertices_m, piece) > 0


def connected(faces):
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_array((np.ones(len(edges)), edges.T), shape=(faces.max() + 1,) * 2)
    owner = connected_components(graph, directed=False)[1][faces[:, 0]]
    return [faces[owner == each] for each in np.unique(owner)]


def test_finer_detail_has_more_triangles():
    for form in FORMS:
        counts = [len(form.make(np.random.default_rng(0), detail).faces) for detail in range(3)]
        assert counts == sorted(set(counts)), form.name


def test_spaced_points_keep_their_distance_and_leave_no_room():
    """Dart throwing: no two disks meet, and whoever was left out meets an earlier one that was kept."""
    rng = np.random.default_rng(0)
    points, radius = rng.uniform(0, 5, (300, 3)), rng.uniform(0.1, 0.6, 300)
    kept = spaced(points, radius)
    apart = np.linalg.norm(points[:, np.newaxis] - points, axis=-1) - radius[:, np.newaxis] - radius
    within = apart[np.ix_(kept, kept)]
    assert within[~np.eye(len(kept), dtype=bool)].min() >= 0
    for lost in np.setdiff1d(np.arange(300), kept):
        assert (apart[lost, kept[kept < lost]] < 0).any()


def test_gradient_noise_vanishes_on_the_lattice_and_is_smooth():
    """Perlin 2002: zero on integer points, continuous slope across cells."""
    noise = GradientNoise(np.random.default_rng(0))
    lattice = np.stack(np.meshgrid(*[np.arange(-3.0, 4.0)] * 3), axis=-1)
    assert np.abs(noise(lattice)).max() == 0
    step = 1e-5
    line = np.array([1.0, 0.3, 0.7]) + np.outer([-2, -1, 0, 1, 2], [step, 0, 0])
    slope = np.diff(noise(line)) / step
    # The slope's own change over a step is of the step's order.
    assert np.ptp(slope) < 20 * step


def test_tree_reaches_its_points_and_thickens_to_the_root():
    """Points are reached to two steps, but for a few that pull a node to and fro; the pipe model holds exactly."""
    rng = np.random.default_rng(0)
    points = rng.uniform([-0.4, -0.4, 0.3], [0.4, 0.4, 1.0], (60, 3))
    tree = grown_tree(points, step_m=0.05)
    nearest = np.linalg.norm(points[:, np.newaxis] - tree.nodes_m, axis=-1).min(axis=1)
    assert (nearest <= 2 * 0.05).mean() > 0.9
    for node in range(len(tree.parent)):
        children = tree.radius_m[tree.parent == node]
        if len(children):
            assert tree.radius_m[node] ** PIPE_EXPONENT == pytest.approx((children**PIPE_EXPONENT).sum(), rel=1e-9)


def test_rocks_are_grown_over_above_and_bare_below():
    made = growths.rock(np.random.default_rng(0), 2)
    height = made.vertices_m[made.faces].mean(axis=1)[:, 2]
    assert height[made.material == Material.TURF].mean() > height[made.material == Material.ROCK].mean() + 0.2
