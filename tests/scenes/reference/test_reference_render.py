"""Reference frames: repeatable, with honest errors, and in open water the same as the fast renderer's."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform

from optics.mesh import Group, PartMesh, Role
from optics.ports.port import FlatPort
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.reference.agreement import WHOLE, agreements, pixel_error, time_to_target_error_s
from scenes.reference.estimate import LANES_PER_LAUNCH, launches
from scenes.reference.opening import ALLOWANCE, with_opening
from scenes.reference.render import ReferenceFrame, render_reference
from scenes.renderer import FastRenderer
from scenes.stage.frame import Frame
from scenes.stage.scene import make_scene

SIZE = {"width_px": 8, "height_px": 6}
LARGEST_Z = 4.0


@pytest.fixture(scope="module")
def aqua2():
    return Rig.load("aqua2")


@pytest.fixture(scope="module")
def pair(aqua2):
    """The same view with two seeds, and with the first again."""
    scene = make_scene(aqua2)
    pose = {"q1": np.radians(30), "q2": np.radians(-10)}
    return [render_reference(aqua2, [], scene, **pose, **SIZE, samples=256, seed=seed) for seed in (1, 2, 1)]


def test_same_seed_gives_the_same_bytes(pair):
    first, other, again = pair
    assert first.radiance.shape == (6, 8, 3)
    assert first.radiance.tobytes() == again.radiance.tobytes()
    assert first.standard_error.tobytes() == again.standard_error.tobytes()
    assert (first.radiance != other.radiance).any()


def test_errors_are_as_large_as_seeds_differ(pair):
    """Rationale: every bias is judged by these errors. Expected: the mean square of z over 144 values is near 1.

    The spread of that mean is sqrt(2 / 144) for normal errors; rare bright paths make it wider, so 0.5 is allowed.
    """
    first, second, _ = pair
    z = (first.radiance - second.radiance) / np.hypot(first.standard_error, second.standard_error)
    assert np.mean(z**2) == pytest.approx(1, abs=0.5)


def test_open_water_is_as_bright_as_the_fast_renderer_says():
    """z-test with the reference's variance, looking level into open water of type IB at 5 m.

    The two share the water's coefficients and nothing else: radiative transfer by discrete ordinates there, paths here.
    """
    rig = Rig.load("bench")
    scene = replace(make_scene(rig, world="blue"), target=None)
    frame = FastRenderer(prepare(scene, rig, []), **SIZE, samples=16).render()
    reference = render_reference(rig, [], scene, **SIZE, samples=2**13, seed=1)
    whole = agreements(frame, reference)[0]
    assert whole.name == WHOLE
    assert np.abs(whole.z).max() < LARGEST_Z, whole
    assert np.max(whole.standard_error) < 0.05


def test_bad_arguments_are_told_before_anything_is_computed(aqua2):
    scene = make_scene(aqua2)
    with pytest.raises(ValueError, match="at least 2 samples"):
        render_reference(aqua2, [], scene, **SIZE, samples=1)
    with pytest.raises(ValueError, match=r"q1 \(pan\)"):
        render_reference(aqua2, [], scene, q1=3.0, **SIZE, samples=2)


def test_launches_are_bounded_and_complete():
    for pixels, samples in ((1, 10), (48, 2**15), (10**6, 3)):
        counts = launches(pixels, samples)
        assert sum(counts) == samples
        assert max(counts) * pixels <= max(LANES_PER_LAUNCH, pixels)


def test_opening_has_the_housings_volume():
    """A cylinder of the aperture through a box's front wall; its 256 sides leave 1e-4 of it."""
    box = trimesh.creation.box(extents=(1.0, 0.4, 0.2))
    hull = PartMesh(
        name="hull", group=Group.FIXED, role=Role.HULL, vertices_m=np.asarray(box.vertices), faces=np.asarray(box.faces)
    )
    port = FlatPort(distance_m=0.02, thickness_m=0.008, aperture_radius_m=0.03)
    # The camera looks along the box's x, its port's outer face flush with the front.
    axes = np.column_stack([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, [0.5 - 0.028, 0, 0]
    cut = with_opening(hull, port, RigidTransform.from_matrix(pose))
    opened = trimesh.Trimesh(cut.vertices_m, cut.faces)
    assert opened.is_volume
    depth = 0.028 + 0.006
    assert box.volume - opened.volume == pytest.approx(np.pi * (ALLOWANCE * 0.03) ** 2 * depth, rel=2e-4)
    sheet = replace(hull, faces=hull.faces[box.face_normals[:, 0] > 0.5])
    left = with_opening(sheet, port, RigidTransform.from_matrix(pose))
    front = trimesh.Trimesh(left.vertices_m, left.faces)
    assert 0.4 * 0.2 - front.area == pytest.approx(np.pi * (ALLOWANCE * 0.03) ** 2, rel=0.02)  # a rim of 1 / 200


def made_frames():
    """Four pixels: two of open water seen directly, one of the world in the gaze mirror, one of the housing."""
    radiance = np.array([[[1.1] * 3, [1.3] * 3], [[4.0] * 3, [0.0] * 3]], dtype=np.float32)
    flat = np.zeros((2, 2), dtype=np.float32)
    frame = Frame(
        radiance=radiance,
        distance_m=flat,
        point_m=radiance,
        normal=radiance,
        label=np.array([[1, 1], [3, 0]], dtype=np.uint8),
        region=np.array([[1, 1], [3, 0]], dtype=np.uint8),
        instance=flat.astype(np.int32),
        target_fraction=flat,
    )
    reference = ReferenceFrame(
        radiance=np.array([[[1.0] * 3, [1.0] * 3], [[4.0] * 3, [0.0] * 3]]),
        standard_error=np.array([[[0.03] * 3, [0.04] * 3], [[0.4] * 3, [0.0] * 3]]),
    )
    return frame, reference


def test_bias_and_its_error_by_hand():
    """(1.1 + 1.3) / 2 is 20 % over 1; the error of the mean is sqrt(0.03^2 + 0.04^2) / 2 = 0.025."""
    found = {each.name: each for each in agreements(*made_frames())}
    assert list(found) == [WHOLE, "direct", "gaze", "open water", "world"]
    direct = found["direct"]
    assert direct.pixels == 2
    assert direct.bias == pytest.approx([0.2] * 3)
    assert direct.standard_error == pytest.approx([1.2 * 0.025] * 3)
    assert direct.z == pytest.approx([0.2 / 0.025] * 3)
    assert found["gaze"].bias == pytest.approx([0.0] * 3, abs=1e-7)
    assert found[WHOLE].pixels == 3


def test_time_to_know_a_pixel():
    """Noise falls with the root of the time (0.04 / 1.3 is the median of three): 12 % to 3 % takes 16 times as long."""
    assert pixel_error(*made_frames()) == pytest.approx(0.04 / 1.3, rel=1e-6)
    assert time_to_target_error_s(10.0, 0.12) == pytest.approx(160.0)
