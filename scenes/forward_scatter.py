"""Blur by forward scattering: light of surfaces that water turns by less than about a degree arrives beside them.

The frame's kernel counts that light as unscattered, as the light field does: it keeps its strength and its direction.
Here it keeps its strength alone. `docs/explanation/forward_scatter.md` derives the blur and says what is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, nnls
from scipy.special import j0

from optics.kernels.arrays import FloatArray
from optics.status import Region
from optics.train import OpticalTrain
from optics.water.scattering import PhaseFunction
from rigs import Rig
from scenes.light.light import Light
from scenes.stage.frame import FloatImage, Frame

FARTHEST_M = 40.0
"""Behind more water than this, surfaces are blurred as behind this much: nothing is seen there."""

DISTANCES = 256
"""Steps of the distance, by its square root."""

OPEN_WATER = DISTANCES - 1
"""Step of what is as far off or farther."""

SMALLEST_KERNEL_PX = 0.5
"""What is narrower than that is not told from a sharp point."""

KERNEL_RATIO = 2.0
"""Of the widths of neighbouring kernels."""

REACH = 3.0
"""Standard deviations of the widest kernel within which open water counts as no farther off than what stands in it."""

COARSE_PX = 2.5
"""Standard deviation from which a kernel is applied to an image of half the size, and so on."""

BLOCK = 8
"""Regions are worked on in blocks of this number of pixels."""

FREQUENCIES = 200
RINGS = 2000


@dataclass(frozen=True, kw_only=True)
class Kernels:
    """Sum of Gaussians that stands for the blur of one water and one camera.

    Attributes
    ----------
    sigma_px : array, shape (k,)
        Standard deviation along each axis.
    part : array, shape (DISTANCES, k)
        Part of each in what is spread, by distance; rows sum to 1.
    root_share : float32 array, shape (DISTANCES,)
        Square root of the share of the light that is spread, by distance.
    tint : float32 array, shape (3,)
        How much the channels are blurred, over their mean.
    """

    sigma_px: FloatArray
    part: FloatArray
    root_share: FloatImage
    tint: FloatImage


def blurred(frame: Frame, light: Light, rig: Rig) -> FloatImage:
    """Radiance of a frame with the blur by forward scattering, shape (h, w, 3).

    Light is exchanged between the pixels of a region, by pairs: what one gains the other loses. Regions exchange none.
    """
    kernels = _kernels(light, rig, frame.radiance.shape[0], frame.radiance.shape[1])
    result = frame.radiance.copy()
    if not len(kernels.sigma_px):
        return result
    steps = _steps(frame.distance_m, kernels.sigma_px.max())
    for region in Region:
        mask = (frame.region == region).astype(np.uint8)
        left, top, width, height = cv2.boundingRect(mask)
        if region == Region.HOUSING or not width:
            continue
        # From whole blocks to whole blocks, so that nothing has to be padded.
        left, top, right, lower = left // BLOCK, top // BLOCK, -(-(left + width) // BLOCK), -(-(top + height) // BLOCK)
        box = np.s_[top * BLOCK : lower * BLOCK, left * BLOCK : right * BLOCK]
        result[box] += _gain(
            frame.radiance[box], np.ascontiguousarray(mask[box]), np.ascontiguousarray(steps[box]), kernels
        )
    return result


def _gain(radiance: FloatImage, mask: NDArray[np.uint8], steps: NDArray[np.uint8], kernels: Kernels) -> FloatImage:
    """What each pixel gains; zero outside the mask."""
    inside = mask.astype(np.float32)
    root = cv2.multiply(cv2.LUT(steps, kernels.root_share), inside)
    colours = cv2.split(radiance)
    sent = np.asarray(cv2.merge([*(cv2.multiply(colour, root) for colour in colours), root]), dtype=np.float32)
    around = np.zeros_like(sent)
    # The mix of the kernels hardly changes with distance: that of the region's mean step is taken, open water aside.
    mean_step = round(cv2.mean(steps, mask & (steps < OPEN_WATER))[0])
    for sigma, part in zip(kernels.sigma_px, kernels.part[mean_step], strict=True):
        if part > 0:
            around = np.asarray(cv2.scaleAdd(_smoothed(sent, float(sigma)), float(part), around), dtype=np.float32)
    # The last channel is how much of the region the kernels have found.
    *spread, found = cv2.split(around)
    gains = [
        cv2.multiply(root, cv2.subtract(arrived, cv2.multiply(colour, found)), scale=float(tint))
        for arrived, colour, tint in zip(spread, colours, kernels.tint, strict=True)
    ]
    return np.asarray(cv2.merge(gains))


def _smoothed(image: FloatImage, sigma_px: float) -> FloatImage:
    """Gaussian blur with nothing beyond the edges; wide ones at a fraction of the resolution."""
    halvings = max(0, int(np.ceil(np.log2(sigma_px / COARSE_PX))))
    if not halvings or min(image.shape[:2]) < 2 ** (halvings + 2):
        return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px, borderType=cv2.BORDER_CONSTANT))
    factor = 2**halvings
    height, width = image.shape[:2]
    below, beside = -height % factor, -width % factor
    padded = cv2.copyMakeBorder(image, 0, below, 0, beside, cv2.BORDER_CONSTANT) if below or beside else image
    small = cv2.resize(padded, None, fx=1 / factor, fy=1 / factor, interpolation=cv2.INTER_AREA)
    # Means of blocks and straight lines between them blur too: by the variance of a box and of a triangle.
    own = (factor**2 - 1) / 12 + (factor**2 - 1) / 6
    sigma = np.sqrt(sigma_px**2 - own) / factor
    small = cv2.GaussianBlur(small, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
    return np.asarray(cv2.resize(small, padded.shape[1::-1], interpolation=cv2.INTER_LINEAR)[:height, :width])


def _steps(distance_m: FloatImage, widest_px: float) -> NDArray[np.uint8]:
    """Distance as steps of its square root; open water is no farther off than what is in front of it nearby."""
    distance = np.minimum(distance_m, np.float32(FARTHEST_M))
    open_water = np.isinf(distance_m)
    if open_water.any():
        reach = 2 * int(np.ceil(REACH * widest_px)) + 1
        nearest = cv2.erode(distance, np.ones((reach, reach), dtype=np.uint8))
        distance = np.where(open_water, nearest, distance)
    return np.asarray(np.rint(cv2.sqrt(distance) * (OPEN_WATER / FARTHEST_M**0.5)).astype(np.uint8))


@lru_cache(maxsize=8)
def _kernels(light: Light, rig: Rig, height_px: int, width_px: int) -> Kernels:
    bands = light.bands
    by_channel = bands.weight @ (light.optics.scattering * light.field.forward_fraction)
    mean = float(by_channel.mean())
    pixel = pixel_angle(rig) * float(np.sqrt(rig.camera.width_px / width_px * rig.camera.height_px / height_px))
    # Pure water, whose molecules scatter everywhere alike, has no peak.
    edge = peak_edge(light) if mean > 0 else 0.0
    widest = edge / 2 / pixel
    if widest < SMALLEST_KERNEL_PX:
        none = np.zeros(DISTANCES, dtype=np.float32)
        return Kernels(
            sigma_px=np.empty(0), part=np.empty((DISTANCES, 0)), root_share=none, tint=np.ones(3, dtype=np.float32)
        )
    count = 1 + int(np.log(widest / SMALLEST_KERNEL_PX) / np.log(KERNEL_RATIO))
    sigma = np.asarray(edge / 2 / KERNEL_RATIO ** np.arange(count), dtype=np.float64)
    distance = np.asarray(FARTHEST_M * np.linspace(0, 1, DISTANCES) ** 2, dtype=np.float64)
    share = gaussian_shares(light.optics.phase, edge, sigma, mean * distance, finest=np.pi / pixel)
    total = share.sum(axis=1)
    # At no distance nothing is spread, and any mix will do.
    return Kernels(
        sigma_px=sigma / pixel,
        part=share / np.where(total > 0, total, 1)[:, np.newaxis],
        root_share=np.sqrt(total).astype(np.float32),
        tint=(by_channel / mean).astype(np.float32),
    )


def peak_edge(light: Light) -> float:
    """Angle within which the share of the light is scattered that counts as unscattered, radians."""
    # Of what particles scatter the share is the same at all wavelengths.
    where = light.optics.molecular_fraction.argmin()
    share = float(light.field.forward_fraction[where] / (1 - light.optics.molecular_fraction[where]))
    phase = light.optics.phase
    return float(np.exp(brentq(lambda a: float(phase.fraction_within(np.exp(a))) - share, np.log(1e-8), np.log(np.pi))))


def peak_rings(phase: PhaseFunction, edge: float) -> tuple[FloatArray, FloatArray]:
    """Angles within the peak, shape (RINGS,), and the share of the peak's light that is scattered by each."""
    borders = np.append(0, np.geomspace(edge * 1e-5, edge, RINGS))
    share = np.diff(phase.fraction_within(borders))
    return np.sqrt((borders[1:] ** 2 + borders[:-1] ** 2) / 2), np.asarray(share / share.sum())


def path_transform(phase: PhaseFunction, edge: float, frequency: FloatArray) -> FloatArray:
    """G: Hankel transform of the peak, averaged over where on the path the light is scattered; 1 at frequency zero.

    Light scattered at a fraction t of the path from the surface to the eye arrives t times as far off as it was turned
    (Wells 1973): ``G(q) = int_0^1 S(q t) dt``. Frequencies in radians per radian.
    """
    angle, share = peak_rings(phase, edge)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t, weight = (nodes + 1) / 2, weights / 2
    argument = np.multiply.outer(np.asarray(frequency), angle)
    return np.asarray(sum(w * (j0(x * argument) @ share) for x, w in zip(t, weight, strict=True)))


def gaussian_shares(
    phase: PhaseFunction, edge: float, sigma: FloatArray, optical_depth: FloatArray, finest: float
) -> FloatArray:
    """Shares of Gaussians whose sum has the transform ``exp(-tau (1 - G))``, up to a finest frequency; shape (n, k).

    What the shares leave of 1 is sharp. The fit is one of 1 - transform, with the same relative weight at all
    frequencies, so that the width is right.
    """
    frequency = np.geomspace(0.1 / edge, finest, FREQUENCIES)
    missing = 1 - path_transform(phase, edge, frequency)
    parts = -np.expm1(-0.5 * np.square(np.multiply.outer(frequency, sigma)))
    result = np.zeros((len(optical_depth), len(sigma)))
    for row, tau in zip(result, optical_depth, strict=True):
        wanted = -np.expm1(-tau * missing)
        if tau > 0:
            row[:] = nnls(parts / wanted[:, np.newaxis], np.ones(FREQUENCIES))[0]
    return result


@lru_cache(maxsize=8)
def pixel_angle(rig: Rig) -> float:
    """Angle in the water between neighbouring pixels of a rig's camera, radians: the median over the image."""
    bare = OpticalTrain.bare(rig)
    u, v = np.meshgrid(*(np.linspace(0.05, 0.95, 10) * size for size in (rig.camera.width_px, rig.camera.height_px)))
    middle = np.stack([u, v], axis=-1).reshape(-1, 2)
    right, left, lower, upper = (
        bare.trace(middle + step) for step in ((0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5))
    )
    open_ = np.all([rays.passed for rays in (right, left, lower, upper)], axis=0)
    solid = np.linalg.norm(np.cross(right.direction - left.direction, lower.direction - upper.direction), axis=1)
    return float(np.sqrt(np.median(solid[open_])))
