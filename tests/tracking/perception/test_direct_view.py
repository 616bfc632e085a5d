"""Pixels and directions of the direct view, by hand."""

from __future__ import annotations

import numpy as np

from tracking.perception.direct_view import DirectView

DIRECTION = np.zeros((2, 4, 3), dtype=np.float32)
DIRECTION[0, :, 0], DIRECTION[1, :, 2] = 1.0, 1.0
VIEW = DirectView(water=np.array([[True, False, False, False], [True, False, False, True]]), direction=DIRECTION)


def test_a_cell_is_all_of_its_pixels():
    pixels = VIEW.pixels(8, 6)
    assert pixels.shape == (6, 8)
    assert pixels[:, :2].all()
    assert pixels[3:, 6:].all()
    assert pixels.sum() == 6 * 2 + 3 * 2


def test_a_place_has_its_cells_direction_up_to_the_images_edge():
    assert VIEW.direction_at(np.array([0.1, 0.49])).tolist() == [1.0, 0.0, 0.0]
    assert VIEW.direction_at(np.array([1.0, 1.0])).tolist() == [0.0, 0.0, 1.0]
    assert VIEW.direction_at(np.array([-0.01, 0.0])).tolist() == [1.0, 0.0, 0.0]


def test_a_small_image_is_looked_at_as_it_is_and_a_large_one_averaged():
    image = np.arange(4 * 8 * 3, dtype=np.uint8).reshape(4, 8, 3)
    picture, hidden = VIEW.taken_from(image)
    assert picture.tobytes() == image.tobytes()
    assert ((hidden == 0) == VIEW.pixels(8, 4)).all()
    large = np.full((800, 1280, 3), 9, dtype=np.uint8)
    large[::2] = 19
    picture, hidden = VIEW.taken_from(large)
    assert picture.shape == (400, 640, 3)
    assert (picture == 14).all()
    assert hidden.shape == (400, 640)
