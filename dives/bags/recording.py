"""A finished dive as it lies in its folder: the log at once, the images one by one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from dives import Dive
from dives.files import DIVE_FILE, VIDEO_FILE
from dives.paths import body_pose
from dives.recorder import FRAMES
from optics.kernels.arrays import FloatArray
from rigs import Rig
from tracking.log import LOG, read_log

NUMBERS = (
    "time_s",
    *(f"q{joint}_{kind}_deg" for joint in (1, 2) for kind in ("true", "command", "estimated")),
    "true_azimuth_deg",
    "true_elevation_deg",
    "target_distance_m",
    "estimated_azimuth_deg",
    "estimated_elevation_deg",
    "centroid_x_px",
    "centroid_y_px",
)
"""Columns of the log that a bag takes."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A finished dive.

    Attributes
    ----------
    folder : Path
    dive : Dive
    log : pyarrow.Table
        One row an image.
    size_px : (width, height)
        Of the images, as the rig's camera takes them.
    """

    folder: Path
    dive: Dive
    log: pa.Table
    size_px: tuple[int, int]

    @classmethod
    def open(cls, folder: Path, rig: Rig) -> Recording:
        """Look at a dive's folder; `ValueError` with everything that is missing in it or of another kind."""
        _check_files(folder)
        log = read_log(folder)
        wrong = [f"column {name}" for name in (*NUMBERS, "mode") if name not in log.column_names]
        if wrong or log.num_rows == 0:
            what = ", ".join(wrong) if wrong else "a single row"
            raise ValueError(f"{folder / LOG}: expected the log of a dive, got a table without {what}")
        size = (rig.camera.width_px, rig.camera.height_px)
        return cls(folder=folder, dive=Dive.load(folder / DIVE_FILE), log=log, size_px=size)

    def number(self, column: str) -> FloatArray:
        """One column of the log, shape (n,); nan where it holds nothing."""
        return np.asarray(self.log[column].cast(pa.float64()).fill_null(np.nan).to_numpy())

    def joints_rad(self, kind: str) -> FloatArray:
        """Pan and tilt, `true`, `command` or `estimated`, shape (n, 2)."""
        return np.radians(np.stack([self.number(f"q{joint}_{kind}_deg") for joint in (1, 2)], axis=1))

    def directions(self, kind: str) -> FloatArray:
        """Unit vectors to the target in the body's frame, `true` or `estimated`, shape (n, 3); nan where not known."""
        azimuth, elevation = (np.radians(self.number(f"{kind}_{angle}_deg")) for angle in ("azimuth", "elevation"))
        level = np.cos(elevation)
        return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)

    def modes(self) -> list[str]:
        """State of the loop at each image."""
        return [str(mode) for mode in self.log["mode"].to_pylist()]

    def body_poses(self) -> RigidTransform:
        """Poses of the vehicle in the world, one for each image, by the motion that the dive's file states."""
        return body_pose(self.dive, self.number("time_s"))

    def images(self) -> Iterator[NDArray[np.uint8]]:
        """Images one after the other, shape (height, width, 3), uint8 sRGB: never all of them at once.

        Raises
        ------
        ValueError
            When there are fewer or more than the log has rows, when one cannot be read, or is of another size.
        """
        path = _images_path(self.folder)
        assert path is not None  # `open` has seen it
        expected, count = self.log.num_rows, 0
        width, height = self.size_px
        # H.264 knows even sizes only: an odd image got another row or column.
        sizes = {(width, height), (width + width % 2, height + height % 2)}
        for image in _decoded(path):
            if image.shape[1::-1] not in sizes:
                got = "{} x {} px".format(*image.shape[1::-1])
                raise ValueError(f"{path}: expected images of {width} x {height} px, the rig's camera's, got {got}")
            count = count + 1
            if count > expected:
                break
            yield image[:height, :width]
        if count != expected:
            got = "more" if count > expected else f"{count}: it is cut short"
            raise ValueError(f"{path}: expected {expected} images, one for each row of the log, got {got}")


def dive_rig(folder: Path) -> Rig:
    """Rig of a finished dive, as its file states it; raises what `Recording.open` and `Dive.load` raise."""
    _check_files(folder)
    return Dive.load(folder / DIVE_FILE).load_rig()


def _check_files(folder: Path) -> None:
    """Raise a `ValueError` that names every file that is missing."""
    missing = [name for name in (DIVE_FILE, LOG) if not (folder / name).is_file()]
    if _images_path(folder) is None:
        missing.append(f"{VIDEO_FILE} or {FRAMES}/: a bag holds the images")
    if missing:
        without = ", without ".join(missing)
        raise ValueError(f"{folder}: expected the folder of a finished dive, got one without {without}")


def _images_path(folder: Path) -> Path | None:
    """Video or folder of frames; None when there is neither."""
    video, frames = folder / VIDEO_FILE, folder / FRAMES
    return video if video.is_file() else frames if frames.is_dir() else None


def _decoded(path: Path) -> Iterator[NDArray[np.uint8]]:
    if path.is_dir():
        for file in sorted(path.glob("*.png")):
            frame = cv2.imread(str(file), cv2.IMREAD_COLOR_RGB)
            if frame is None:
                raise ValueError(f"{file}: expected an image, got a file that cannot be read as one")
            yield np.asarray(frame, dtype=np.uint8)
        return
    try:
        with av.open(path) as container:
            for frame in container.decode(video=0):
                yield frame.to_ndarray(format="rgb24")
    except (av.error.FFmpegError, IndexError) as error:
        raise ValueError(f"{path}: expected a video, got one that cannot be read to its end ({error})") from None
