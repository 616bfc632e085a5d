"""What a pinhole calibrated through a port turns out to be: table 1 of the paper, and why it is no index.

A checkerboard is imaged exactly, with no rendering, in several media and calibrated with several models. The paper is
Cortes-Perez & Torres-Mendez 2021; formulas and what is found are in `docs/explanation/ports.md`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from optics.camera import Camera, PinholeCamera, camera_from_spec
from optics.kernels.arrays import FloatArray, unit
from optics.ports.port import GEOMETRY_WAVELENGTH_NM, FlatPort, NoPort, Port, port_from_spec
from optics.status import Status
from optics.train import OpticalTrain
from optics.water.water import water_index
from reports.studies.calibration_board import BOARDS, Board
from rigs import Rig

FEWEST_CORNERS = 12
"""Of a view that is used: 24 numbers for its 6 of pose and its share of the camera's 9."""

FEWEST_VIEWS = 5

FULL_DISC_PX = 870.0
"""Radius at which a pinhole without radial terms has the focal length of table 1."""

SALINITY_PPT = 30.0
"""Of the paper's salt water (its section 3.1.1)."""

REFINEMENTS = 200
"""Steps of OpenCV's Levenberg-Marquardt; it settles in about 20."""


class Medium(StrEnum):
    """What the board is in; the values are the rows of the paper's table 1."""

    AIR = "air"
    DISTILLED = "distilled water"
    SALT = "salt water"


class Model(StrEnum):
    """What is fitted."""

    KNOWN_POSES = "pinhole, poses known"
    PINHOLE = "pinhole"
    TWO_RADIAL = "k1 k2"
    FIVE_TERMS = "k1 k2 p1 p2 k3"


PAPER_TABLE_1 = {
    Medium.AIR: (476.42, 475.98, 960.68, 744.18),
    Medium.DISTILLED: (876.80, 870.91, 927.34, 756.74),
    Medium.SALT: (879.63, 871.17, 926.43, 758.05),
}
"""fx, fy, cx, cy of the paper's Cam 1, pixels."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Corners of the board in one pose, and their image.

    Attributes
    ----------
    on_board_m : array, shape (n, 3)
        The board's own frame, z = 0.
    in_camera_m : array, shape (n, 3)
        Camera frame; what only `Model.KNOWN_POSES` is given.
    pixels : array, shape (n, 2)
    """

    on_board_m: FloatArray
    in_camera_m: FloatArray
    pixels: FloatArray


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A fitted camera; `distortion` is OpenCV's (k1, k2, p1, p2, k3), `ratio` its fx over the camera's in air."""

    medium: Medium
    model: Model
    radius_px: float
    corner_count: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...]
    rms_px: float
    ratio: float


@dataclass(frozen=True, kw_only=True)
class Disc:
    """Calibrations in distilled water with the corners within a disc, and `even_disc_ratio` of it."""

    even_disc_ratio: float | None
    calibrations: list[Calibration]


def calibration_study(
    rig: Rig,
    *,
    board: Board = BOARDS["large"],
    radius_px: float = FULL_DISC_PX,
    noise_px: float = 0.0,
    seed: int = 0,
    media: Sequence[Medium] = tuple(Medium),
) -> list[Calibration]:
    """Calibrate the camera of a rig behind its port in every medium with every model.

    Parameters
    ----------
    rig : Rig
        Its camera, port and water temperature; mirrors are left out.
    board : Board
    radius_px : float
        Corners further from the principal point are left out.
    noise_px : float
        Standard deviation of the corners' normal errors, in u and in v.
    seed : int
    media : sequence of Medium

    Raises
    ------
    ValueError
        For a rig without a port, or when too few corners lie in the disc.
    """
    if not radius_px > 0:
        raise ValueError(f"expected radius_px > 0, got {radius_px!r}")
    if not (np.isfinite(noise_px) and noise_px >= 0):
        raise ValueError(f"expected noise_px >= 0, got {noise_px!r}")
    camera = camera_from_spec(rig.camera)
    found = []
    for medium in media:
        # The same errors in every medium: what differs is the medium's.
        rng = np.random.default_rng(seed)
        train = OpticalTrain(camera=camera, port=port_in(rig, medium))
        views = checkerboard_views(train, board, radius_px=radius_px, noise_px=noise_px, rng=rng)
        found += [calibrate(views, camera, model, medium=medium, radius_px=radius_px) for model in Model]
    return found


def disc_study(
    rig: Rig, radii_px: Sequence[float], *, board: Board = BOARDS["large"], noise_px: float = 0.0, seed: int = 0
) -> list[Disc]:
    """Calibrate in distilled water with the corners within discs of these radii, as `calibration_study` does."""
    return [
        Disc(
            even_disc_ratio=even_disc_ratio(rig, Medium.DISTILLED, radius_px),
            calibrations=calibration_study(
                rig, board=board, radius_px=radius_px, noise_px=noise_px, seed=seed, media=[Medium.DISTILLED]
            ),
        )
        for radius_px in radii_px
    ]


def port_in(rig: Rig, medium: Medium) -> Port:
    """Port of a rig with air, distilled or salt water (30 ppt) of the rig's temperature outside."""
    port = port_from_spec(rig.port, rig.water)
    if isinstance(port, NoPort):
        raise ValueError(f"expected a rig with a port to calibrate through, got {rig.name!r}, which has none")
    if medium == Medium.AIR:
        return replace(port, n_water=port.n_inside)  # type: ignore[type-var]
    salinity = SALINITY_PPT if medium == Medium.SALT else 0.0
    index = float(water_index(GEOMETRY_WAVELENGTH_NM, salinity, rig.water.temperature_celsius))
    return replace(port, n_water=index)  # type: ignore[type-var]


def checkerboard_views(
    train: OpticalTrain, board: Board, *, radius_px: float, noise_px: float, rng: np.random.Generator
) -> list[View]:
    """Exact images of the board's corners in all its poses, as far as they lie in the disc; noise is added last."""
    on_board = board.corners_m()
    principal = [train.camera.cx_px, train.camera.cy_px]
    views = []
    for corners in board.poses():
        image = train.project(corners)
        noise = noise_px * rng.standard_normal(image.pixels.shape)
        inside = np.linalg.norm(image.pixels - principal, axis=1) <= radius_px
        kept = inside & (image.status == Status.OK)
        if kept.sum() >= FEWEST_CORNERS:
            pixels = (image.pixels + noise)[kept]
            views.append(View(on_board_m=on_board[kept], in_camera_m=corners[kept], pixels=pixels))
    if len(views) < FEWEST_VIEWS:
        raise ValueError(
            f"expected at least {FEWEST_VIEWS} views with {FEWEST_CORNERS} corners within radius_px, "
            f"got {len(views)} with radius_px = {radius_px!r}"
        )
    return views


def calibrate(views: Sequence[View], camera: Camera, model: Model, *, medium: Medium, radius_px: float) -> Calibration:
    """Fit one model to the views."""
    fit = _fit_with_known_poses(views) if model == Model.KNOWN_POSES else _fit_with_opencv(views, camera, model)
    matrix, distortion, rms_px = fit
    return Calibration(
        medium=medium,
        model=model,
        radius_px=radius_px,
        corner_count=sum(len(view.pixels) for view in views),
        fx_px=float(matrix[0, 0]),
        fy_px=float(matrix[1, 1]),
        cx_px=float(matrix[0, 2]),
        cy_px=float(matrix[1, 2]),
        distortion=tuple(float(value) for value in distortion),
        rms_px=rms_px,
        ratio=float(matrix[0, 0]) / camera.fx_px,
    )


def _fit_with_known_poses(views: Sequence[View]) -> tuple[FloatArray, FloatArray, float]:
    """Least squares for fx, cx and fy, cy with the corners' places known: u = fx x / z + cx is linear in them."""
    points = np.concatenate([view.in_camera_m for view in views])
    pixels = np.concatenate([view.pixels for view in views])
    matrix = np.eye(3)
    squares = 0.0
    for axis in range(2):
        slopes = np.stack([points[:, axis] / points[:, 2], np.ones(len(points))], axis=1)
        solution = np.linalg.lstsq(slopes, pixels[:, axis])[0]
        matrix[axis, axis], matrix[axis, 2] = solution
        squares += float(np.sum((slopes @ solution - pixels[:, axis]) ** 2))
    return matrix, np.zeros(5), float(np.sqrt(squares / len(points)))


def _fit_with_opencv(views: Sequence[View], camera: Camera, model: Model) -> tuple[FloatArray, FloatArray, float]:
    """Zhang's calibration: the poses of the board are found along with the camera."""
    import cv2  # noqa: PLC0415  (0.2 s that other users of the module need not wait for)

    flags = {
        Model.PINHOLE: cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
        Model.TWO_RADIAL: cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
        Model.FIVE_TERMS: 0,
    }[model]
    rms_px, matrix, distortion, _, _ = cv2.calibrateCamera(
        [view.on_board_m.astype(np.float32) for view in views],
        [view.pixels.astype(np.float32) for view in views],
        (camera.width_px, camera.height_px),
        None,
        None,
        flags=flags,
        criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, REFINEMENTS, 1e-12),
    )
    return np.asarray(matrix, dtype=np.float64), np.asarray(distortion, dtype=np.float64).ravel(), float(rms_px)


def pinhole_ratio_on_disc(n_water: float, disc_radius: float) -> float:
    """Focal length of the best pinhole behind a flat port over the one in air, for distant points that fill a disc.

    Parameters
    ----------
    n_water : float
        Relative to the index inside.
    disc_radius : float
        Of the disc in the image, in focal lengths in air; the points fill its area evenly.

    Notes
    -----
    A point at r = f tan a in the image lies at the slope ``x / sqrt(n^2 + (n^2 - 1) x^2)`` in the water, x = r / f.
    Least squares give F / f = int x t x dx / int x t^2 dx, both in closed form with G = n^2 + (n^2 - 1) x^2. On the
    axis, F / f = n.
    """
    if not (n_water > 1 and disc_radius > 0):
        raise ValueError(f"expected n_water > 1 and disc_radius > 0, got {n_water!r} and {disc_radius!r}")
    below = n_water**2
    above = below + (below - 1) * disc_radius**2
    product_sum = 2 / 3 * (above**1.5 - below**1.5) - 2 * below * (above**0.5 - below**0.5)
    square_sum = above - below - below * np.log(above / below)
    return float(product_sum / square_sum)


def even_disc_ratio(rig: Rig, medium: Medium, radius_px: float) -> float | None:
    """`pinhole_ratio_on_disc` for a rig, None where it does not apply: other ports, tilt, distortion, no water."""
    camera, port = camera_from_spec(rig.camera), port_in(rig, medium)
    ideal = isinstance(camera, PinholeCamera) and not any(camera.distortion)
    straight = isinstance(port, FlatPort) and float(unit("normal", port.normal)[2]) == 1
    if not (ideal and straight and port.n_water > port.n_inside):
        return None
    return pinhole_ratio_on_disc(port.n_water / port.n_inside, radius_px / camera.fx_px)
