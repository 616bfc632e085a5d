"""A rendered frame: radiance and ground truth per pixel."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.srgb import srgb_encode
from optics.status import Region

FloatImage = NDArray[np.float32]

FARTHEST_M = 1e5
"""What is farther away is open water."""


class Label(IntEnum):
    """What a pixel shows, through port and mirrors."""

    HOUSING = 0
    OPEN_WATER = 1
    SURFACE = 2
    """The sea surface from below, where light passes through it."""
    WORLD = 3
    TARGET = 4
    HULL = 5
    MOUNT = 6
    SERVO = 7
    MIRROR_BACK = 8
    MIRROR = 9
    """A mirror at the end of a long chain of reflections, where the renderer stops."""
    SNOW = 10
    DECOY = 11


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One image; arrays of shape (height, width), with a last axis where said.

    Attributes
    ----------
    radiance : float32, (..., 3)
        In front of the lens, W / (m^2 sr nm), averaged over each channel's band.
    distance_m : float32
        Along the ray from the port's outer face to what is seen, through all mirrors; inf for open water.
    point_m : float32, (..., 3)
        What is seen, world frame; nan for open water and for pixels that see no water.
    normal : float32, (..., 3)
        Unit normal of the seen face towards the ray, world frame; zero where there is no point.
    label, region : uint8
        `Label` and `optics.status.Region` at the pixel's first sample.
    instance : int32
        Position in the renderer's `instance_names` of the part, thing or creature that is seen; -1 for none.
    target_fraction : float32
        Fraction of the pixel's samples that show the target.
    """

    radiance: FloatImage
    distance_m: FloatImage
    point_m: FloatImage
    normal: FloatImage
    label: NDArray[np.uint8]
    region: NDArray[np.uint8]
    instance: NDArray[np.int32]
    target_fraction: FloatImage

    def _repr_png_(self) -> bytes:
        """The radiance as an sRGB image, exposed for its brightest percent, without white balance."""
        white = max(float(np.percentile(self.radiance, 99)), float(np.finfo(np.float32).tiny))
        image = np.round(srgb_encode(np.clip(self.radiance / white, 0, 1)) * 255).astype(np.uint8)
        import cv2  # noqa: PLC0415  (only notebooks show a frame like this)

        encoded: bytes = cv2.imencode(".png", image[..., ::-1])[1].tobytes()
        return encoded

    def region_counts(self) -> dict[str, int]:
        """Pixels of each region, by name in lower case."""
        return {region.name.lower(): int((self.region == region).sum()) for region in Region}

    def target_centroid_px(self) -> tuple[float, float] | None:
        """Centroid (u, v) of the target's pixels in the frame's own pixel grid, or None when it is not seen."""
        weight = self.target_fraction
        if weight.sum() == 0:
            return None
        v, u = np.indices(weight.shape)
        total = float(weight.sum())
        return float((u * weight).sum()) / total, float((v * weight).sum()) / total


@dataclass(frozen=True, kw_only=True)
class TruthArrays:
    """What kernels know of what is seen, as Dr.Jit arrays, ray by ray; see `Frame`.

    Infinity is a large number here, and instances are counted from one, with zero for none.
    """

    distance: Any
    point: Any
    normal: Any
    region: Any
    instance: Any


@dataclass(frozen=True, kw_only=True)
class FrameArrays:
    """What the kernel of a frame returns, as Dr.Jit arrays, ray by ray: radiance by channel, label, and more."""

    rgb: list[Any]
    label: Any
    truth: TruthArrays | None = None


def frames_of(arrays: FrameArrays, count: int, shape: tuple[int, int], per_pixel: int) -> list[Frame]:
    """Frames of what a kernel returned with ground truth: frame by frame, row by row, sample by sample."""

    def samples(values: Any) -> NDArray[Any]:
        """As images, shape (frames, height, width, samples)."""
        return np.asarray(values.numpy()).reshape(count, *shape, per_pixel)

    def first(values: Any) -> NDArray[Any]:
        """What the first sample of each pixel sees."""
        return samples(values)[..., 0]

    truth = arrays.truth
    if truth is None:
        raise ValueError("expected arrays with ground truth, got radiance and label alone")
    radiance = np.stack([samples(channel).mean(axis=-1) for channel in arrays.rgb], axis=-1)
    share = (samples(arrays.label) == Label.TARGET).mean(axis=-1).astype(np.float32)
    point, normal = (np.stack([first(each) for each in vectors], axis=-1) for vectors in (truth.point, truth.normal))
    distance, instance = first(truth.distance), first(truth.instance).astype(np.int32) - 1
    label, region = (first(values).astype(np.uint8) for values in (arrays.label, truth.region))
    distance = np.where(distance < FARTHEST_M, distance, np.inf).astype(np.float32)
    point = np.where(np.isfinite(distance)[..., np.newaxis], point, np.nan).astype(np.float32)
    return [
        Frame(
            radiance=radiance[k],
            distance_m=distance[k],
            point_m=point[k],
            normal=normal[k],
            label=label[k],
            region=region[k],
            instance=instance[k],
            target_fraction=share[k],
        )
        for k in range(count)
    ]
