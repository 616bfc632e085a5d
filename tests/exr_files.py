"""What tests read of OpenEXR files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import another_thread, mi


def bitmap_of(path: Path) -> Any:
    """Pixels and metadata."""
    with another_thread():
        return mi.Bitmap(str(path))


def layers_of(path: Path) -> dict[str, FloatArray]:
    """Layers by name, each of shape (height, width)."""
    bitmap = bitmap_of(path)
    values = np.array(bitmap)
    return {field.name: values[..., place] for place, field in enumerate(bitmap.struct_())}
