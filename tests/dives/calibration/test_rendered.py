"""From images to a calibrated rig: boards of the tank, rendered through the mirrors and found by OpenCV."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from dives.calibration.simulation import remaining
from optics.perturbation.train import PerturbedTrain
from rigs import Rig
from scenes.stage.scene import make_scene
from scenes.worlds.tank import BOARD_COLUMNS, BOARD_ROWS, tank_boards
from tracking.calibration.board_corners import board_corners
from tracking.calibration.calibrated_rig import with_joints
from tracking.calibration.estimate import calibrate
from tracking.calibration.observations import TargetObservations
from tracking.perception.corners.exact import crop_outline_m

DEPTH_M = 3.0

BACK_M = 1.2
"""The robot hangs so much farther from each board than in the tank, so that all of it fits into the mirror."""

VIEWS = 3
"""Poses for each board."""

FINDER_PX = 0.1
"""Standard deviation of the finder on these images: 0.03 to 0.1 px against the exact projection."""


@pytest.mark.slow
def test_rig_built_wrong_is_found_from_rendered_boards():
    """Rationale: all steps that a user takes, on images that know nothing of the calibration's mathematics.

    The built rig has its joints off by 1.2 and -0.9 degrees, both mirrors by 1 mm, the port by 1 mm and 1.2 degrees:
    what a rig file can say and the renderer follows. Nine images of three boards in known places.
    Expected: the gaze comes from about 2 degrees to 0.1, points from 20 px to 1 px; measured 0.01 degrees, 0.2 px.
    """
    nominal = Rig.load("aqua2")
    built = built_wrong(nominal)
    train = PerturbedTrain(built)
    scene = make_scene(nominal, depth_m=DEPTH_M)
    q, places, pixels = [], [], []
    renderer = renderer_of(built, scene)
    for board in tank_boards(DEPTH_M):
        away = (board.world_from_board.translation - scene.world_from_body.translation) * [1, 1, 0]
        hung = RigidTransform.from_translation(-BACK_M * away / np.linalg.norm(away)) * scene.world_from_body
        corners = hung.inv().apply(board.corners_m)
        for pose in whole_views(train, train.layout.body_from_camera.inv().apply(corners)):
            frame = renderer.render(q1=pose[0], q2=pose[1], world_from_body=hung)
            outline = train.project_face(crop_outline_m(built), pose[np.newaxis])[0]
            found = board_corners(as_image(frame.radiance), outline, columns=BOARD_COLUMNS, rows=BOARD_ROWS)
            assert found is not None, f"{board.name} at {np.degrees(pose)} degrees"
            q.append(np.tile(pose, (len(found), 1)))
            places.append(corners)
            pixels.append(found)
    target = TargetObservations.in_body(np.concatenate(q), np.concatenate(places), np.concatenate(pixels))
    estimate = calibrate(nominal, target=target, noise_px=FINDER_PX)
    before, after = remaining(built, {}, nominal), remaining(built, {}, estimate.calibrated)
    assert before.gaze_deg > 1.5
    assert before.image_px > 15
    assert after.gaze_deg <= 0.1
    assert after.image_px <= 1
    assert estimate.residual_px < 2 * FINDER_PX


def test_no_board_is_found_where_there_is_none():
    empty = np.full((60, 80, 3), 128, dtype=np.uint8)
    outline = np.array([[10.0, 10], [70, 10], [70, 50], [10, 50]])
    assert board_corners(empty, outline, columns=10, rows=7) is None
    assert board_corners(empty, outline + 500, columns=10, rows=7) is None
    with pytest.raises(ValueError, match="four finite corners"):
        board_corners(empty, np.full((4, 2), np.nan), columns=10, rows=7)


def test_corners_of_a_drawn_board_are_found_where_they_are():
    """Squares of 16 px whose edges lie on pixel edges: the corners are half a pixel beside pixel centres."""
    squares = (np.add.outer(np.arange(7), np.arange(10)) % 2 == 0).astype(np.uint8) * 230 + 10
    image = np.full((160, 220), 240, dtype=np.uint8)
    image[24:136, 30:190] = np.kron(squares, np.ones((16, 16), dtype=np.uint8))
    outline = np.array([[5.3, 4], [215, 4], [215, 156], [5.3, 156]])
    found = board_corners(np.repeat(image[..., np.newaxis], 3, axis=2), outline, columns=10, rows=7)
    x, y = np.meshgrid(30 + 16 * np.arange(1, 10) - 0.5, 24 + 16 * np.arange(1, 7) - 0.5)
    expected = np.stack([x.ravel(), y.ravel()], axis=1)
    assert np.abs(found - expected).max() < FINDER_PX


def built_wrong(nominal: Rig) -> Rig:
    pan = nominal.gaze.joints.pan.model_copy(update={"offset_deg": 1.2})
    tilt = nominal.gaze.joints.tilt.model_copy(update={"offset_deg": -0.9})
    changes = {
        "port": nominal.port.model_copy(
            update={"distance_mm": nominal.port.distance_mm + 1, "normal": (0.017, -0.012, 1.0)}
        ),
    }
    moved = nominal.with_gaze(
        fold_mirror={"distance_mm": nominal.gaze.fold_mirror.distance_mm + 1},
        gaze_mirror={"distance_mm": nominal.gaze.gaze_mirror.distance_mm - 1},
    )
    return with_joints(moved, pan, tilt).model_copy(update=changes)


def renderer_of(rig: Rig, scene):
    from scenes.baking.light_quality import LightQuality
    from scenes.baking.lit_scene import prepare
    from scenes.renderer import FastRenderer

    return FastRenderer(prepare(scene, rig, [], quality=LightQuality.coarse()), samples=4)


def as_image(radiance: np.ndarray) -> np.ndarray:
    bright = np.percentile(radiance, 99.5)
    return (255 * np.clip(radiance / bright, 0, 1) ** (1 / 2.2)).astype(np.uint8)


def whole_views(train: PerturbedTrain, corners_m: np.ndarray) -> np.ndarray:
    """Poses in which all corners of a board are inside the gaze mirror's outline, far from each other."""
    q = train.layout.joint_grid(60)
    count = len(corners_m)
    pixels = train.project(np.tile(corners_m, (len(q), 1)), np.repeat(q, count, axis=0))
    outline = train.project_face(crop_outline_m(train.rig), q)[:, np.newaxis]
    offset = pixels.reshape(len(q), count, 1, 2) - outline
    edge = np.roll(outline, -1, axis=2) - outline
    inside = (edge[..., 0] * offset[..., 1] > edge[..., 1] * offset[..., 0]).all(axis=2)
    high = [train.camera.width_px - 1, train.camera.height_px - 1]
    shown = ((pixels >= 0) & (pixels <= high)).all(axis=1).reshape(len(q), count)
    whole = q[(inside & shown).all(axis=1)]
    assert len(whole) >= VIEWS
    return whole[np.linspace(0, len(whole) - 1, VIEWS).round().astype(int)]
