"""Boards in drawn images: all their points, in their places."""

import cv2
import numpy as np
import pytest

from tracking.port_calibration.boards import APRILTAGS, AprilGrid, Charuco, Chessboard
from tracking.port_calibration.images import find_boards

PIXEL_ERROR = 0.5
"""Of a corner in a drawing that is turned by an interpolating warp, pixels."""

TURN = np.array([[0.9, -0.12, 160.0], [0.08, 0.85, 90.0], [6e-5, 1e-4, 1.0]])


def warped(drawing):
    return cv2.warpPerspective(drawing, TURN, (1000, 800), borderValue=255)


def seen(points):
    return cv2.perspectiveTransform(np.asarray(points, dtype=float)[:, np.newaxis], TURN)[:, 0]


def check(board, image, drawn_px):
    """Every point is where its place on the board was drawn."""
    board_m, pixels = board.found_in(image)
    assert len(board_m) == len(drawn_px)
    wanted = {tuple(np.round(place, 6)): pixel for place, pixel in drawn_px}
    for place, pixel in zip(board_m, pixels, strict=True):
        assert np.linalg.norm(pixel - wanted[tuple(np.round(place, 6))]) < PIXEL_ERROR


def chessboard_image():
    """7 x 6 squares of 80 pixels, the first one black."""
    squares = (np.add.outer(np.arange(6), np.arange(7)) % 2 * 255).astype(np.uint8)
    return cv2.copyMakeBorder(np.kron(squares, np.ones((80, 80), np.uint8)), 60, 60, 60, 60, 0, value=255)


def test_a_chessboard():
    board = Chessboard(columns=6, rows=5, square_m=0.02)
    board_m, pixels = board.found_in(warped(chessboard_image()))
    columns, rows = np.meshgrid(np.arange(6), np.arange(5))
    drawn = seen(60 + 80 * (np.stack([columns.ravel(), rows.ravel()], axis=1) + 1) - 0.5)
    assert board_m.max(axis=0).tolist() == pytest.approx([0.1, 0.08])
    # One number of corners is even, one odd: still the finder may begin at the other end.
    either = min(np.abs(pixels - drawn).max(), np.abs(pixels[::-1] - drawn).max())
    assert either < PIXEL_ERROR


def test_a_charuco_board():
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    drawing = cv2.aruco.CharucoBoard((7, 5), 0.08, 0.06, dictionary).generateImage((760, 560), marginSize=30)
    board = Charuco(columns=7, rows=5, square_m=0.08, marker_m=0.06, dictionary="DICT_5X5_100")
    side = min(700 / 7, 500 / 5)
    places = [(x, y) for y in range(1, 5) for x in range(1, 7)]
    drawn = seen([(30 + side * x - 0.5, 30 + side * y - 0.5) for x, y in places])
    check(board, warped(drawing), [((0.08 * x, 0.08 * y), pixel) for (x, y), pixel in zip(places, drawn, strict=True)])


@pytest.mark.parametrize("border", [1, 2])
@pytest.mark.parametrize("quarter_turns", [0, 2])
def test_an_aprilgrid(border, quarter_turns):
    """However a tag's bits are turned by who drew it: its corners are where the grid has them."""
    dictionary, tag, gap = cv2.aruco.getPredefinedDictionary(APRILTAGS), 100, 30
    rows, columns = 3, 4
    drawing = np.full((60 + rows * (tag + gap), 60 + columns * (tag + gap)), 255, np.uint8)
    wanted = []
    for number in range(rows * columns):
        x, y = 45 + (number % columns) * (tag + gap), 45 + (rows - 1 - number // columns) * (tag + gap)
        marker = cv2.aruco.generateImageMarker(dictionary, number, tag, borderBits=border)
        drawing[y : y + tag, x : x + tag] = np.rot90(marker, quarter_turns)
        for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)):
            place = (0.05 * (1.3 * (number % columns) + i), 0.05 * (1.3 * (number // columns) + j))
            wanted.append((place, seen([(x + i * tag - 0.5, y + (1 - j) * tag - 0.5)])[0]))
    check(AprilGrid(columns=columns, rows=rows, tag_m=0.05, spacing=0.3), warped(drawing), wanted)


def test_images_belong_together_by_the_number_at_their_end(tmp_path):
    board = Chessboard(columns=6, rows=5, square_m=0.02)
    files = {}
    for camera in ("left", "right"):
        files[camera, "water"] = [tmp_path / f"{camera}_{number:02d}.png" for number in (1, 7)]
        for path in files[camera, "water"]:
            cv2.imwrite(str(path), cv2.resize(warped(chessboard_image()), (500, 400), interpolation=cv2.INTER_AREA))
    blank = tmp_path / "left_09.png"
    cv2.imwrite(str(blank), np.full((400, 500), 200, np.uint8))
    files["left", "water"].append(blank)
    found = find_boards(board, files)
    assert found.observations.images == ("water/01", "water/07")
    assert found.observations.cameras == ("left", "right")
    assert len(found.observations.pixels) == 4 * 30
    assert found.without_board == (blank,)


def test_a_flipped_coded_board_is_told(tmp_path):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    drawing = cv2.aruco.CharucoBoard((7, 5), 0.08, 0.06, dictionary).generateImage((760, 560), marginSize=30)
    cv2.imwrite(str(tmp_path / "1.png"), drawing[:, ::-1])
    board = Charuco(columns=7, rows=5, square_m=0.08, marker_m=0.06, dictionary="DICT_5X5_100")
    with pytest.raises(ValueError, match="the images were flipped, flip them back"):
        find_boards(board, {("camera", "water"): [tmp_path / "1.png"]})
