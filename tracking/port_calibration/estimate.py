"""Calibration of cameras behind ports from images of boards."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.camera import FisheyeCamera, PinholeCamera
from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import CAMERA, DISTORTION, PORT_CENTRE
from optics.perturbation.port_camera import TILTS, Lens, PortCamera, Window
from optics.ports.port import DomePort, FlatPort, NoPort
from tracking.port_calibration.bundle import OUTLIER, POSE, Arrangement, Bundle, Solution, robust_cost, standard_noise
from tracking.port_calibration.covariance import PortCovariance, covariance_of, plausible_sizes
from tracking.port_calibration.observations import MEDIA, BoardObservations, observation_problems
from tracking.port_calibration.pinhole_fit import fit_pinhole
from tracking.port_calibration.start import camera_prior, start_camera, start_rig

LENSES = {
    "pinhole": ("pinhole", ()),
    "brown4": ("pinhole", DISTORTION["pinhole"][:4]),
    "brown": ("pinhole", DISTORTION["pinhole"][:5]),
    "rational": ("pinhole", DISTORTION["pinhole"]),
    "fisheye": ("fisheye", DISTORTION["fisheye"]),
}
"""Of each lens that can be asked for: the camera's model, and the coefficients that are estimated."""

PORT_POSE = {"flat": ("port_distance", *TILTS), "dome": PORT_CENTRE, "none": ()}
"""What is estimated of a port unless more is asked for."""

ALSO = ("n_water", "n_port", "port_thickness", "port_radius")
"""What is known unless it is asked for."""

ROUNDS = 3
"""Adjustments, each with the noise that the one before left."""

SHORTEST_M = 1e-5
"""A port nearer than that to the pinhole is one whose distance the images do not tell."""

FEWEST_SHOWN = 0.5
"""Of the points: what shows fewer is no calibration."""

PARALLEL_DEG = 5.0
"""Boards that are turned against each other by less say nothing of focal length and distance apart."""


@dataclass(frozen=True, kw_only=True)
class PinholeComparison:
    """A plain pinhole beside the port's model on the images in water of one camera; root mean squares a point.

    `fits_as_well`: by the Bayesian information criterion (Schwarz, Annals of Statistics 6, 461, 1978).
    """

    camera: str
    lens: Lens
    rms_px: float
    rms_with_port_px: float
    fits_as_well: bool


@dataclass(frozen=True, kw_only=True)
class PortCalibration:
    """What a calibration found.

    Attributes
    ----------
    observations : BoardObservations
    arrangement : Arrangement
        Cameras with their ports, their poses, and the boards'.
    covariance : PortCovariance
    noise_px : float
        Standard deviation of a pixel's u or v, by the residuals without outliers.
    off_px : array, shape (n, 2)
        Predicted less observed.
    converged : bool
    warnings : tuple of str
    pinholes : tuple of PinholeComparison
        One for each camera with images in water.
    """

    observations: BoardObservations
    arrangement: Arrangement
    covariance: PortCovariance
    noise_px: float
    off_px: FloatArray
    converged: bool
    warnings: tuple[str, ...]
    pinholes: tuple[PinholeComparison, ...]

    @property
    def cameras(self) -> dict[str, PortCamera]:
        """Cameras with their ports by name."""
        return dict(zip(self.observations.cameras, self.arrangement.cameras, strict=True))

    @property
    def rms_px(self) -> float:
        """Root mean square of the distance in the image, outliers and all, as OpenCV reports it."""
        return root_mean_square(self.off_px)

    @property
    def median_px(self) -> float:
        """Median distance in the image."""
        return float(np.median(np.linalg.norm(self.off_px[np.isfinite(self.off_px).all(axis=1)], axis=1)))

    @property
    def outlier_count(self) -> int:
        """Points that are further off than `OUTLIER` standard deviations, or not shown at all."""
        return int((~(np.abs(self.off_px) < OUTLIER * self.noise_px).all(axis=1)).sum())


def calibrate_port(
    seen: BoardObservations,
    *,
    ports: Window | Sequence[Window],
    lens: str = "brown",
    intrinsics: Sequence[Lens] | None = None,
    keep_intrinsics: bool = False,
    also: Iterable[str] = (),
    keep: Iterable[str] = (),
) -> PortCalibration:
    """Calibrate cameras behind ports.

    Parameters
    ----------
    seen : BoardObservations
    ports : FlatPort, DomePort or NoPort, or one for each camera
        Thickness, indices and radius as they are known; where the port is, as a start.
    lens : str
        Of `LENSES`.
    intrinsics : sequence of PinholeCamera or FisheyeCamera, optional
        Of each camera, to begin with.
    keep_intrinsics : bool
        Whether they are kept as they were given.
    also : iterable of str
        Of `ALSO`: estimated besides.
    keep : iterable of str
        Parameters that keep their value.

    Raises
    ------
    ValueError
        With everything that is wrong with the observations, one problem a line.
    """
    also, keep = tuple(also), tuple(keep)
    given = [ports] * len(seen.cameras) if isinstance(ports, FlatPort | DomePort | NoPort) else list(ports)
    problems = observation_problems(seen, known_intrinsics=keep_intrinsics)
    problems += _option_problems(seen, given, lens=lens, also=also, keep=keep)
    problems += _intrinsics_problems(seen, intrinsics, lens=lens, keep=keep_intrinsics)
    if problems:
        raise ValueError("\n".join(problems))
    model, _ = LENSES[lens]
    free = [_free(port, lens, also, keep, keep_intrinsics=keep_intrinsics) for port in given]
    lenses = list(intrinsics) if intrinsics else [None] * len(given)
    alone, prior = [], []
    for index, (names, port, guess) in enumerate(zip(free, given, lenses, strict=True)):
        own = seen.of_camera(index)
        camera, poses = _started(own, names, model, port, guess)
        alone.append((camera, dict(zip(own.images, poses, strict=True))))
        prior.append(camera_prior(own, names, model, port, guess))
    bundle = Bundle(seen, free, prior)
    solution, noise_px = adjusted(bundle, start_rig(seen, alone))
    _check_shown(bundle.residuals(solution.arrangement))
    return _result(bundle, solution, noise_px, lens)


def _started(
    own: BoardObservations, names: tuple[str, ...], model: str, port: Window, guess: Lens | None
) -> tuple[PortCamera, RigidTransform]:
    try:
        return start_camera(own, names, model, port, guess)
    except np.linalg.LinAlgError:
        raise ValueError(
            f"camera {own.cameras[0]}: found no pose for its boards; check their points and the port"
        ) from None


def _check_shown(off_px: FloatArray) -> None:
    shown = int(np.isfinite(off_px).all(axis=1).sum())
    if shown < FEWEST_SHOWN * len(off_px):
        raise ValueError(
            f"no camera behind this port shows the points: {shown} of {len(off_px)} are seen where the search ended; "
            "check the port, its unit, and the order of the points"
        )


def adjusted(bundle: Bundle, start: Arrangement) -> tuple[Solution, float]:
    """Solution from a start, and the noise it leaves: each round takes the noise that the one before left."""
    at = start
    for _ in range(ROUNDS):
        noise_px = standard_noise(bundle.residuals(at))
        solution = bundle.solve(at, noise_px=noise_px)
        at = solution.arrangement
    off_px = bundle.residuals(at)
    # Residuals are smaller than the noise by what the unknowns took up of it.
    unknowns = len(bundle.names) + POSE * len(bundle.seen.images)
    return solution, standard_noise(off_px) * float(np.sqrt(off_px.size / max(off_px.size - unknowns, 1)))


def root_mean_square(off_px: FloatArray) -> float:
    """Of the distances of points that have one."""
    squares = (off_px[np.isfinite(off_px).all(axis=1)] ** 2).sum(axis=1)
    return float(np.sqrt(squares.mean()))


def _free(
    port: Window, lens: str, also: tuple[str, ...], keep: tuple[str, ...], *, keep_intrinsics: bool
) -> tuple[str, ...]:
    shape = {FlatPort: "flat", DomePort: "dome", NoPort: "none"}[type(port)]
    of_lens = () if keep_intrinsics else (*CAMERA, *LENSES[lens][1])
    asked = tuple(name for name in also if shape != "none" and not (name == "port_radius" and shape == "flat"))
    return tuple(name for name in (*of_lens, *PORT_POSE[shape], *asked) if name not in keep)


def _option_problems(
    seen: BoardObservations,
    ports: list[Window],
    *,
    lens: str,
    also: tuple[str, ...],
    keep: tuple[str, ...],
) -> list[str]:
    problems = []
    if len(ports) != len(seen.cameras):
        problems.append(f"expected one port or one for each of {len(seen.cameras)} cameras, got {len(ports)}")
    if lens not in LENSES:
        problems.append(f"expected a lens of {', '.join(LENSES)}, got {lens!r}")
    problems += [
        f"expected to estimate one of {', '.join(ALSO)} besides, got {name!r}" for name in also if name not in ALSO
    ]
    known = {*CAMERA, *DISTORTION["pinhole"], *(name for names in PORT_POSE.values() for name in names)}
    problems += [
        f"expected to keep one of {', '.join(sorted(known))}, got {name!r}" for name in keep if name not in known
    ]
    if (~(seen.medium == MEDIA.index("bare"))).sum() == 0 and any(not isinstance(port, NoPort) for port in ports):
        problems.append("expected images through the port, in water or in air, got only images without it")
    return problems


def _intrinsics_problems(
    seen: BoardObservations, intrinsics: Sequence[Lens] | None, *, lens: str, keep: bool
) -> list[str]:
    problems = []
    if intrinsics is not None and len(intrinsics) != len(seen.cameras):
        problems.append(f"expected intrinsics of {len(seen.cameras)} cameras, got {len(intrinsics)}")
    if keep and intrinsics is None:
        problems.append("expected intrinsics to keep, got none")
    for name, size, camera in zip(seen.cameras, seen.sizes_px, intrinsics or (), strict=False):
        if (camera.width_px, camera.height_px) != size:
            problems.append(
                f"camera {name}: its intrinsics are of images of {camera.width_px} x {camera.height_px} pixels, "
                f"but its images have {size[0]} x {size[1]}"
            )
        wanted = FisheyeCamera if lens == "fisheye" else PinholeCamera
        if lens in LENSES and not isinstance(camera, wanted):
            problems.append(f"camera {name}: expected intrinsics of a {LENSES[lens][0]}, got {type(camera).__name__}")
    return problems


def _result(bundle: Bundle, solution: Solution, noise_px: float, lens: str) -> PortCalibration:
    seen, at = bundle.seen, solution.arrangement
    cameras = dict(zip(seen.cameras, at.cameras, strict=True))
    distance_m = float(np.median(np.linalg.norm(at.rig_from_board.translation, axis=1)))
    sizes = plausible_sizes(bundle.names, cameras, distance_m)
    covariance = covariance_of(bundle.names, bundle.information(at, noise_px), bundle.prior_at(at)[1], sizes)
    off_px = bundle.residuals(at)
    return PortCalibration(
        observations=seen,
        arrangement=at,
        covariance=covariance,
        noise_px=noise_px,
        off_px=off_px,
        converged=solution.converged,
        warnings=_warnings(at, cameras),
        pinholes=tuple(_pinholes(bundle, at, off_px, noise_px, lens)),
    )


def _warnings(at: Arrangement, cameras: dict[str, PortCamera]) -> tuple[str, ...]:
    warnings = []
    normals = at.rig_from_board.rotation.as_matrix()[:, :, 2]
    mean = normals.mean(axis=0)
    largest = float(np.degrees(np.arccos(np.clip(normals @ mean / np.linalg.norm(mean), -1, 1))).max())
    if largest < PARALLEL_DEG:
        warnings.append(
            f"all boards are parallel within {largest:.1f} degrees: focal length, port and distances can hardly be "
            "told apart; tilt the board by 20 degrees and more in different ways"
        )
    for name, camera in cameras.items():
        if isinstance(camera.port, FlatPort) and camera.port.distance_m < SHORTEST_M:
            warnings.append(f"camera {name}: the port's distance went to zero; keep it at a measured value")
    return tuple(warnings)


def _pinholes(
    bundle: Bundle, at: Arrangement, off_px: FloatArray, noise_px: float, lens: str
) -> Iterable[PinholeComparison]:
    model, terms = LENSES[lens]
    seen, water = bundle.seen, MEDIA.index("water")
    for index, name in enumerate(seen.cameras):
        rows = (seen.camera == index) & (seen.medium == water)
        own = seen.rows(rows).of_camera(index) if rows.any() else None
        if own is None or isinstance(at.cameras[index].port, NoPort) or observation_problems(own):
            continue
        free = (*CAMERA, *(terms or LENSES["brown"][1]))
        # What comes closest to the camera and its port is where the search begins.
        far = float(np.median(np.linalg.norm(at.rig_from_board.translation, axis=1)))
        near = fit_pinhole(at.cameras[index], [far], free[len(CAMERA) :]).lens
        start, poses = start_camera(own, free, model, NoPort(), near)
        alone = Bundle(own, [free], [camera_prior(own, free, model, NoPort(), near)])
        single = start_rig(own, [(start, dict(zip(own.images, poses, strict=True)))])
        solution = alone.solve(adjusted(alone, single)[0].arrangement, noise_px=noise_px)
        plain_px = alone.residuals(solution.arrangement)
        costs = [robust_cost(each, noise_px) for each in (plain_px, off_px[rows])]
        counts = [len(free), len(bundle.free[index])]
        criteria = [cost + count * np.log(plain_px.size) for cost, count in zip(costs, counts, strict=True)]
        yield PinholeComparison(
            camera=name,
            lens=solution.arrangement.cameras[0].camera,
            rms_px=root_mean_square(plain_px),
            rms_with_port_px=root_mean_square(off_px[rows]),
            fits_as_well=bool(criteria[0] <= criteria[1]),
        )
