"""Where an adjustment begins: a focal length out of a row of them, poses from rays, and several places for the port.

Nothing has to be known of the camera. Focal lengths from a fisheye's to a telephoto's are tried, each with the poses
that the rays of each image give in one linear step, and refined a little; what fits best goes on. Images in air come
first when there are any: they do not depend on the port.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import FisheyeCamera, PinholeCamera
from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import CAMERA
from optics.perturbation.port_camera import Lens, PortCamera, Window
from optics.ports.port import DomePort, FlatPort
from tracking.calibration.board_start import pose_on_rays
from tracking.port_calibration.bundle import Arrangement, Bundle, Prior, Solution, in_medium
from tracking.port_calibration.covariance import prior_of
from tracking.port_calibration.observations import FEWEST_IMAGES, MEDIA, BoardObservations

FOCAL_LENGTHS = (0.25, 0.4, 0.6, 0.9, 1.4, 2.2)
"""Tried as parts of the larger side of the image: fields of view from 130 to 25 degrees, of a fisheye's to 230."""

DISTANCES = (0.3, 1.0, 3.0)
"""Tried as parts of a flat port's distance that was given for a start."""

OFFSETS = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.3), (0.0, 0.0, -0.3))
"""Shifts of a dome's centre that are tried, in inner radii."""

START_IMAGES, START_POINTS = 8, 40
"""Of a camera in each medium, and of a board: as many are looked at in the search for a start."""

START_NOISE_PX = 5.0
"""Standard deviation of the search's pixels: wide, since no lens is known yet."""

FEW_STEPS, MORE_STEPS = 8, 30

FINALISTS = 2
"""Starts that are refined in all their parameters."""

FEWEST_RAYS = 4
"""Of a board's points: eight numbers for the six of its pose."""

FEWEST_RAYS_IN_SPACE = 6
"""Of a target that is not flat: eleven numbers are found in one linear step."""

STRAY = 5.0
"""Images whose residual is this many times the median's are placed once more."""


def start_camera(
    seen: BoardObservations, free: tuple[str, ...], model: str, port: Window, lens: Lens | None
) -> tuple[PortCamera, RigidTransform]:
    """Camera and poses of its boards near those of the least residual, from images of one camera.

    Parameters
    ----------
    seen : BoardObservations
        Of one camera.
    free : tuple of str
        What will be estimated.
    model : str
        pinhole or fisheye.
    port : FlatPort or DomePort or NoPort
        Thickness and indices, and a first guess of where it is.
    lens : PinholeCamera or FisheyeCamera, optional
        Intrinsics to begin with.

    Raises
    ------
    ValueError
        When no start leads anywhere.
    """
    few, prior = _few(seen), camera_prior(seen, free, model, port, lens)
    first = _in_air(few)
    lenses = [lens] if lens is not None else _focal_lengths(seen.sizes_px[0], model)
    if lens is None and first is not None:
        # Air comes first: its images do not depend on the port, and give the lens.
        best = _best(
            first,
            prior,
            tuple(name for name in free if "port" not in name),
            [PortCamera(camera=each, port=port) for each in lenses],
        )
        lenses = [best.arrangement.cameras[0].camera]
    cameras = [PortCamera(camera=each, port=place) for each in lenses for place in _places(port, free)]
    best = _best(few, prior, free, cameras)
    camera = best.arrangement.cameras[0]
    poses = board_poses(seen, camera)
    if poses is None:
        raise ValueError(
            f"camera {seen.cameras[0]}: found no pose for some of its boards; check the order of the points"
        )
    solved = Bundle(seen, [free], [prior]).solve(_alone(camera, poses), noise_px=START_NOISE_PX, steps=MORE_STEPS)
    return _restarted(seen, prior, free, solved)


def camera_prior(seen: BoardObservations, free: tuple[str, ...], model: str, port: Window, lens: Lens | None) -> Prior:
    """Prior of one camera: its lens and port as they were given."""
    camera = lens if lens is not None else _focal_lengths(seen.sizes_px[0], model)[len(FOCAL_LENGTHS) // 2]
    return prior_of(PortCamera(camera=camera, port=port), free)


def start_rig(seen: BoardObservations, alone: Sequence[tuple[PortCamera, dict[str, RigidTransform]]]) -> Arrangement:
    """All cameras and boards in the first camera's frame, from what each camera found alone (poses by image name)."""
    placed: dict[int, RigidTransform] = {0: RigidTransform.identity()}
    boards = dict(alone[0][1])
    while len(placed) < len(alone):
        index = next(each for each in range(len(alone)) if each not in placed and set(alone[each][1]) & set(boards))
        own = alone[index][1]
        shared = [name for name in own if name in boards]
        placed[index] = _mean_pose([own[name] * boards[name].inv() for name in shared])
        boards |= {name: placed[index].inv() * pose for name, pose in own.items() if name not in boards}
    return Arrangement(
        cameras=tuple(camera for camera, _ in alone),
        camera_from_rig=tuple(placed[index] for index in range(len(alone))),
        rig_from_board=RigidTransform.concatenate([boards[name] for name in seen.images]),
    )


def _few(seen: BoardObservations) -> BoardObservations:
    """Some images of each medium, evenly chosen."""
    kept: list[int] = []
    for medium in np.unique(seen.medium):
        images = np.unique(seen.image[seen.medium == medium])
        count = min(START_IMAGES, len(images))
        kept += images[np.linspace(0, len(images) - 1, count).round().astype(int)].tolist()
    chosen = np.isin(seen.image, kept)
    for _, _, view in seen.views():
        points = np.flatnonzero(view)
        thinned = points[np.linspace(0, len(points) - 1, min(START_POINTS, len(points))).round().astype(int)]
        chosen[np.setdiff1d(points, thinned)] = False
    return seen.rows(chosen)


def _in_air(seen: BoardObservations) -> BoardObservations | None:
    chosen = seen.medium != MEDIA.index("water")
    return seen.rows(chosen) if len(np.unique(seen.image[chosen])) >= FEWEST_IMAGES else None


def _focal_lengths(size_px: tuple[int, int], model: str) -> list[Lens]:
    width, height = size_px
    kind: Any = PinholeCamera if model == "pinhole" else FisheyeCamera
    fields = {"width_px": width, "height_px": height, "cx_px": (width - 1) / 2, "cy_px": (height - 1) / 2}
    lengths = [part * max(size_px) for part in FOCAL_LENGTHS]
    return [kind(fx_px=length, fy_px=length, **fields) for length in lengths]


def _places(port: Window, free: tuple[str, ...]) -> list[Window]:
    """The port where it was given, and where else it may be."""
    if isinstance(port, FlatPort) and "port_distance" in free:
        return [replace(port, distance_m=port.distance_m * part) for part in DISTANCES]
    if isinstance(port, DomePort) and "port_centre_z" in free:
        centre = np.asarray(port.centre_m, dtype=np.float64)
        shifts = [centre + port.radius_m * np.array(shift) for shift in OFFSETS]
        return [replace(port, centre_m=tuple(each.tolist())) for each in shifts if np.linalg.norm(each) < port.radius_m]
    return [port]


def _best(seen: BoardObservations, prior: Prior, free: tuple[str, ...], cameras: Iterable[PortCamera]) -> Solution:
    """What fits best of several cameras, each refined a little, first in its focal length alone."""
    rough = tuple(name for name in CAMERA[:2] if name in free)
    found = [_refined(seen, prior, rough, camera, FEW_STEPS) for camera in cameras]
    ranked = sorted((each for each in found if each is not None), key=lambda each: each.cost)
    if not ranked:
        raise ValueError(
            f"camera {seen.cameras[0]}: found no pose for its boards with any focal length; check the order of "
            "the points"
        )
    finer = [
        Bundle(seen, [free], [prior]).solve(each.arrangement, noise_px=START_NOISE_PX, steps=MORE_STEPS)
        for each in ranked[:FINALISTS]
    ]
    return min(finer, key=lambda each: each.cost)


def _refined(
    seen: BoardObservations, prior: Prior, free: tuple[str, ...], camera: PortCamera, steps: int
) -> Solution | None:
    poses = board_poses(seen, camera)
    if poses is None:
        return None
    return Bundle(seen, [free], [prior]).solve(_alone(camera, poses), noise_px=START_NOISE_PX, steps=steps)


def _alone(camera: PortCamera, poses: RigidTransform) -> Arrangement:
    return Arrangement(cameras=(camera,), camera_from_rig=(RigidTransform.identity(),), rig_from_board=poses)


def board_poses(seen: BoardObservations, camera: PortCamera) -> RigidTransform | None:
    """Pose of every image's board by its rays, None when one has too few rays."""
    poses, places = [], seen.board_m[:, :2] if seen.is_flat else seen.places_m
    for image in range(len(seen.images)):
        chosen = seen.image == image
        origins, directions = in_medium(camera, MEDIA[seen.medium[chosen][0]]).rays(seen.pixels[chosen])
        usable = np.isfinite(directions).all(axis=1)
        if usable.sum() < (FEWEST_RAYS if seen.is_flat else FEWEST_RAYS_IN_SPACE):
            return None
        poses.append(pose_on_rays(places[chosen][usable], origins[usable], directions[usable]))
    return RigidTransform.concatenate(poses)


def _restarted(
    seen: BoardObservations, prior: Prior, free: tuple[str, ...], solved: Solution
) -> tuple[PortCamera, RigidTransform]:
    """The same with images placed once more that fit far worse than the others."""
    at = solved.arrangement
    rms = _image_rms(seen, Bundle(seen, [free], [prior]).residuals(at))
    poses = board_poses(seen, at.cameras[0])
    if poses is None or not (stray := rms > STRAY * np.median(rms)).any():
        return at.cameras[0], at.rig_from_board
    mixed = RigidTransform.from_matrix(
        np.where(stray[:, np.newaxis, np.newaxis], poses.as_matrix(), at.rig_from_board.as_matrix())
    )
    again = Bundle(seen, [free], [prior]).solve(_alone(at.cameras[0], mixed), noise_px=START_NOISE_PX, steps=MORE_STEPS)
    best = again.arrangement if again.cost < solved.cost else at
    return best.cameras[0], best.rig_from_board


def _image_rms(seen: BoardObservations, off_px: FloatArray) -> FloatArray:
    squares = np.where(np.isnan(off_px), np.inf, off_px**2).sum(axis=1)
    totals = np.bincount(seen.image, weights=squares, minlength=len(seen.images))
    return np.asarray(np.sqrt(totals / np.bincount(seen.image, minlength=len(seen.images))))


def _mean_pose(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Mean turn and median shift."""
    turn = Rotation.concatenate([pose.rotation for pose in poses]).mean()
    return RigidTransform.from_components(np.median([pose.translation for pose in poses], axis=0), turn)
