"""What can differ between a built rig and the nominal one: the parameters of the perturbed train, with their units.

A perturbation is added to the rig's own value; all zero is the nominal rig. Names read part, kind, axis: `_shift_`
moves a part along an axis of its own, `_turn_` turns it about one. The parts, from the camera outwards:

- camera: focal lengths, principal point, and distortion coefficients as OpenCV names and orders them;
- port: `port_distance` along a flat port's normal and `port_tilt_*`, that normal's turns about the camera's y and then
  its x, through the pinhole; `port_centre_*`, a dome's centre; `port_radius`, its inner one; and both indices;
- `fold_mirror_distance`, `gaze_mirror_distance`: those of the rig file, with all that is behind them;
- `m1_*`, `m2_*`: a mirror, turned about its own x, y and z (normal) through the centre of its face, then shifted
  along the turned axes;
- `gimbal_*`: the pan axis, shifted along the gimbal's axes, then turned about its x and y;
- `pan_offset`, `tilt_offset`: optical angles of the joints, in the gimbal's frame as `Layout.pan` and `Layout.tilt`;
- `tilt_axis_*`: shifted off the pan axis along the pan frame's x and z, then turned about its x: not square to it.

Two parameters say where a train looks and what at: the joint values `q1` and `q2`, and the point.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from rigs import Rig

Perturbations = Mapping[str, ArrayLike]
"""Some of the parameters of a rig by name, in `UNITS`; what is not named is nominal."""

POINT = ("point_x", "point_y", "point_z")
JOINTS = ("q1", "q2")
CAMERA = ("fx", "fy", "cx", "cy")
DISTORTION = {"pinhole": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), "fisheye": ("k1", "k2", "k3", "k4")}
"""A rig has as many of them as its file gives."""

PORT_CENTRE = ("port_centre_x", "port_centre_y", "port_centre_z")
PORT = {
    "flat": ("port_distance", "port_tilt_x", "port_tilt_y", "port_thickness", "n_port", "n_water"),
    "dome": (*PORT_CENTRE, "port_radius", "port_thickness", "n_port", "n_water"),
    "none": (),
}

JOINT_OFFSETS = ("pan_offset", "tilt_offset")
MIRRORS = (
    *("fold_mirror_distance", "gaze_mirror_distance", *JOINT_OFFSETS),
    *(f"{mirror}_{kind}_{axis}" for mirror in ("m1", "m2") for kind in ("shift", "turn") for axis in "xyz"),
    *("gimbal_shift_x", "gimbal_shift_y", "gimbal_shift_z", "gimbal_turn_x", "gimbal_turn_y"),
    *("tilt_axis_shift_x", "tilt_axis_shift_z", "tilt_axis_turn_x"),
)

UNITS = (
    dict.fromkeys((*POINT, *PORT["flat"], *PORT["dome"], *MIRRORS), "m")
    | dict.fromkeys((*JOINTS, *JOINT_OFFSETS, "port_tilt_x", "port_tilt_y"), "rad")
    | {name: "rad" for name in MIRRORS if "_turn_" in name}
    | dict.fromkeys(CAMERA, "px")
    | dict.fromkeys((*DISTORTION["pinhole"], "n_port", "n_water"), "")
)
"""Unit of every parameter."""

SHOWN = {"m": ("mm", 1000.0), "rad": ("deg", 180 / np.pi), "px": ("px", 1.0), "": ("", 1.0)}
"""Unit in which a parameter is shown and written, and how many of these the SI unit is."""


def rig_parameters(rig: Rig) -> tuple[str, ...]:
    """All that can be perturbed in a rig."""
    distortion = DISTORTION[rig.camera.model][: len(rig.camera.distortion)]
    return (*CAMERA, *distortion, *parameters_behind_the_lens(rig))


def parameters_behind_the_lens(rig: Rig) -> tuple[str, ...]:
    """Those of the port and the mirrors, on which the path of a given ray from the pinhole depends."""
    return (*PORT[rig.port.shape], *(MIRRORS if rig.gaze is not None else ()))


def check_parameters(names: Iterable[str], known: tuple[str, ...]) -> None:
    """Raise a `ValueError` that names every parameter that is not known."""
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"expected parameters among {', '.join(known)}, got {', '.join(unknown)}")


def check_perturbations(rig: Rig, perturbations: Perturbations) -> None:
    """Raise a `ValueError` that names every perturbation that the rig cannot have, or that is not finite."""
    check_parameters(perturbations, rig_parameters(rig))
    wrong = [f"{name} = {value!r}" for name, value in perturbations.items() if not np.isfinite(value).all()]
    if wrong:
        raise ValueError(f"expected finite perturbations, got {', '.join(wrong)}")


def shown_unit(name: str) -> str:
    """Unit in which a parameter is shown and written: mm, deg, px, or none."""
    return SHOWN[UNITS[name]][0]


def shown_per_si(name: str) -> float:
    """Factor from the SI unit to `shown_unit`."""
    return SHOWN[UNITS[name]][1]
