"""The target by a learned model: a file of ONNX tells the odds of each cell of a crop, blobs are what is likely.

The core does not depend on it: onnxruntime, which runs the model, is an extra. How one is trained on a data set:
notebook 10.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tracking.perception.clusters import find_blobs, weighted_centroid
from tracking.perception.colour import RED_BALL, DetectorSettings, Mask
from tracking.perception.crop import check_image
from tracking.perception.outline import ellipse_share
from tracking.records import Blob, Detection

LEARNED = "onnx:"
"""Before a model's file where a detector is named."""

INPUT_AXES, OUTPUT_AXES = 4, 4
"""Image, channel, row, column."""


class LearnedModel:
    """A model that tells where in a crop the target is.

    It takes one image of any size, shape (1, 3, height, width), float32 from 0 to 1 as sRGB has it, and gives the
    natural logarithm of the odds that a cell shows the target, shape (1, 1, rows, columns); the cells share the
    crop evenly. It runs on one thread of the processor, so that equal crops give equal numbers.

    Parameters
    ----------
    file : str or Path
        Of ONNX.

    Raises
    ------
    ValueError
        For a file that is no such model, or without onnxruntime.
    FileNotFoundError
        When there is no such file.
    """

    def __init__(self, file: str | Path):
        try:
            import onnxruntime  # noqa: PLC0415  (an extra)
        except ImportError as error:
            raise ValueError(
                "a learned detector needs the package onnxruntime, which is not installed: "
                "pip install 'mirrorgaze[onnx]'"
            ) from error
        if not Path(file).is_file():
            raise FileNotFoundError(f"expected a model of ONNX, got no file {file}")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        try:
            self._session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime raises a class of its own for each way in which a file can be wrong
            raise ValueError(f"expected a model of ONNX in {file}, got: {_first_sentence(error)}") from error
        self._file = file
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        shapes = [[each.type, len(each.shape)] for each in (*inputs, *outputs)]
        if shapes != [["tensor(float)", INPUT_AXES], ["tensor(float)", OUTPUT_AXES]]:
            raise ValueError(
                f"expected one input and one output of four axes in {file}, float32 (image, channel, row, column), "
                f"got {', '.join(f'{each.name} {each.type} {each.shape}' for each in (*inputs, *outputs))}"
            )
        self._input = inputs[0].name
        # What a model cannot do with a crop is told before a dive begins.
        self.log_odds(np.zeros((240, 320, 3), dtype=np.uint8))

    def log_odds(self, crop: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Natural logarithm of the odds that a cell shows the target, shape (rows, columns).

        Parameters
        ----------
        crop : array, shape (height, width, 3)
            uint8 sRGB.

        Raises
        ------
        ValueError
            For anything but an image, or a model that gives no number for each cell.
        """
        check_image("crop", crop)
        image = np.ascontiguousarray(crop.transpose(2, 0, 1)[np.newaxis], dtype=np.float32) / 255
        try:
            (cells,) = self._session.run(None, {self._input: image})
        except Exception as error:
            raise ValueError(
                f"expected a model in {self._file} that takes images of shape {image.shape}, "
                f"got: {_first_sentence(error)}"
            ) from error
        if cells.shape[:2] != (1, 1) or not cells.size or not np.isfinite(cells).all():
            raise ValueError(
                f"expected finite log odds of shape (1, 1, rows, columns) from {self._file}, got shape {cells.shape}"
            )
        return np.asarray(cells[0, 0], dtype=np.float32)


def detect_by_model(
    crop: NDArray[np.uint8],
    model: LearnedModel,
    settings: DetectorSettings = RED_BALL,
    ignored: Mask | None = None,
) -> Detection:
    """Find what may be the target in a crop, the likeliest first.

    Parameters
    ----------
    crop : array, shape (height, width, 3)
        uint8 sRGB.
    model : LearnedModel
    settings : DetectorSettings
        Area, circularity and aspect that a blob must have.
    ignored : array, shape (height, width), optional
        uint8: pixels that are 255 are not the target.
    """
    cells = model.log_odds(crop)
    height, width = crop.shape[:2]
    odds = np.asarray(cv2.resize(cells, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.float32)
    likely = odds > 0 if ignored is None else (odds > 0) & (ignored == 0)
    mask = np.where(likely, np.uint8(255), np.uint8(0))
    found = (_weighed(blob, mask, odds) for blob in find_blobs(mask, settings))
    blobs = tuple(sorted(found, key=lambda each: -each.log_odds))
    return Detection(mask=mask, blobs=blobs, centroid_px=weighted_centroid(blobs))


def _weighed(blob: Blob, mask: Mask, odds: NDArray[np.float32]) -> Blob:
    """A blob with the mean log odds of its pixels, and how far it is an ellipse."""
    x, y, width, height = blob.box_px
    box = slice(y, y + height), slice(x, x + width)
    within = mask[box] > 0
    share = ellipse_share(cv2.moments(within.astype(np.uint8), binaryImage=True))
    return replace(blob, log_odds=float(odds[box][within].mean()), ellipse_share=share)


def _first_sentence(error: Exception) -> str:
    return " ".join(str(error).split()).split(". ")[0]
