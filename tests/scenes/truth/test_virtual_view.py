"""z-depth and normals of the virtual cameras, against poses that `optics.gaze.kinematics` composes of reflections."""

from dataclasses import replace

import numpy as np
import pytest

from optics.gaze.kinematics import virtual_camera
from optics.layout import Layout
from optics.mirror import PlaneMirror
from optics.status import Region
from rigs import Rig
from scenes.stage.frame import Label
from scenes.truth import ground_truth

SHAPE = (60, 80)

POINT_ERROR_M = 2e-6
"""Of world coordinates up to 8 m in single precision (half a unit in the last place is 2.4e-7 m), three components."""


@pytest.mark.parametrize("name", ["aqua2", "bluerov2"])
def test_depth_and_normal_are_those_of_the_reflected_camera(name, plain, make_state):
    """Two ways to one number: the point unfolded into the real camera, and the virtual camera's pose inverted."""
    rig = Rig.load(name)
    state = make_state(20.0, -8.0, turn_deg=(30.0, 5.0, -7.0), ball=(1.7, 0.9, -4.5))
    frame = plain(rig, state, SHAPE)
    truth = ground_truth(frame, rig, state)
    layout = Layout.from_rig(rig)
    body = state.world_from_body
    fold = PlaneMirror.from_pose(layout.body_from_m1).reflection.as_matrix()
    world_from = {
        Region.DIRECT: (body * layout.body_from_camera).as_matrix(),
        Region.FOLD: body.as_matrix() @ fold @ layout.body_from_camera.as_matrix(),
        Region.GAZE: (body * virtual_camera(layout, state.q1, state.q2)).as_matrix(),
    }
    for region, pose in world_from.items():
        here = frame.region == region
        assert here.sum() > 50
        inverse = np.linalg.inv(pose)
        z = frame.point_m[here].astype(np.float64) @ inverse[2, :3] + inverse[2, 3]
        np.testing.assert_allclose(truth.view.z_depth_m[here], z, atol=POINT_ERROR_M)
        normal = frame.normal[here] @ inverse[:3, :3].T
        np.testing.assert_allclose(truth.view.normal[here], normal, atol=1e-6)  # single precision of unit vectors
        np.testing.assert_allclose(truth.world_from_virtual()[region], pose, atol=1e-12)
    assert not truth.view.further_reflection.any()


def test_normals_face_the_virtual_camera(aqua2, plain, make_state):
    """Every seen face is turned to the eye, and a reflection keeps that: normal . direction < 0 in every region."""
    state = make_state(-30.0, 4.0, ball=(1.7, -0.9, -4.2))
    frame = plain(aqua2, state, SHAPE)
    truth = ground_truth(frame, aqua2, state)
    seen = frame.label != Label.HOUSING
    # The camera's own rays bend at the port, by less than the slant of any face seen here allows for.
    v, u = np.indices(SHAPE)
    rays = np.stack([u, v, np.ones(SHAPE)], axis=-1) @ np.linalg.inv(truth.camera_matrix).T
    assert (np.sum(rays * truth.view.normal, axis=-1)[seen] < 0).mean() > 0.999


def test_depth_is_infinite_where_nothing_is_seen(aqua2, plain, make_state):
    state = make_state()
    frame = plain(aqua2, state, SHAPE)
    open_water = replace(
        frame,
        distance_m=np.full(SHAPE, np.inf, dtype=np.float32),
        point_m=np.full((*SHAPE, 3), np.nan, dtype=np.float32),
    )
    view = ground_truth(open_water, aqua2, state).view
    assert np.isinf(view.z_depth_m).all()
    assert not view.further_reflection.any()


def test_what_the_sea_surface_mirrors_is_told_apart(aqua2, plain, make_state):
    """A point seen in the surface lies at the same path length as its mirror image, and somewhere else."""
    state = make_state(0.0, 15.0)
    frame = plain(aqua2, state, SHAPE)
    mirrored = frame.point_m.copy()
    upper = np.isin(frame.label, [Label.WORLD]) & (frame.point_m[..., 2] > -3.0)
    mirrored[upper, 2] += 2 * 0.05  # as if the surface were 5 cm above the point
    truth = ground_truth(replace(frame, point_m=mirrored), aqua2, state)
    assert upper.sum() > 100
    assert (truth.view.further_reflection == upper).all()
    assert (truth.carrier[upper] == 0).all()


def test_samples_off_the_centre_are_not_taken_for_reflections(aqua2, plain, make_state):
    """A frame whose rays all pass a third of a pixel beside the centres, as the first of several samples does."""
    state = make_state(10.0, -8.0, ball=(1.7, 0.3, -4.2))
    wide = plain(aqua2, state, (SHAPE[0], 3 * SHAPE[1]))
    beside = replace(wide, **{name: getattr(wide, name)[:, 2::3] for name in wide.__dataclass_fields__})
    assert not ground_truth(beside, aqua2, state).view.further_reflection.any()


def test_a_state_without_a_pose_is_refused(aqua2, plain, make_state):
    state = make_state()
    with pytest.raises(ValueError, match=r"state.world_from_body: expected the robot's pose, got None"):
        ground_truth(plain(aqua2, state, SHAPE), aqua2, replace(state, world_from_body=None))
