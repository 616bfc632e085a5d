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
from optics.kernels.exr import exr_bytes
from optics.layout import Layout, camera_pose
from optics.mirror_outline import Ellipse, Octagon, mirror_outline
from optics.train import OpticalTrain, pixel_grid
from rigs import FlatMirror, Joint, Rig
from rigs.atomic_files import atomic_file, write_bytes

READER = Path(read_camera.__file__)
SHADER = READER.with_suffix(".glsl")
"""What reads a table, and what reads it as EXR."""

JOINT_NUMBERS = ("sign", "offset_rad", "lowest_rad", "highest_rad")
OUTLINE_NUMBERS = ("half_width_m", "half_height_m", "largest_sum_m", "is_ellipse")
"""What the four numbers of a joint and of an outline are."""


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
    """Write the table and what reads it beside it; returns both.

    As NPZ with `read_camera.py`, or as EXR (`exr_table`) with the fragment shader `read_camera.glsl`.
    """
    suffix = path.suffix.lower()
    if suffix not in (".npz", ".exr"):
        raise ValueError(f"expected a file that ends in .npz or .exr, got {path.name!r}")
    table = camera_table(rig, width_px=width_px, height_px=height_px)
    if suffix == ".exr":
        write_bytes(path, exr_table(table))
    else:
        with atomic_file(path) as partial:
            np.savez_compressed(partial, allow_pickle=False, **table)
    source = SHADER if suffix == ".exr" else READER
    reader = path.with_name(source.name)
    write_bytes(reader, source.read_bytes())
    return [path, reader]


def exr_table(table: dict[str, NDArray[Any]]) -> bytes:
    """A table as EXR: `origin.X/Y/Z`, `direction.X/Y/Z`, `status.Y`, `transmittance.Y`; mirrors in the header."""
    layers = {
        f"{layer}.{axis}": table[name][..., place]
        for layer, name in (("origin", "origin_m"), ("direction", "direction"))
        for place, axis in enumerate("XYZ")
    }
    layers |= {f"{name}.Y": table[name] for name in ("status", "transmittance")}
    header: dict[str, Any] = {name: table[name] for name in ("body_from_m1", "body_from_gimbal") if name in table}
    for name, numbers in (
        ("m1_outline", OUTLINE_NUMBERS),
        ("m2_outline", OUTLINE_NUMBERS),
        ("pan", JOINT_NUMBERS),
        ("tilt", JOINT_NUMBERS),
    ):
        if name in table:
            header |= {f"{name}_{what}": float(value) for what, value in zip(numbers, table[name], strict=True)}
    return exr_bytes(layers, header)


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
