"""Portraits: a person looks at them; the tests see to it that they show the rig and stay the same."""

import numpy as np
import pytest

from cad.assembly.meshes import rig_meshes
from optics.kernels.backend import activate
from optics.layout import Layout
from rigs import Rig
from scenes import exterior
from scenes.exterior import HEIGHT_PX, VIEWPOINTS, WIDTH_PX, exterior_view, front_faces


@pytest.fixture(scope="module")
def aqua2():
    rig = Rig.load("aqua2")
    return rig, rig_meshes(rig)


def test_the_gimbal_moves_and_the_hull_stays(aqua2, monkeypatch):
    """A quarter of a user's samples: their noise moves one pixel in 8,000 by as much as is looked for."""
    monkeypatch.setattr(exterior, "SAMPLES", 16)
    rig, parts = aqua2
    view = VIEWPOINTS["left"]
    rest, same, turned = (exterior_view(rig, parts, viewpoint=view, q1=q1) for q1 in (0.0, 0.0, 1.0))
    assert rest.shape == (HEIGHT_PX, WIDTH_PX, 3)
    # A graphics card sums a pixel's samples in any order: the last bit of a pixel can round the other way.
    np.testing.assert_allclose(rest.astype(int), same, rtol=0, atol=1 if activate().kind == "cuda" else 0)
    differs = (np.abs(rest.astype(int) - turned) > 8).any(axis=2)
    middle = np.zeros_like(differs)
    middle[HEIGHT_PX // 4 : 7 * HEIGHT_PX // 8, WIDTH_PX // 4 : 3 * WIDTH_PX // 4] = True
    # The gimbal is below the middle; away from it little changes (shadows, reflections).
    assert differs[middle].mean() > 0.05
    assert differs[~middle].mean() < 0.05


def test_only_the_front_of_a_mirror_is_a_mirror(aqua2):
    """Front: as large as the plate, its middle where the train has it. The rest: back and 3 mm of edge all around."""
    rig, parts = aqua2
    layout = Layout.from_rig(rig)
    for name, mirror in (("fold_mirror", rig.gaze.fold_mirror), ("gaze_mirror", rig.gaze.gaze_mirror)):
        part = next(part for part in parts if part.name == name)
        front = front_faces(part, layout)
        corners = part.vertices_m[part.faces]
        areas = 5e5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        size, around = mirror.width_mm * mirror.height_mm, 2 * (mirror.width_mm + mirror.height_mm)
        assert areas[front].sum() == pytest.approx(size, rel=1e-6)
        assert areas[~front].sum() == pytest.approx(size + around * mirror.thickness_mm, rel=1e-6)
        centre = layout.body_from_m1.translation if name == "fold_mirror" else np.zeros(3)
        middle = (corners[front].mean(axis=1) * areas[front, None]).sum(axis=0) / areas[front].sum()
        assert middle == pytest.approx(centre, abs=1e-9)


def test_a_viewpoint_must_be_a_place(aqua2):
    rig, parts = aqua2
    with pytest.raises(ValueError, match="viewpoint to be three finite numbers"):
        exterior_view(rig, parts, viewpoint=(1.0, float("nan"), 0.0))
