"""A calibration session in the tank, simulated exactly: what it would give for a rig, and how many poses it takes.

A rig is built with perturbations, its joints are driven to poses from which the tank's boards are seen, the boards'
corners and M2's own are projected through its exact train with its mirrors' real outlines, and noise is added. Hull and
mount are not asked for: nothing of them is near the boards' images.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.camera import Camera
from optics.gaze.kinematics import faces_light
from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import Perturbations
from optics.perturbation.train import NOMINAL, PerturbedTrain
from optics.status import Status
from optics.train import OpticalTrain
from rigs import Rig
from scenes.worlds.tank import tank_boards
from tracking.calibration.calibrated_rig import CalibratedRig
from tracking.calibration.observations import TargetObservations
from tracking.perception.corners.exact import crop_outline_m
from tracking.perception.corners.samples import CornerSamples
from tracking.perception.crop import runs_clockwise

CANDIDATES = 41
"""Joint values a joint among which poses are chosen."""

THINNED = 4
"""One corner in this many of the boards is looked for when poses are chosen."""

FEWEST_CORNERS = 8
"""Of a board that make a pose worth driving to."""

TARGET_M = 3.0
"""Distance of the points by which remaining errors are reported in pixels."""

TARGET_SHARES = (-0.2, 0.0, 0.2)
"""Where in the image they are, beside the principal point in widths and heights: within the gaze mirror."""

JUDGED = 9
"""Joint values a joint at which what remains is judged."""


@dataclass(frozen=True, kw_only=True)
class Remaining:
    """How far a calibrated or the nominal rig is from the built one, over the joints' whole range.

    Attributes
    ----------
    gaze_deg : float
        Root mean square of the angle between the true gaze and the estimated one.
    gaze_worst_deg : float
    image_px : float
        Root mean square distance in the image between a point `TARGET_M` away and where it is estimated to be.
    corners_px : float
        The same of M2's corners.
    """

    gaze_deg: float
    gaze_worst_deg: float
    image_px: float
    corners_px: float


def tank_points() -> tuple[tuple[str, ...], FloatArray, NDArray[np.intp]]:
    """Corners of the tank's boards around the robot.

    Returns
    -------
    boards : tuple of str
    points_m : array, shape (n, 3)
        Body frame.
    board : array, shape (n,)
        Which board each is on.
    """
    boards = tank_boards(0.0)
    points = [board.corners_m for board in boards]
    index = np.repeat(np.arange(len(boards)), [len(corners) for corners in points])
    return tuple(board.name for board in boards), np.concatenate(points), index


def useful_poses(rig: Rig, count: int) -> FloatArray:
    """Joint values, shape (count, 2), from which the nominal rig sees a board, spread as far apart as they can be.

    Raises
    ------
    ValueError
        When there are fewer.
    """
    train = PerturbedTrain(rig)
    boards, points, board = tank_points()
    # Some of the corners will do to say where the boards are.
    points, board = points[::THINNED], board[::THINNED]
    places = train.layout.body_from_camera.inv().apply(points)
    candidates = train.layout.joint_grid(CANDIDATES)
    candidates = candidates[faces_light(train.layout, candidates[:, 1])]
    of_pose = np.repeat(np.arange(len(candidates)), len(places))
    of_place = np.tile(np.arange(len(places)), len(candidates))
    pixels = train.project(places[of_place], candidates[of_pose])
    shown = _within(train.camera, pixels, train.project_face(crop_outline_m(rig), candidates)[of_pose])
    counts = np.zeros((len(candidates), len(boards)), dtype=np.intp)
    np.add.at(counts, (of_pose[shown], board[of_place[shown]]), 1)
    good = candidates[THINNED * counts.max(axis=1) >= FEWEST_CORNERS]
    if len(good) < count:
        raise ValueError(f"expected {count} poses from which a board of the tank is seen, got {len(good)}")
    return _spread(good, count)


def simulated_target(
    rig: Rig,
    perturbations: Perturbations,
    q: FloatArray,
    *,
    known: bool,
    direct: bool,
    noise_px: float,
    seed: int,
    true_q: FloatArray | None = None,
) -> TargetObservations:
    """What a camera would find of the tank's boards.

    Parameters
    ----------
    rig : Rig
        With the signs that its joints really have.
    perturbations : mapping
        Of the built rig.
    q : array, shape (n, 2)
        Poses, radians.
    known : bool
        Whether the boards' places in the body frame are known.
    direct : bool
        Whether the boards are also looked at with the mirrors out of the way.
    noise_px : float
        Standard deviation of the pixels in u and in v.
    seed : int
    true_q : array, shape (n, 2), optional
        Where the joints really were; `q` is where they were commanded to go.
    """
    built, camera = PerturbedTrain(rig), rig.camera
    boards, points, board = tank_points()
    places = built.layout.body_from_camera.inv().apply(points)
    trains = list(zip(q, built.optical_trains(q if true_q is None else true_q, perturbations), strict=True))
    if direct:
        trains.append((np.full(2, np.nan), built.direct_train(perturbations)))
    views = [(pose, *_seen(train, places)) for pose, train in trains]
    pixels = np.concatenate([seen[kept] for _, seen, kept in views])
    pixels += noise_px * np.random.default_rng(seed).standard_normal(pixels.shape)
    of_point = np.concatenate([np.flatnonzero(kept) for _, _, kept in views])
    poses = np.concatenate([np.tile(pose, (int(kept.sum()), 1)) for pose, _, kept in views])
    # Noise may push a corner over the image's edge, where no detector finds it.
    inside = ((pixels >= -0.5) & (pixels <= [camera.width_px - 0.5, camera.height_px - 0.5])).all(axis=1)
    pixels, of_point, poses = pixels[inside], of_point[inside], poses[inside]
    if known:
        return TargetObservations.in_body(poses, points[of_point], pixels)
    # A board of which too little is seen has no pose.
    often = np.bincount(board[of_point], minlength=len(boards)) >= FEWEST_CORNERS
    kept_rows = often[board[of_point]]
    pixels, of_point, poses = pixels[kept_rows], of_point[kept_rows], poses[kept_rows]
    boards, number = tuple(np.array(boards)[often].tolist()), np.cumsum(often) - 1
    on_board = np.concatenate([each.world_from_board.inv().apply(each.corners_m) for each in tank_boards(0.0)])
    return TargetObservations(
        q=poses, points_m=on_board[of_point], pixels=pixels, boards=boards, board=number[board[of_point]]
    )


def simulated_edges(
    rig: Rig,
    perturbations: Perturbations,
    q: FloatArray,
    *,
    noise_px: float,
    seed: int,
    true_q: FloatArray | None = None,
) -> CornerSamples:
    """What a camera would find of M2's corners, in the poses in which all four are within the image."""
    built, camera = PerturbedTrain(rig), rig.camera
    corners = built.project_face(crop_outline_m(rig), q if true_q is None else true_q, perturbations)
    corners += noise_px * np.random.default_rng(seed).standard_normal(corners.shape)
    high = [camera.width_px - 0.5, camera.height_px - 0.5]
    whole = ((corners >= -0.5) & (corners <= high)).all(axis=(1, 2)) & runs_clockwise(corners)
    return CornerSamples(q=q[whole], corners_px=corners[whole])


def remaining(rig: Rig, perturbations: Perturbations, estimated: CalibratedRig | Rig) -> Remaining:
    """Compare an estimated rig with the true one, over the joints' whole range.

    Parameters
    ----------
    rig : Rig
        With the signs that its joints really have.
    perturbations : mapping
        Of the built rig.
    estimated : CalibratedRig or Rig
        A rig is taken as nominal.
    """
    true = PerturbedTrain(rig)
    other: tuple[PerturbedTrain, Perturbations] = (
        (PerturbedTrain(estimated), NOMINAL)
        if isinstance(estimated, Rig)
        else (estimated.perturbed_train, estimated.perturbations)
    )
    q = true.layout.joint_grid(JUDGED)
    q = q[faces_light(true.layout, q[:, 1])]
    poses, points = _far_points(true, perturbations, q)
    both = ((true, perturbations), other)
    gaze = [train.gaze(q, off) for train, off in both]
    pixels = [train.project(points, poses, off) for train, off in both]
    corners = [train.project_face(crop_outline_m(rig), q, off) for train, off in both]
    chord = np.linalg.norm(gaze[0] - gaze[1], axis=1)
    angle = np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1)))
    return Remaining(
        gaze_deg=_rms(angle),
        gaze_worst_deg=float(angle.max()),
        image_px=_rms(np.linalg.norm(pixels[0] - pixels[1], axis=-1)),
        corners_px=_rms(np.linalg.norm(corners[0] - corners[1], axis=-1)),
    )


def _far_points(built: PerturbedTrain, perturbations: Perturbations, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points that the built rig sees around the middle of its image, and the pose of each."""
    camera = built.camera
    shares = np.stack(np.meshgrid(TARGET_SHARES, TARGET_SHARES), axis=-1).reshape(-1, 2)
    pixels = [camera.cx_px, camera.cy_px] + shares * [camera.width_px, camera.height_px]
    (train,), (_, m2) = built.optical_trains(q[:1], perturbations), built.mirror_poses(q, perturbations)
    rays = train.trace_poses(pixels, m2.as_matrix())
    out = rays.status == Status.OK
    return np.repeat(q, len(pixels), axis=0)[out], (rays.origin_m + TARGET_M * rays.direction)[out]


def _seen(train: OpticalTrain, places: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    image = train.project(places)
    return image.pixels, image.status == Status.OK


def _within(camera: Camera, pixels: FloatArray, corners: FloatArray) -> NDArray[np.bool_]:
    """Which pixels, shape (n, 2), are in the image and inside the gaze mirror's outline in it, shape (n, 4, 2)."""
    edges = np.roll(corners, -1, axis=1) - corners
    offsets = pixels[:, np.newaxis] - corners
    inside = (edges[..., 0] * offsets[..., 1] > edges[..., 1] * offsets[..., 0]).all(axis=1)
    high = [camera.width_px - 0.5, camera.height_px - 0.5]
    return np.asarray(inside & ((pixels >= -0.5) & (pixels <= high)).all(axis=1))


def _spread(poses: FloatArray, count: int) -> FloatArray:
    """Some of the poses, each chosen as far as possible from those chosen before."""
    chosen = [int(np.argmin(np.linalg.norm(poses - poses.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(poses - poses[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(poses - poses[chosen[-1]], axis=1))
    return poses[chosen]


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
