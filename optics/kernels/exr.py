"""OpenEXR files of any number of layers, in single precision, with numbers and poses in the header."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.backend import another_thread, mi


def exr_bytes(layers: Mapping[str, NDArray[Any]], attributes: Mapping[str, Any]) -> bytes:
    """Content of an EXR file; equal layers give equal bytes.

    Parameters
    ----------
    layers : mapping
        Of channels' names to arrays of shape (height, width).
    attributes : mapping
        Of names to numbers, texts, and poses, arrays of shape (4, 4).
    """
    pixels = np.stack([np.asarray(values, dtype=np.float32) for values in layers.values()], axis=-1)
    bitmap = mi.Bitmap(pixels, channel_names=list(layers))
    header = bitmap.metadata()
    for name, value in attributes.items():
        header[name] = mi.ScalarTransform4f(value) if isinstance(value, np.ndarray) else value
    # Through memory: where a file cannot be written Mitsuba raises no OSError.
    stream = mi.MemoryStream()
    with another_thread():
        bitmap.write(stream, mi.Bitmap.FileFormat.OpenEXR)
    content: bytes = stream.raw_buffer()
    return content
