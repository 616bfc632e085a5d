"""What each part weighs and displaces, and where; from the meshes, so that nothing has to be modelled again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform

from cad.poses import body_from_group
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import Rig
from rigs.catalogue import MATERIALS

GRAVITY_M_PER_S2 = 9.80665
"""Standard acceleration of free fall, ISO 80000-3."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """Mass and displaced volume of a part or of several.

    Attributes
    ----------
    name : str
        What it is.
    mass_kg, volume_m3 : float
        Mass, and volume of water it takes the place of.
    centre_of_mass_m, centre_of_volume_m : array, shape (3,)
        Where weight and buoyancy act.
    inertia_kg_m2 : array, shape (3, 3)
        About the centre of mass.
    """

    name: str
    mass_kg: float
    volume_m3: float
    centre_of_mass_m: FloatArray
    centre_of_volume_m: FloatArray
    inertia_kg_m2: FloatArray

    def moved(self, pose: RigidTransform) -> Body:
        """The same body in another frame."""
        turn = pose.rotation.as_matrix()
        return Body(
            name=self.name,
            mass_kg=self.mass_kg,
            volume_m3=self.volume_m3,
            centre_of_mass_m=pose.apply(self.centre_of_mass_m),
            centre_of_volume_m=pose.apply(self.centre_of_volume_m),
            inertia_kg_m2=turn @ self.inertia_kg_m2 @ turn.T,
        )

    def weight_in_water_n(self, density_kg_per_m3: float) -> float:
        """Weight less buoyancy; negative for what floats."""
        return GRAVITY_M_PER_S2 * (self.mass_kg - density_kg_per_m3 * self.volume_m3)


def part_bodies(rig: Rig, meshes: Iterable[PartMesh]) -> dict[Group, list[Body]]:
    """Bodies of every part but the hull, by what they move with, each in the frame of its group.

    A servo has the mass of its data sheet; everything else is solid, of the material of its role, of small bought parts
    by the last word of their names: a bushing is polymer, an insert brass, a tie nylon, a pad foam tape, the rest
    stainless steel.
    """
    bodies: dict[Group, list[Body]] = {group: [] for group in Group}
    for mesh in meshes:
        if mesh.role is not Role.HULL:
            bodies[mesh.group].append(_body(rig, mesh))
    return bodies


def mount_in_body(rig: Rig, meshes: Iterable[PartMesh], q1: float, q2: float) -> list[Body]:
    """Bodies of every part but the hull in the body frame, at joint values in radians."""
    layout = Layout.from_rig(rig)
    return [
        body.moved(body_from_group(layout, group, q1, q2))
        for group, group_bodies in part_bodies(rig, meshes).items()
        for body in group_bodies
    ]


def together(name: str, bodies: Sequence[Body]) -> Body:
    """Several bodies, given in one frame, as one."""
    mass = sum(body.mass_kg for body in bodies)
    volume = sum(body.volume_m3 for body in bodies)
    centre = np.sum([body.mass_kg * body.centre_of_mass_m for body in bodies], axis=0) / mass
    centre_of_volume = np.sum([body.volume_m3 * body.centre_of_volume_m for body in bodies], axis=0) / volume
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = body.centre_of_mass_m - centre
        inertia += body.inertia_kg_m2 + body.mass_kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Body(
        name=name,
        mass_kg=mass,
        volume_m3=volume,
        centre_of_mass_m=centre,
        centre_of_volume_m=centre_of_volume,
        inertia_kg_m2=inertia,
    )


def _body(rig: Rig, mesh: PartMesh) -> Body:
    surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    is_servo = mesh.role is Role.SERVO and not mesh.name.endswith("_horn")
    density = _servo_mass_kg(rig, mesh.name) / surface.volume if is_servo else _density(rig, mesh)
    centre = np.asarray(surface.center_mass, dtype=np.float64)
    return Body(
        name=mesh.name,
        mass_kg=float(density * surface.volume),
        volume_m3=float(surface.volume),
        centre_of_mass_m=centre,
        centre_of_volume_m=centre,
        inertia_kg_m2=density * np.asarray(surface.moment_inertia),
    )


def _density(rig: Rig, mesh: PartMesh) -> float:
    gaze = rig.require_gaze()
    # Of what a servo is, only its horn is weighed by volume.
    by_role = {Role.MOUNT: gaze.mount.material, Role.MIRROR: "glass", Role.SERVO: "nylon"}
    by_kind = {"bushing": "polymer", "insert": "brass", "tie": "nylon", "pad": "foam_tape"}
    material = by_role.get(mesh.role) or by_kind.get(mesh.name.rpartition("_")[2], "stainless")
    return MATERIALS[material].density_kg_per_m3


def _servo_mass_kg(rig: Rig, part: str) -> float:
    """Mass of the servo that a part called `pan_servo`, `tilt_servo`, ... stands for."""
    servo = getattr(rig.require_gaze().servos, part.removesuffix("_servo"), None)
    if servo is None:
        raise ValueError(f"expected the part of a servo in [servos], got {part!r}")
    return float(servo.mass_g) / 1000
