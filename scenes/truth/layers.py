"""EXR layers of a frame: light and ground truth in one file, under the names that other programs read.

`R`, `G`, `B` and `Z` are OpenEXR's own names. `forward.u/v` and `backward.u/v` are Nuke's layers of motion vectors; one
number per pixel is `NAME.Y`, a luminance of its own layer, and vectors are `NAME.X/Y/Z` as Blender writes them. All are
single precision: half precision would hold distances beyond 2 m to 2 mm, and counts only up to 2048.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.exr import exr_bytes
from optics.status import Region
from rigs.atomic_files import write_bytes
from scenes.stage.frame import FloatImage, Label
from scenes.truth.ground_truth import GroundTruth
from scenes.truth.motion import Motion, Seen

UNITS = "R G B: W/(m^2 sr nm); Z distance position: m; normal: 1; forward backward: px, right and down; others: counts"


def layers(truth: GroundTruth) -> dict[str, FloatImage]:
    """Layers by channel name, each of shape (height, width); motion only where it was asked for."""
    frame, view = truth.frame, truth.view
    found: dict[str, NDArray[Any]] = {
        **_components("", "RGB", frame.radiance),
        "Z": view.z_depth_m,
        "distance.Z": frame.distance_m,
        **_components("position.", "XYZ", frame.point_m),
        **_components("normal.", "XYZ", frame.normal),
        **_components("normal_virtual.", "XYZ", view.normal),
        "label.Y": frame.label,
        "instance.Y": frame.instance,
        "region.Y": frame.region,
        "further_reflection.Y": view.further_reflection,
        "target.Y": frame.target_fraction,
    }
    for name, motion in (("forward", truth.forward), ("backward", truth.backward)):
        if motion is not None:
            found |= _motion(name, motion)
    return {name: np.asarray(values, dtype=np.float32) for name, values in found.items()}


def attributes(truth: GroundTruth) -> dict[str, Any]:
    """What the header says beside the layers: the camera, its poses, the joints, units and what numbers mean."""
    matrix = truth.camera_matrix
    numbers = {
        "q1_deg": float(np.degrees(truth.state.q1)),
        "q2_deg": float(np.degrees(truth.state.q2)),
        "time_s": float(truth.state.time_s),
        "fx_px": float(matrix[0, 0]),
        "fy_px": float(matrix[1, 1]),
        "cx_px": float(matrix[0, 2]),
        "cy_px": float(matrix[1, 2]),
    }
    texts = {
        "rig": truth.rig.name,
        "units": UNITS,
        "labels": _numbered(Label),
        "regions": _numbered(Region),
        "motion_status": _numbered(Seen),
    }
    poses = {f"world_from_virtual_{region.name.lower()}": pose for region, pose in truth.world_from_virtual().items()}
    return {**texts, **numbers, **poses}


def write_layers(truth: GroundTruth, path: Path, *, light: str = "full") -> None:
    """Write all layers as EXR; the file appears whole or not at all, and equal frames give equal bytes.

    `light`, draft or full, is said in the header.
    """
    if path.suffix.lower() != ".exr":
        raise ValueError(f"expected a file that ends in .exr, got {path.name!r}")
    write_bytes(path, layers_bytes(truth, light=light))


def layers_bytes(truth: GroundTruth, *, light: str = "full") -> bytes:
    """Content of the EXR file of all layers."""
    return exr_bytes(layers(truth), attributes(truth) | {"light": light})


def _components(prefix: str, names: str, image: FloatImage) -> dict[str, NDArray[Any]]:
    return {prefix + name: image[..., axis] for axis, name in enumerate(names)}


def _motion(name: str, motion: Motion) -> dict[str, NDArray[Any]]:
    return {f"{name}.u": motion.du_px, f"{name}.v": motion.dv_px, f"{name}_status.Y": motion.seen}


def _numbered(names: Any) -> str:
    return ", ".join(f"{int(each)} {each.name.lower()}" for each in names)
