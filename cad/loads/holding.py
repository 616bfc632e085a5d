"""Whether what holds a flange to the hull carries its end of the mount: by friction under bands or screws, or by tape.

The load on an end is the worse of its weight in air, when the vehicle is lifted out, and its weight in water with the
flow on its mirror broadside on; it acts in whatever direction is worst, at the furthest of its centres from the anchor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from cad.hulls.anchors import ENDS, End, base_anchor, fold_anchor
from cad.loads.masses import Body, mount_in_body, together
from cad.loads.plate import BROADSIDE_COEFFICIENT
from cad.loads.seawater import water_density
from cad.parts.bands import BAND, bands
from cad.parts.flange import Seat, base_seat, bolt_places, fold_seat
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh, Role
from rigs import Rig
from rigs.mounting import Attachment

FRICTION = 0.3
"""Of wet plastic on plastic, paint or metal; nominal, a sheet of neoprene between them has more."""
TENSION_N: dict[Attachment, float] = {"clamps": 1000.0, "straps": 250.0}
"""Of a band: nominal for a 12 mm hose clamp at 3 N m; of a cable tie of 12.7 mm a quarter of its strength of 1.1 kN."""
BOLT_N = 1000.0
"""Of an M4 screw in a tapped hole in plastic; nominal, a third of what steel would bear."""
SAFETY_FACTOR = 2.0
TAPE_STATIC_PA = 1.7e3
TAPE_DYNAMIC_PA = 85.0e3
"""3M's design strengths for VHB tape: 0.25 psi for what lasts, 12 psi for gusts (with a safety factor of 5)."""


@dataclass(frozen=True, kw_only=True)
class Holding:
    """How one end of the mount is held.

    Attributes
    ----------
    end : str
        fold or base.
    attachment : str
    force_n, moment_n_m : float
        Load, at the anchor.
    press_n : float
        With what the flange is pressed onto the hull; 0 for tape.
    margin : float
        What it bears over what it should bear, safety factor included: at least 1.
    """

    end: End
    attachment: Attachment
    force_n: float
    moment_n_m: float
    press_n: float
    margin: float


def holdings(rig: Rig, meshes: Sequence[PartMesh]) -> list[Holding]:
    """How both ends of a rig's mount are held; the meshes are those of `cad.assembly.meshes.rig_meshes`."""
    hull = next(mesh for mesh in meshes if mesh.role is Role.HULL)
    surface = trimesh.Trimesh(1000 * hull.vertices_m, hull.faces, process=False)
    seats: dict[End, Seat] = {"fold": fold_seat(rig), "base": base_seat(rig, _towards_pan_axis(rig))}
    pressed = dict.fromkeys(ENDS, 0.0)
    for band in bands([seat for seat in seats.values() if seat.strapped], surface):
        for end, seat in seats.items():
            if any(seat is under for under in band.seats):
                pressed[end] += TENSION_N[band.kind] * band.press(seat)
    return [_holding(rig, meshes, end, seats[end], pressed[end]) for end in ENDS]


def _holding(rig: Rig, meshes: Sequence[PartMesh], end: End, seat: Seat, press_n: float) -> Holding:
    lasting, gust = _loads(rig, meshes, end)
    force, moment = max(lasting[0], gust[0]), max(lasting[1], gust[1])
    length, width = seat.length_mm / 1000, seat.width_mm / 1000
    if seat.attachment == "pads":
        area, section = length * width, length * width * min(length, width) / 6
        stresses = [load[0] / area + load[1] / section for load in (lasting, gust)]
        margin = min(TAPE_STATIC_PA / stresses[0], TAPE_DYNAMIC_PA / stresses[1])
        return Holding(
            end=end, attachment=seat.attachment, force_n=force, moment_n_m=moment, press_n=0.0, margin=margin
        )
    press = press_n if seat.strapped else BOLT_N * len(bolt_places())
    bears = min(FRICTION * press / force, press * min(length, width) / 2 / moment)
    return Holding(
        end=end,
        attachment=seat.attachment,
        force_n=force,
        moment_n_m=moment,
        press_n=press,
        margin=bears / SAFETY_FACTOR,
    )


def _loads(rig: Rig, meshes: Sequence[PartMesh], end: End) -> tuple[tuple[float, float], tuple[float, float]]:
    """Force (N) and moment (N m) at an end's anchor: what lasts under water, and the most there is."""
    parts = [body for body in mount_in_body(rig, meshes, 0.0, 0.0) if not body.name.startswith(BAND)]
    own = together(end, [body for body in parts if body.name.startswith(("fold_", "stow_")) == (end == "fold")])
    anchor = fold_anchor(rig) if end == "fold" else base_anchor(rig)
    return loads_at(rig, own, end, np.array(anchor.point_mm) / 1000)


def loads_at(rig: Rig, own: Body, end: End, point_m: FloatArray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Force (N) and moment (N m) at a point: what lasts under water, and the most there is.

    Of the weight of `own`, given in the body frame, and of the flow on the mirror of its end.
    """
    gaze, layout, density = rig.require_gaze(), Layout.from_rig(rig), water_density(rig.water)
    in_water, in_air = abs(own.weight_in_water_n(density)), own.weight_in_water_n(0.0)
    mirror, pose = (
        (gaze.fold_mirror, layout.body_from_m1) if end == "fold" else (gaze.gaze_mirror, layout.body_from_gimbal)
    )
    speed = 0.0 if rig.vehicle is None else rig.vehicle.speed_m_per_s
    area = mirror.width_mm * mirror.height_mm / 1e6
    flow = BROADSIDE_COEFFICIENT * density / 2 * speed**2 * area
    weight_arm, flow_arm = (
        float(np.linalg.norm(centre - point_m)) for centre in (own.centre_of_mass_m, pose.translation)
    )
    lasting = (in_water, in_water * weight_arm)
    moving = (in_water + flow, in_water * weight_arm + flow * flow_arm)
    return lasting, (max(in_air, moving[0]), max(in_air * weight_arm, moving[1]))


def _towards_pan_axis(rig: Rig) -> FloatArray:
    gimbal = Layout.from_rig(rig).body_from_gimbal
    away, axis = 1000 * gimbal.translation - rig.require_gaze().mount.base_anchor_mm, gimbal.rotation.apply([0, 0, 1])
    return np.asarray(away - (away @ axis) * axis)
