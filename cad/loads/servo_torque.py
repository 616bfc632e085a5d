"""What the servos have to turn against, beside what they are rated for.

Three torques act at the worst at once: the weight of what turns where its centre is off the axis, the water that turns
with the mirror, and the water that the vehicle drives against it. Each is bounded from above over all poses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.loads.masses import GRAVITY_M_PER_S2, Body, part_bodies, together
from cad.loads.plate import BROADSIDE_COEFFICIENT, added_inertia, largest_flow_moment, turning_moment
from cad.loads.seawater import water_density
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, pan_from_m2
from optics.mesh import Group, PartMesh
from rigs import Problem, Rig

JointName = Literal["pan", "tilt"]

SAFETY_FACTOR = 2.0
"""Rated over needed. A hobby servo's rating is its stall torque; it turns at about half of that without overheating
(nominal, a maker's rule of thumb)."""

TILT_STEPS = 25
"""Tilts at which the extent of the turning parts is taken; what is between differs by less than a millimetre in ten."""


@dataclass(frozen=True, kw_only=True)
class ServoLoad:
    """Torques about one joint, N m.

    Attributes
    ----------
    joint : str
        pan or tilt.
    off_balance_air, off_balance_water : float
        Of the weight of what turns, in any attitude of the vehicle.
    turning : float
        Of still water at the servo's own speed.
    flow : float
        Of the flow past the vehicle at its highest speed, at the worst incidence; 0 for a rig without a vehicle.
    rated : float
        The servo's.
    inertia_kg_m2 : float
        Of what turns, with the water it sets in motion.
    time_to_speed_s : float
        From rest to the servo's speed with the rated torque less the other torques at half speed; infinite when they
        leave nothing.
    """

    joint: JointName
    off_balance_air: float
    off_balance_water: float
    turning: float
    flow: float
    rated: float
    inertia_kg_m2: float
    time_to_speed_s: float

    @property
    def needed(self) -> float:
        """Greatest torque in the water, or in air for a rig that is tried out on a bench."""
        return max(self.off_balance_air, self.off_balance_water + self.turning + self.flow)

    @property
    def margin(self) -> float:
        """Rated over needed; it should be at least `SAFETY_FACTOR`."""
        return self.rated / self.needed


def servo_loads(rig: Rig, meshes: Sequence[PartMesh]) -> tuple[ServoLoad, ServoLoad]:
    """Loads of the pan and the tilt servo; the meshes are those of `cad.assembly.meshes.rig_meshes`."""
    return _pan_load(rig, meshes), _tilt_load(rig, meshes)


def torque_problems(loads: Sequence[ServoLoad]) -> list[Problem]:
    """Servos whose rating is less than `SAFETY_FACTOR` times what they have to turn against."""
    return [
        Problem(
            place=f"servos.{load.joint}.torque_n_m",
            value=load.rated,
            expected=(
                f"at least {SAFETY_FACTOR * load.needed:.3f} N m, {SAFETY_FACTOR:g} times {load.off_balance_water:.3f} "
                f"(weight off the axis) + {load.turning:.3f} (turning in water) + {load.flow:.3f} (vehicle's speed): "
                f"take a stronger servo or a smaller gaze mirror"
            ),
        )
        for load in loads
        if load.margin < SAFETY_FACTOR
    ]


def _tilt_load(rig: Rig, meshes: Sequence[PartMesh]) -> ServoLoad:
    """M2 in its holder about the tilt axis, x of the m2 frame: a plate with its chord along y."""
    points = np.concatenate([mesh.vertices_m for mesh in meshes if mesh.group is Group.TILT])
    chord, span = 2 * float(np.abs(points[:, 1]).max()), float(np.ptp(points[:, 0]))
    bodies = part_bodies(rig, meshes)[Group.TILT]
    return _load(rig, "tilt", bodies, np.array([1.0, 0.0, 0.0]), chord_m=chord, span_m=span, sideways_m3=0.0)


def _pan_load(rig: Rig, meshes: Sequence[PartMesh]) -> ServoLoad:
    """Yoke and M2 about the pan axis, z of the pan frame: a plate with its chord along y, as wide as what turns.

    The plate's height is the tilting part's, at its highest; a tilt servo on one side is also pushed round by the flow.
    """
    layout = Layout.from_rig(rig)
    groups = part_bodies(rig, meshes)
    tilts = layout.tilt.values(TILT_STEPS)
    poses = [pan_from_m2(layout.tilt.angle(float(q2))) for q2 in tilts]
    in_m2 = np.concatenate([mesh.vertices_m for mesh in meshes if mesh.group is Group.TILT])
    mirror = [pose.apply(in_m2) for pose in poses]
    chord = 2 * max(float(np.abs(points[:, 1]).max()) for points in mirror)
    span = max(float(np.ptp(points[:, 2])) for points in mirror)
    sideways = sum(_area_moment_m3(mesh) for mesh in meshes if mesh.group is Group.PAN)
    worst = max(poses, key=lambda pose: _off_axis(_pan_bodies(groups, pose), np.array([0.0, 0.0, 1.0]), 0.0))
    return _load(
        rig,
        "pan",
        _pan_bodies(groups, worst),
        np.array([0.0, 0.0, 1.0]),
        chord_m=chord,
        span_m=span,
        sideways_m3=abs(sideways),
    )


def _pan_bodies(groups: dict[Group, list[Body]], pan_from_m2_pose: RigidTransform) -> list[Body]:
    return [*groups[Group.PAN], *(body.moved(pan_from_m2_pose) for body in groups[Group.TILT])]


def _area_moment_m3(mesh: PartMesh) -> float:
    """Area of a part's box as the flow along x sees it, times how far to the left it is; symmetric parts cancel."""
    low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    return float((high[1] - low[1]) * (high[2] - low[2]) * (high[1] + low[1]) / 2)


def _load(
    rig: Rig,
    joint: JointName,
    bodies: Sequence[Body],
    axis: FloatArray,
    *,
    chord_m: float,
    span_m: float,
    sideways_m3: float,
) -> ServoLoad:
    gaze = rig.require_gaze()
    servo = getattr(gaze.servos, joint)
    density, speed = water_density(rig.water), 0.0 if rig.vehicle is None else rig.vehicle.speed_m_per_s
    rate = math.radians(servo.speed_deg_per_s)
    in_water = _off_axis(bodies, axis, density)
    turning = turning_moment(chord_m, span_m, rate, density)
    pressure = density / 2 * speed**2
    flow = largest_flow_moment(chord_m, span_m, speed, density) + BROADSIDE_COEFFICIENT * pressure * sideways_m3
    inertia = _inertia_about(bodies, axis) + added_inertia(chord_m, span_m, density)
    left = servo.torque_n_m - in_water - flow - turning / 4
    return ServoLoad(
        joint=joint,
        off_balance_air=_off_axis(bodies, axis, 0.0),
        off_balance_water=in_water,
        turning=turning,
        flow=flow,
        rated=servo.torque_n_m,
        inertia_kg_m2=inertia,
        time_to_speed_s=inertia * rate / left if left > 0 else math.inf,
    )


def _off_axis(bodies: Sequence[Body], axis: FloatArray, density: float) -> float:
    """Torque of the weight less buoyancy about an axis through the origin, the vehicle turned as is worst, N m."""
    first = sum(
        (body.mass_kg * body.centre_of_mass_m - density * body.volume_m3 * body.centre_of_volume_m for body in bodies),
        np.zeros(3),
    )
    return GRAVITY_M_PER_S2 * float(np.linalg.norm(first - axis * (axis @ first)))


def _inertia_about(bodies: Sequence[Body], axis: FloatArray) -> float:
    whole = together("turning", bodies)
    arm = np.cross(axis, whole.centre_of_mass_m)
    return float(axis @ whole.inertia_kg_m2 @ axis + whole.mass_kg * arm @ arm)
