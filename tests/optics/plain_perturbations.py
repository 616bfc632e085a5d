"""Perturbed trains made a second time, plainly, for the tests: frames multiplied one by one, parts replaced in public.

Independent of `optics.perturbation.kernels`: only the meaning of `optics.perturbation.parameters` is shared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from optics.layout import Layout, pan_from_m2
from optics.mirror import PlaneMirror
from optics.perturbation.parameters import DISTORTION
from optics.train import OpticalTrain
from rigs import Rig

Perturbations = Mapping[str, float]


def unbounded(rig: Rig, perturbations: Perturbations, q1: float = 0.0, q2: float = 0.0) -> OpticalTrain:
    """Train of a built rig without aperture and outlines; radians."""
    bare = OpticalTrain.from_rig(rig.without_mirrors())
    camera = replace(
        bare.camera,
        distortion=tuple(
            value + perturbations.get(name, 0.0)
            for name, value in zip(DISTORTION[rig.camera.model], bare.camera.distortion, strict=False)
        ),
        **moved(bare.camera, perturbations, fx_px="fx", fy_px="fy", cx_px="cx", cy_px="cy"),
    )
    mirrors = tuple(map(PlaneMirror.from_pose, mirror_poses(rig, perturbations, q1, q2))) if rig.gaze else ()
    return OpticalTrain(camera=camera, port=port(bare.port, rig.port.shape, perturbations), mirrors=mirrors)


def port(nominal: Any, shape: str, perturbations: Perturbations) -> Any:
    off = perturbations.get
    if shape == "none":
        return nominal
    common = moved(nominal, perturbations, thickness_m="port_thickness", n_port="n_port", n_water="n_water")
    common["aperture_radius_m"] = None
    if shape == "flat":
        turn = Rotation.from_euler("XY", [off("port_tilt_x", 0.0), off("port_tilt_y", 0.0)])
        distance = moved(nominal, perturbations, distance_m="port_distance")
        return replace(nominal, normal=turn.apply(nominal.normal), **distance, **common)
    centre_m = np.add(nominal.centre_m, vector(perturbations, "port_centre"))
    return replace(nominal, centre_m=centre_m, **moved(nominal, perturbations, radius_m="port_radius"), **common)


def mirror_poses(rig: Rig, perturbations: Perturbations, q1: float, q2: float) -> tuple[RigidTransform, ...]:
    """`camera_from_m1` and `camera_from_m2`."""
    off = perturbations.get
    distances = {
        plate: {"distance_mm": getattr(rig.gaze, plate).distance_mm + 1000 * off(f"{plate}_distance", 0.0)}
        for plate in ("fold_mirror", "gaze_mirror")
    }
    layout = Layout.from_rig(rig.with_gaze(**distances))
    pan = Rotation.from_euler("z", layout.pan.angle(q1) + off("pan_offset", 0.0))
    steps = [
        *(shift(perturbations, "gimbal"), turn(perturbations, "gimbal"), RigidTransform.from_rotation(pan)),
        *(shift(perturbations, "tilt_axis"), turn(perturbations, "tilt_axis")),
        pan_from_m2(layout.tilt.angle(q2) + off("tilt_offset", 0.0)),
        *(turn(perturbations, "m2"), shift(perturbations, "m2")),
    ]
    camera_from_m2 = layout.camera_from_gimbal
    for step in steps:
        camera_from_m2 = camera_from_m2 * step
    return layout.camera_from_m1 * turn(perturbations, "m1") * shift(perturbations, "m1"), camera_from_m2


def shift(perturbations: Perturbations, part: str) -> RigidTransform:
    return RigidTransform.from_translation(vector(perturbations, f"{part}_shift"))


def turn(perturbations: Perturbations, part: str) -> RigidTransform:
    return RigidTransform.from_rotation(Rotation.from_euler("XYZ", vector(perturbations, f"{part}_turn")))


def vector(perturbations: Perturbations, parameter: str) -> np.ndarray:
    return np.array([perturbations.get(f"{parameter}_{axis}", 0.0) for axis in "xyz"])


def moved(part: Any, perturbations: Perturbations, **fields: str) -> dict[str, float]:
    """Fields of a part with their perturbations added."""
    return {field: getattr(part, field) + perturbations.get(name, 0.0) for field, name in fields.items()}
