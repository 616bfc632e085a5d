"""How fast the gimbal swings on its base, in water and in air.

The base is elastic and held where it lies on the hull; everything that hangs on it, servos and turning parts, is one
rigid body on the foot; the water moves with M2 as with a plate. What bends beside the base (yoke, horn, the servo's
gears) makes the true frequencies lower: this is an upper estimate to compare designs by, and to keep away from the
frequency of flippers and thrusters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from cad.hulls.anchors import base_anchor
from cad.loads.masses import Body, part_bodies, together
from cad.loads.plate import added_mass
from cad.loads.seawater import water_density
from cad.loads.voxels import condensed_stiffness, voxelise
from cad.poses import body_from_group
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh
from rigs import Rig
from rigs.catalogue import MATERIALS

CUBE_MM = 3.0
"""Edge of the base's cubes; 2 mm instead changes the frequencies of aqua2 and bluerov2 by less than 4 %."""
CONTACT_MM = 1.0
"""What of the base lies less than this (or than a cube) off the anchor's plane is held by the hull; a saddle's flanks
lie behind the plane."""
SEAT_MM = 3.0
"""What of the base lies within this of the pan servo's box carries the servo."""


@dataclass(frozen=True, kw_only=True)
class ArmFrequencies:
    """The two lowest natural frequencies of the gimbal on its base, Hz, at zero joint values."""

    in_air_hz: tuple[float, float]
    in_water_hz: tuple[float, float]


def arm_frequencies(rig: Rig, meshes: Sequence[PartMesh], cube_mm: float = CUBE_MM) -> ArmFrequencies:
    """Natural frequencies of a rig's gimbal; `ValueError` for a rig whose base does not reach hull and pan servo."""
    gaze = rig.require_gaze()
    layout = Layout.from_rig(rig)
    pivot = layout.body_from_gimbal.translation
    stiffness = _base_stiffness(rig, meshes, MATERIALS[gaze.mount.material].youngs_modulus_pa, pivot, cube_mm)
    carried = [
        body.moved(body_from_group(layout, group, 0.0, 0.0))
        for group, bodies in part_bodies(rig, meshes).items()
        for body in bodies
        if group is not Group.FIXED or body.name.startswith("pan_")
    ]
    mass = _mass_matrix(together("carried", carried), pivot)
    plate = gaze.gaze_mirror
    water = added_mass(plate.width_mm / 1000, plate.height_mm / 1000, water_density(rig.water))
    normal = layout.body_from_m2(0.0, 0.0).rotation.apply([0, 0, 1])
    wet = mass.copy()
    wet[:3, :3] += water * np.outer(normal, normal)
    return ArmFrequencies(in_air_hz=_lowest_two(stiffness, mass), in_water_hz=_lowest_two(stiffness, wet))


def _base_stiffness(
    rig: Rig, meshes: Sequence[PartMesh], modulus_pa: float, pivot: FloatArray, cube_mm: float
) -> FloatArray:
    """Stiffness of the base between hull and pan servo, for motions of the point where the joint axes cross."""
    base = next(mesh for mesh in meshes if mesh.name == "gimbal_base")
    servo = next(mesh for mesh in meshes if mesh.name == "pan_servo").vertices_m
    anchor = base_anchor(rig)
    point, normal = np.array(anchor.point_mm) / 1000, np.array(anchor.normal)
    low, high = servo.min(axis=0) - SEAT_MM / 1000, servo.max(axis=0) + SEAT_MM / 1000
    contact = max(CONTACT_MM, cube_mm) / 1000
    return condensed_stiffness(
        voxelise(base.vertices_m, base.faces, cube_mm / 1000),
        modulus_pa,
        held=lambda points: (points - point) @ normal < contact,
        loaded=lambda points: ((points > low) & (points < high)).all(axis=1),
        point_m=pivot,
    )


def _mass_matrix(body: Body, pivot: FloatArray) -> FloatArray:
    """Mass matrix, shape (6, 6), of a rigid body for translation of and turns about a point."""
    arm = body.centre_of_mass_m - pivot
    across = np.cross(np.eye(3), arm)
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = body.mass_kg * np.eye(3)
    # The centre moves by turn x arm.
    matrix[:3, 3:] = body.mass_kg * across.T
    matrix[3:, :3] = body.mass_kg * across
    matrix[3:, 3:] = body.inertia_kg_m2 + body.mass_kg * across @ across.T
    return matrix


def _lowest_two(stiffness: FloatArray, mass: FloatArray) -> tuple[float, float]:
    squares = scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, 1])
    first, second = np.sqrt(squares) / (2 * np.pi)
    return float(first), float(second)
