"""The reference's mirrors end where their outlines do."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from optics.kernels.backend import mi
from optics.mirror_outline import OUTLINES, mirror_outline
from rigs import Rig
from scenes.light.materials import Material
from scenes.reference.bodies import mirror_shape

WAVELENGTHS_NM = np.array([610.0, 530.0, 465.0])


@pytest.mark.parametrize("outline", OUTLINES)
def test_a_mirror_is_hit_within_its_outline_and_looks_along_its_normal(outline):
    mirror = Rig.load("aqua2").gaze.gaze_mirror.model_copy(update={"outline": outline})
    pose = RigidTransform.from_translation([0.1, 0.2, 0.3])
    shape = mirror_shape(pose, mirror, 1.34, np.full((max(Material) + 1, 3), 0.1), WAVELENGTHS_NM)
    scene = mi.load_dict({"type": "scene", "mirror": shape})
    x, y = np.random.default_rng(1).uniform(-0.06, 0.06, (2, 5000)).astype(np.float32)
    ray = mi.Ray3f(mi.Point3f(x + 0.1, y + 0.2, 1.0), mi.Vector3f(0, 0, -1))
    hit = scene.ray_intersect(ray)
    assert (np.array(hit.is_valid()) == mirror_outline(mirror).contains(x, y)).mean() > 0.999
    assert np.array(hit.n.z)[np.array(hit.is_valid())] == pytest.approx(1, abs=1e-6)
