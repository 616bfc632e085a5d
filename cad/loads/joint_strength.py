"""What the joint of a fold bracket in halves bears, in closed form: its screws as a group, and its plates as strips.

The load is what `cad.loads.holding` takes, of what lies in front of the joint, at the furthest of its centres: a force
F and a moment M in whatever direction is worst. Bending opens the joint about an edge of its plates, so that a screw at
the distance d from it pulls with M d / sum d^2; torsion shears the screws, M r / sum r^2 about their middle; F / n adds
to each. The plates are strips as wide as they are deep, held by the web of their side and bent by its screws. All is
borne by the screws next to the webs: what others in a row with them take makes it safer and stiffer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cad.loads.holding import SAFETY_FACTOR, loads_at
from cad.loads.masses import mount_in_body, together
from cad.parts.bracket.bracket_joint import FRONT, FRONT_PLATE_MM, REAR_PLATE_MM, THREAD, BracketJoint, bracket_joint
from cad.parts.bracket.bracket_placement import bracket_placement
from cad.parts.hardware import nominal_diameter_mm
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh
from rigs import Rig
from rigs.catalogue import MATERIALS

IN_FRONT = (FRONT, "fold_mirror")
PLATES_MM = (FRONT_PLATE_MM, REAR_PLATE_MM)
INSERT_N = 500.0
"""Pull on a short M4 insert in plastic; nominal, half of what comes out of good prints."""
STRENGTH_PA = 20.0e6
"""Of the plates, in bending and against the screws' shanks; nominal, half of a printed specimen's along its layers."""


@dataclass(frozen=True, kw_only=True)
class JointStrength:
    """What a joint bears.

    Attributes
    ----------
    force_n, moment_n_m : float
        Load, in the middle of the joint.
    pull_n, shear_n : float
        On the screw that has most of it.
    stress_pa : float
        In the front plate, where it leaves the web.
    tilt_rad : float
        By how much the front half turns under the load, because both plates bend.
    margin : float
        What it bears over what it should bear, safety factor included: at least 1.
    """

    force_n: float
    moment_n_m: float
    pull_n: float
    shear_n: float
    stress_pa: float
    tilt_rad: float
    margin: float


def joint_strength(rig: Rig, meshes: Sequence[PartMesh]) -> JointStrength | None:
    """Strength of the joint of a rig's fold bracket; None for one in one piece. The meshes are those of the rig."""
    if all(mesh.name != FRONT for mesh in meshes):
        return None
    joint = bracket_joint(bracket_placement(rig, Layout.from_rig(rig)))
    if joint is None:
        return None
    ahead = [body for body in mount_in_body(rig, meshes, 0.0, 0.0) if body.name.startswith(IN_FRONT)]
    y, z = np.mean(joint.sides_mm), np.mean(joint.levels_mm)
    middle = joint.placement.in_body_mm(joint.x_mm, float(y), float(z)) / 1000
    _, (force, moment) = loads_at(rig, together(FRONT, ahead), "fold", middle)
    return _strength(joint, force, moment, MATERIALS[joint.placement.mount.material].youngs_modulus_pa)


def _strength(joint: BracketJoint, force_n: float, moment_n_m: float, modulus_pa: float) -> JointStrength:
    screws = _outermost(joint.screws_mm) / 1000
    number, side = len(screws), len(screws) // 2
    levers = min(_levers_m(joint, screws), key=lambda arms: float((arms**2).sum() / arms.max()))
    around = np.linalg.norm(screws - screws.mean(axis=0), axis=1)
    pull = force_n / number + moment_n_m * float(levers.max() / (levers**2).sum())
    shear = force_n / number + moment_n_m * float(around.max() / (around**2).sum())
    # From the middle of the web to the screws of its side.
    reach = float(screws[:, 0].min()) - (joint.sides_mm[0] + joint.placement.web_mm / 2) / 1000
    depth, thin = joint.placement.girder_mm / 1000, FRONT_PLATE_MM / 1000
    stress = 6 * side * pull * reach / (depth * thin**2)
    bent = sum(4 * side * pull * reach**3 / (modulus_pa * depth * (plate / 1000) ** 3) for plate in PLATES_MM)
    bearing = STRENGTH_PA * nominal_diameter_mm(THREAD) / 1000 * thin
    worst = max(pull / INSERT_N, shear / bearing, stress / STRENGTH_PA)
    return JointStrength(
        force_n=force_n,
        moment_n_m=moment_n_m,
        pull_n=pull,
        shear_n=shear,
        stress_pa=stress,
        tilt_rad=bent / float(levers.mean()),
        margin=1 / (SAFETY_FACTOR * worst),
    )


def _outermost(screws_mm: FloatArray) -> FloatArray:
    """Those of the columns next to the webs."""
    off = np.abs(screws_mm[:, 0] - screws_mm[:, 0].mean())
    return np.asarray(screws_mm[off > off.max() - 1e-6])


def _levers_m(joint: BracketJoint, screws_m: FloatArray) -> list[FloatArray]:
    """Distances of screws from each of the four edges of the plates."""
    return [
        np.abs(screws_m[:, axis] - edge / 1000)
        for axis, edges in enumerate((joint.sides_mm, joint.levels_mm))
        for edge in edges
    ]
