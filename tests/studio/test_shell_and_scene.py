"""The covered sphere as triangles in colours, and a mirror's plate as it is drawn."""

import io

import numpy as np
import pytest
import trimesh

from optics.coverage.sphere import cell_directions
from rigs import Rig

pytest.importorskip("viser", reason="the studio's page needs viser: pip install 'mirrorgaze[studio]'")

from studio.rig_scene import plate, unlit_glb
from studio.shell import LEAST_DWELL, dwell_colours, sphere


def test_the_sphere_is_closed_and_turned_inwards():
    vertices, faces = sphere(8)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(-4 / 3 * np.pi, rel=0.02)
    assert np.array_equal(vertices, cell_directions(8))


def test_more_poses_are_darker():
    colours = dwell_colours(np.array([0.0, LEAST_DWELL, 0.03, 1.0])).astype(int)
    assert np.array_equal(colours[0], colours[1])
    assert (np.diff(colours[1:], axis=0) < 0).all()


def test_colours_come_through_the_file():
    mesh = trimesh.creation.icosphere(1)
    mesh.visual.vertex_colors = np.random.default_rng(0).integers(0, 255, (len(mesh.vertices), 4), dtype=np.uint8)
    back = trimesh.load(io.BytesIO(unlit_glb(mesh)), file_type="glb", force="mesh", process=False)
    assert np.allclose(back.vertices, mesh.vertices, atol=1e-6)


@pytest.mark.parametrize("outline", ["rectangle", "octagon", "ellipse"])
def test_a_plate_is_closed_and_as_large_as_its_mirror(outline):
    mirror = Rig.load("aqua2").with_(gaze_mirror__outline=outline).gaze.gaze_mirror
    vertices, faces = plate(mirror)
    mesh = trimesh.Trimesh(1000 * vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert mesh.extents[:2] == pytest.approx([mirror.width_mm, mirror.height_mm], rel=1e-3)
