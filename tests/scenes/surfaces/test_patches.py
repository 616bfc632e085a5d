"""Patches cut into a mesh: borders where the scores are equal, no gaps, nothing lost, values linear."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from optics.mesh import double_area_vectors
from scenes.surfaces.patches import patches

CELLS = 6


def grid():
    """Unit squares, two triangles each, from (0, 0) to (6, 6)."""
    x, y = np.meshgrid(np.arange(CELLS + 1.0), np.arange(CELLS + 1.0))
    index = np.arange((CELLS + 1) ** 2).reshape(CELLS + 1, CELLS + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return vertices, np.concatenate(faces).astype(np.int32)


def areas(vertices, faces):
    return double_area_vectors(vertices[faces])[:, 2] / 2


def test_a_border_lies_where_scores_are_equal():
    """A straight border through the edges' middles: 2.5 of 6 columns are of the first kind, to the last digit."""
    vertices, faces = grid()
    made = patches(faces, np.stack([2.5 - vertices[:, 0], vertices[:, 0] - 2.5], axis=1))
    cut = made.over(vertices)
    shares = np.bincount(made.kind, weights=areas(cut, made.faces))
    np.testing.assert_allclose(shares, [2.5 * CELLS, 3.5 * CELLS], rtol=1e-14)
    middle = cut[made.faces].mean(axis=1)
    np.testing.assert_array_equal(made.kind, middle[:, 0] > 2.5)


def test_a_border_bends_no_further_than_it_must_to_leave_no_splinters():
    """Scores equal 0.02 of an edge behind a column of vertices: the border stays a tenth away from them."""
    vertices, faces = grid()
    made = patches(faces, np.stack([3.02 - vertices[:, 0], np.zeros(len(vertices))], axis=1))
    border = made.over(vertices)[len(vertices) :, 0]
    np.testing.assert_allclose(border, 3.1, rtol=1e-14)


def test_three_kinds_meet_in_the_middle_of_their_face():
    made = patches(np.array([[0, 1, 2]], dtype=np.int32), np.eye(3))
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    cut = made.over(corners)
    np.testing.assert_allclose(cut[3:], [[0.5, 0, 0], [0, 0.5, 0], [0.5, 0.5, 0], [1 / 3, 1 / 3, 0]], atol=1e-15)
    np.testing.assert_allclose(np.bincount(made.kind, weights=areas(cut, made.faces)), 1 / 6, rtol=1e-14)


@given(seed=st.integers(0, 10**6), kinds=st.integers(1, 5))
@settings(max_examples=40)
def test_nothing_is_lost_and_no_gap_opens(seed, kinds):
    """Random scores: faces cover the square once, all face up, and inner edges are met once from each side."""
    vertices, faces = grid()
    scores = np.random.default_rng(seed).normal(size=(len(vertices), kinds))
    made = patches(faces, scores)
    cut = made.over(vertices)
    assert areas(cut, made.faces).min() > 0
    assert areas(cut, made.faces).sum() == pytest.approx(CELLS**2, rel=1e-12)
    directed = made.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    paired = {tuple(edge) for edge in directed.tolist()}
    rim = np.array([edge for edge in paired if edge[::-1] not in paired])
    ends = cut[rim, :2]
    outside = [np.isclose(ends, side, atol=1e-12).all(axis=1) for side in (0, CELLS)]
    assert np.any(outside, axis=(0, 2)).all()
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(4 * CELLS, rel=1e-12)
    linear = vertices @ [2.0, -3.0, 0.0] + 1.0
    np.testing.assert_allclose(made.over(linear), cut @ [2.0, -3.0, 0.0] + 1.0, atol=1e-12)


def test_every_corner_keeps_its_kind():
    vertices, faces = grid()
    scores = np.random.default_rng(3).normal(size=(len(vertices), 4))
    made = patches(faces, scores)
    for corner in range(3):
        old = made.faces[:, corner] < len(vertices)
        np.testing.assert_array_equal(scores.argmax(axis=1)[made.faces[old, corner]], made.kind[old])
