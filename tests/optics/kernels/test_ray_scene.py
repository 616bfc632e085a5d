"""Scenes that rays can hit: several in one kernel."""

from __future__ import annotations

import numpy as np
import pytest

from optics.kernels import ray_scene
from optics.kernels.backend import dr, mi
from optics.kernels.ray_scene import first_faces, mesh_scene, shared_scene

CORNERS, FACE = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]), np.array([[0, 1, 2]])


def test_one_kernel_searches_several_scenes():
    scenes = [mesh_scene(CORNERS + np.array([0, 0, away]), FACE) for away in (1.0, 2.0, 3.0)]
    ray = mi.Ray3f(mi.Point3f(0, 0, 0), mi.Vector3f(0, 0, 1))
    found = [scene.ray_intersect_preliminary(ray).t for scene in scenes]
    dr.eval(found)
    assert [distance[0] for distance in found] == pytest.approx([1.0, 2.0, 3.0], rel=1e-6)


def test_all_scenes_are_made_beside_the_same_one(monkeypatch):
    """Which is what makes graphics cards search more than one: without a card, only the making can be looked at."""
    first, made = ray_scene._first_scene(), []
    load = mi.load_dict
    monkeypatch.setattr(mi, "load_dict", lambda description, **options: made.append(description) or load(description))
    for away in (1.0, 2.0):
        mesh_scene(CORNERS + np.array([0, 0, away]), FACE)
    assert [description["beside"] for description in made] == [first] * 2


def test_a_scene_is_shared_by_all_who_ask_while_its_arrays_live():
    corners, again = CORNERS.copy(), CORNERS.copy()
    scene = shared_scene(corners, FACE)
    assert shared_scene(corners, FACE) is scene
    assert shared_scene(again, FACE) is not scene
    known = len(ray_scene._SHARED)
    del corners, again
    assert len(ray_scene._SHARED) == known - 2


def test_the_first_triangle_is_hit_from_either_side():
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    vertices = np.concatenate([np.column_stack([corners, np.full(3, height)]) for height in (1.0, 3.0)])
    scene = mesh_scene(vertices, np.arange(6, dtype=np.int32).reshape(2, 3))
    origins = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 5.0], [3.0, 3.0, 0.0]])
    directions = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    distance, face = first_faces(scene, origins, directions)
    assert distance == pytest.approx([1.0, 2.0, np.inf])
    assert face.tolist() == [0, 1, -1]
