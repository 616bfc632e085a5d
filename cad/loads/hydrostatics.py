"""What the mount does to the vehicle at rest: weight and buoyancy, trim, and the ballast that takes it back.

The body is level, z up. Moments are about the vehicle's centre of buoyancy, where a neutral vehicle turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cad.loads.masses import GRAVITY_M_PER_S2, Body, mount_in_body, part_bodies, together
from cad.loads.seawater import water_density
from cad.poses import body_from_group
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh, Role
from rigs import Rig
from rigs.catalogue import MATERIALS

POSES_PER_JOINT = 9
"""Joint values at which the moving centre is looked at, ends included; it is smooth in them."""


@dataclass(frozen=True, kw_only=True)
class Weight:
    """A piece of ballast: foam that lifts or lead that pulls down.

    Attributes
    ----------
    material : str
        ``foam`` or ``lead``.
    mass_kg, volume_m3 : float
        How much of it.
    position_m : array, shape (3,)
        Where its middle goes, body frame.
    """

    material: str
    mass_kg: float
    volume_m3: float
    position_m: FloatArray


@dataclass(frozen=True, kw_only=True)
class Trim:
    """How the vehicle hangs with the mount on: bow up and left side up are positive, radians."""

    pitch_rad: float
    roll_rad: float


@dataclass(frozen=True, kw_only=True)
class Hydrostatics:
    """The mount at rest in the water.

    Attributes
    ----------
    parts : tuple of Body
        Every part but the hull in the body frame, at zero joint values.
    whole : Body
        All of them together.
    water_density_kg_per_m3 : float
    weight_in_air_n, weight_in_water_n : float
        Positive downwards.
    moment_n_m : array, shape (2,)
        Of the weight in water about the centre of buoyancy: rolling to the right, pitching the bow down.
    travel_m : array, shape (3,)
        By how much the centre of mass moves along the body's axes over the joint range.
    trim : Trim or None
        None for a rig without a vehicle.
    ballast : tuple of Weight
        What makes the mount weightless and free of moment: one piece below or above its centre where that lies within
        the hull's length and width, else one at either end of the hull.
    """

    parts: tuple[Body, ...]
    whole: Body
    water_density_kg_per_m3: float
    weight_in_air_n: float
    weight_in_water_n: float
    moment_n_m: FloatArray
    travel_m: FloatArray
    trim: Trim | None
    ballast: tuple[Weight, ...]


def hydrostatics(rig: Rig, meshes: Sequence[PartMesh]) -> Hydrostatics:
    """Weigh a rig's mount in air and in its water; the meshes are those of `cad.assembly.meshes.rig_meshes`."""
    density = water_density(rig.water)
    parts = mount_in_body(rig, meshes, 0.0, 0.0)
    whole = together("mount", parts)
    centre = np.zeros(3) if rig.vehicle is None else np.array(rig.vehicle.centre_mm) / 1000
    weight, moment = _net_weight(whole, centre, density)
    hull = np.concatenate([mesh.vertices_m for mesh in meshes if mesh.role is Role.HULL])
    return Hydrostatics(
        parts=tuple(parts),
        whole=whole,
        water_density_kg_per_m3=density,
        weight_in_air_n=GRAVITY_M_PER_S2 * whole.mass_kg,
        weight_in_water_n=weight,
        moment_n_m=moment[:2],
        travel_m=_travel(rig, meshes),
        trim=_trim(rig, moment),
        ballast=ballast(
            weight,
            moment[:2],
            centre_m=centre,
            least_m=hull.min(axis=0),
            greatest_m=hull.max(axis=0),
            density_kg_per_m3=density,
        ),
    )


def _net_weight(body: Body, centre_m: FloatArray, density: float) -> tuple[float, FloatArray]:
    """Weight less buoyancy W (N), and about a point its moments ``-W y`` and ``W x`` and its height ``W z`` (N m)."""
    down = body.mass_kg * (body.centre_of_mass_m - centre_m)
    up = density * body.volume_m3 * (body.centre_of_volume_m - centre_m)
    first = GRAVITY_M_PER_S2 * (down - up)
    return body.weight_in_water_n(density), np.array([-first[1], first[0], first[2]])


def _travel(rig: Rig, meshes: Sequence[PartMesh]) -> FloatArray:
    layout = Layout.from_rig(rig)
    groups = {group: together(group, bodies) for group, bodies in part_bodies(rig, meshes).items() if bodies}
    centres = [
        together("mount", [body.moved(body_from_group(layout, group, q1, q2)) for group, body in groups.items()])
        for q1, q2 in layout.joint_grid(POSES_PER_JOINT).tolist()
    ]
    return np.asarray(np.ptp([body.centre_of_mass_m for body in centres], axis=0))


def _trim(rig: Rig, moment: FloatArray) -> Trim | None:
    """Angles at which the vehicle's righting moment balances the mount's.

    Turned by a small or large angle t about a level axis, the vehicle rights itself with ``m g h sin t``, h its
    righting arm, and the mount's weight, at a lever x ahead and z above, turns it with ``W (x cos t + z sin t)``:
    ``tan t = W x / (m g h - W z)``. Pitch and roll are taken one at a time.
    """
    if rig.vehicle is None:
        return None
    righting = GRAVITY_M_PER_S2 * rig.vehicle.mass_kg * rig.vehicle.righting_arm_mm / 1000 - moment[2]
    roll, pitch = np.arctan2(moment[:2], righting)
    return Trim(pitch_rad=-float(pitch), roll_rad=float(roll))


def ballast(
    weight_n: float,
    moment_n_m: FloatArray,
    *,
    centre_m: FloatArray,
    least_m: FloatArray,
    greatest_m: FloatArray,
    density_kg_per_m3: float,
) -> tuple[Weight, ...]:
    """Ballast against a weight in water and its moments.

    Parameters
    ----------
    weight_n : float
        Positive downwards.
    moment_n_m : array, shape (2,)
        ``(-W y, W x)`` about `centre_m`.
    centre_m, least_m, greatest_m : array, shape (3,)
        The point that moments are about, and the corners of the hull's box.
    density_kg_per_m3 : float
        Of the water.

    Returns
    -------
    tuple of Weight
        One piece at the height of `centre_m` when its place is within the hull's length and width; else two, at the
        hull's bow and stern, that share force and pitching moment, both at the side that the rolling moment asks for
        where there is a force to do so.
    """
    x, y = moment_n_m[1], -moment_n_m[0]
    if weight_n != 0:
        place = centre_m + np.array([x / weight_n, y / weight_n, 0.0])
        if (least_m[:2] <= place[:2]).all() and (place[:2] <= greatest_m[:2]).all():
            return (_against(weight_n, place, density_kg_per_m3),)
    bow, stern = greatest_m[0] - centre_m[0], least_m[0] - centre_m[0]
    at_bow = (x - weight_n * stern) / (bow - stern)
    side = np.clip(y / weight_n if weight_n else 0.0, least_m[1] - centre_m[1], greatest_m[1] - centre_m[1])
    return tuple(
        _against(share, centre_m + np.array([end, side, 0.0]), density_kg_per_m3)
        for share, end in ((at_bow, bow), (weight_n - at_bow, stern))
    )


def _against(weight_n: float, position_m: FloatArray, density: float) -> Weight:
    """Foam against what sinks, lead against what floats."""
    material = "foam" if weight_n > 0 else "lead"
    own = MATERIALS[material].density_kg_per_m3
    volume = float(weight_n) / (GRAVITY_M_PER_S2 * (density - own))
    return Weight(material=material, mass_kg=own * volume, volume_m3=volume, position_m=position_m)
