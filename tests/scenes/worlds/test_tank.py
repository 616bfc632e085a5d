"""The tank: walls that close, and checkerboards a camera can be calibrated with."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from optics.mesh import double_area_vectors
from scenes.light.materials import Material
from scenes.surfaces.surface import enclosed_volume_m3
from scenes.worlds.checkerboard import THICKNESS_M, Checkerboard
from scenes.worlds.tank import BOARD_COLUMNS, BOARD_ROWS, BOARD_SQUARE_M, TANK_SIZE_M, tank, tank_boards

DEPTH_M = 5.0
CORNER_FINDER_PX = 0.5
"""A square is 13 px or more wide here; the finder is good to a few tenths of a pixel on slanted squares."""


@pytest.fixture(scope="module")
def world():
    return tank(DEPTH_M)


def test_walls_and_floor_look_into_the_water(world):
    """Seen from the middle, every wall shows its front."""
    for position in range(5):
        faces = world.faces[world.instance == position]
        towards = np.array([0, 0, -DEPTH_M]) - world.vertices_m[faces].mean(axis=1)
        assert (np.sum(double_area_vectors(world.vertices_m[faces]) * towards, axis=1) > 0).all()


def test_basin_is_open_above_and_reaches_the_surface(world):
    assert world.vertices_m[:, 2].max() == 0.0
    assert world.vertices_m[:, 2].min() == -(DEPTH_M + 1.5)
    assert np.ptp(world.vertices_m[:, 0]) == TANK_SIZE_M[0]
    roof = double_area_vectors(world.vertices_m[world.faces])[:, 2] < -1e-9
    assert {world.instance_names[each] for each in np.unique(world.instance[roof])} <= {
        "board ahead",
        "board to the left",
        "board on the floor",
    }


@pytest.mark.parametrize("depth_m", [0.5, 5.0, 100.0])
def test_boards_hang_in_the_water_clear_of_the_robot(depth_m):
    """No corner comes nearer than 1.2 m, none leaves the basin (8 m wide, 1.5 m below the robot) or the water."""
    for board in tank_boards(depth_m):
        vertices = board.surface().vertices_m
        assert np.linalg.norm(vertices - [0, 0, -depth_m], axis=1).min() > 1.2
        assert np.abs(vertices[:, :2]).max() < TANK_SIZE_M[0] / 2
        assert vertices[:, 2].max() < 0
        assert vertices[:, 2].min() > -(depth_m + 1.5)


@pytest.mark.parametrize("board", tank_boards(DEPTH_M), ids=lambda board: board.name)
def test_corners_are_collinear_at_the_stated_pitch(board):
    """Two steps apart in every row and column: the same vector of the square's length; rows square to columns."""
    corners = board.corners_m.reshape(BOARD_ROWS - 1, BOARD_COLUMNS - 1, 3)
    along, down = np.diff(corners, axis=1), np.diff(corners, axis=0)
    # Float64 at 8 m.
    np.testing.assert_allclose(along, np.broadcast_to(along[0, 0], along.shape), atol=1e-14)
    np.testing.assert_allclose(down, np.broadcast_to(down[0, 0], down.shape), atol=1e-14)
    assert np.linalg.norm(along[0, 0]) == pytest.approx(BOARD_SQUARE_M, rel=1e-12)
    assert np.linalg.norm(down[0, 0]) == pytest.approx(BOARD_SQUARE_M, rel=1e-12)
    assert along[0, 0] @ down[0, 0] == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("board", tank_boards(DEPTH_M), ids=lambda board: board.name)
def test_four_squares_that_meet_in_a_corner_alternate(board):
    """Independent of how the plate is meshed: the materials found around every corner, by where the faces are."""
    plate = board.surface()
    middles = plate.vertices_m[plate.faces].mean(axis=1)
    local = board.world_from_board.inv().apply(middles)
    front = np.abs(local[:, 2]) < THICKNESS_M / 4
    local, material = local[front], plate.material[front]
    across, down = board.world_from_board.rotation.as_matrix()[:, :2].T * BOARD_SQUARE_M / 2
    for corner in board.corners_m:
        found = []
        for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            point = board.world_from_board.inv().apply(corner + x * across + y * down)
            found.append(material[np.argmin(np.linalg.norm(local - point, axis=1))])
        assert found[0] == found[2] != found[1] == found[3]
        assert set(found) == {Material.TILE_WHITE, Material.TILE_BLACK}


@pytest.mark.parametrize("board", tank_boards(DEPTH_M), ids=lambda board: board.name)
def test_plates_are_closed_outward_and_seen_from_the_robot(board):
    plate = board.surface()
    area = (BOARD_COLUMNS + 2) * (BOARD_ROWS + 2) * BOARD_SQUARE_M**2
    assert enclosed_volume_m3(plate.vertices_m, plate.faces) == pytest.approx(area * THICKNESS_M, rel=1e-9)
    into = board.world_from_board.rotation.as_matrix()[:, 2]
    towards_board = board.world_from_board.translation - np.array([0, 0, -DEPTH_M])
    # Within 45 degrees of square: a corner finder's working range.
    assert into @ towards_board > np.cos(np.pi / 4) * np.linalg.norm(towards_board)


@pytest.mark.parametrize("columns, rows", [(10, 8), (9, 7), (1, 4)])
def test_boards_that_look_the_same_upside_down_are_refused(columns, rows):
    with pytest.raises(ValueError, match=f"one even and one odd, got {columns} and {rows}"):
        Checkerboard(name="board", columns=columns, rows=rows, square_m=0.1, world_from_board=RigidTransform.identity())


def test_same_tank_same_bytes(world):
    again = tank(DEPTH_M)
    assert again.vertices_m.tobytes() == world.vertices_m.tobytes()
    assert again.faces.tobytes() == world.faces.tobytes()


@pytest.mark.parametrize("board", tank_boards(DEPTH_M), ids=lambda board: board.name)
def test_opencv_finds_the_stated_corners_in_the_stated_order(world, board):
    """A pinhole at the robot looks at the board; its image is the faces' materials, averaged over 4 x 4 samples.

    Expected: the corners that `findChessboardCornersSB` finds are the projections of `corners_m`, in their order.
    """
    import cv2

    from optics.kernels.backend import mi
    from optics.kernels.ray_scene import mesh_scene

    focal, width, height, samples = 600.0, 480, 360, 4
    robot = np.array([0.0, 0.0, -DEPTH_M])
    ahead = board.world_from_board.translation - robot
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(ahead, right), ahead])
    v, u = np.mgrid[0 : height * samples, 0 : width * samples]
    pixel = (np.stack([u, v], axis=-1).reshape(-1, 2) + 0.5) / samples - 0.5
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    directions = np.column_stack([(pixel - centre) / focal, np.ones(len(pixel))]) @ axes
    ray = mi.Ray3f(mi.Point3f(robot.tolist()), mi.Vector3f(directions.T.astype(np.float32)))
    face = np.array(mesh_scene(world.vertices_m, world.faces).ray_intersect_preliminary(ray).prim_index)
    shade = np.select([world.material == each for each in (Material.TILE_BLACK, Material.TILE_WHITE)], [10, 240], 120)
    image = shade[np.minimum(face, len(shade) - 1)].reshape(height, samples, width, samples).mean(axis=(1, 3))
    found, corners = cv2.findChessboardCornersSB(image.astype(np.uint8), (BOARD_COLUMNS - 1, BOARD_ROWS - 1))
    assert found
    local = (board.corners_m - robot) @ axes.T
    expected = local[:, :2] / local[:, 2:] * focal + centre
    error = np.linalg.norm(corners.reshape(-1, 2) - expected, axis=1)
    assert error.max() < CORNER_FINDER_PX
