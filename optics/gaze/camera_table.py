"""The camera of a rig as a table for programs of others: rays behind the port by pixel, and the mirrors as numbers.

What a pixel sees depends on the joints through the mirrors alone, and they are flat: two reflections are exact. So the
table has no grid of joint values and nothing is interpolated; `read_camera.py`, which is written beside it, does them
in NumPy for any joint values.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.gaze import read_camera
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, camera_pose
from optics.mirror_outline import Ellipse, Octagon, mirror_outline
from optics.train import OpticalTrain, pixel_grid
from rigs import FlatMirror, Joint, Rig
from rigs.atomic_files import atomic_file, write_bytes

READER = Path(read_camera.__file__)


def camera_table(rig: Rig, *, width_px: int | None = None, height_px: int | None = None) -> dict[str, NDArray[Any]]:
    """Table of a rig's camera; lengths in metres, angles in radians, body frame.

    Parameters
    ----------
    rig : Rig
    width_px, height_px : int, optional
        Size of the image, with the same field of view; the camera's own by default.

    Returns
    -------
    dict of str to array
        `origin_m`, `direction`: shape (height, width, 3), float32, where rays leave the port into the water and which
        way; `status`: uint8, 0 where one does, else `optics.Status`; `transmittance`: float32, of the port (Fresnel).
        Of a rig with mirrors also poses (`body_from_m1`, `body_from_gimbal`), outlines (`m1_outline`, `m2_outline`:
        half width, half height, largest abs(x) + abs(y), 1 for an ellipse) and joints (`pan`, `tilt`: sign, offset,
        lowest, highest value).
    """
    camera, body = rig.camera, camera_pose(rig.camera)
    columns, rows = width_px or camera.width_px, height_px or camera.height_px
    train = OpticalTrain.bare(rig)
    pixels = pixel_grid(train.camera, columns, rows)
    rays = train.trace(pixels)
    table: dict[str, NDArray[Any]] = {
        "origin_m": body.apply(rays.origin_m).reshape(rows, columns, 3).astype(np.float32),
        "direction": body.rotation.apply(rays.direction).reshape(rows, columns, 3).astype(np.float32),
        "status": rays.status.reshape(rows, columns).astype(np.uint8),
        "transmittance": train.transmittance(pixels).reshape(rows, columns).astype(np.float32),
    }
    return table if rig.gaze is None else table | _mirrors(rig)


def write_camera_table(
    rig: Rig, path: Path, *, width_px: int | None = None, height_px: int | None = None
) -> list[Path]:
    """Write the table as NPZ, and `read_camera.py` beside it; returns both."""
    if path.suffix.lower() != ".npz":
        raise ValueError(f"expected a file that ends in .npz, got {path.name!r}")
    table = camera_table(rig, width_px=width_px, height_px=height_px)
    with atomic_file(path) as partial:
        np.savez_compressed(partial, allow_pickle=False, **table)
    reader = path.with_name(READER.name)
    write_bytes(reader, READER.read_bytes())
    return [path, reader]


def _mirrors(rig: Rig) -> dict[str, NDArray[Any]]:
    layout, gaze = Layout.from_rig(rig), rig.require_gaze()
    return {
        "body_from_m1": layout.body_from_m1.as_matrix(),
        "body_from_gimbal": layout.body_from_gimbal.as_matrix(),
        "m1_outline": _outline(gaze.fold_mirror),
        "m2_outline": _outline(gaze.gaze_mirror),
        "pan": _joint(layout.pan),
        "tilt": _joint(layout.tilt),
    }


def _outline(plate: FlatMirror) -> FloatArray:
    outline = mirror_outline(plate)
    half_width, half_height = plate.width_mm / 2000, plate.height_mm / 2000
    cut = outline.leg_m if isinstance(outline, Octagon) else 0.0
    return np.array(
        [half_width, half_height, half_width + half_height - cut, isinstance(outline, Ellipse)], dtype=float
    )


def _joint(joint: Joint) -> FloatArray:
    return np.array([joint.sign, np.radians(joint.offset_deg), *joint.limits])
