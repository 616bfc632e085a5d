"""Everything about the loads of a rig at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cad.assembly.meshes import rig_meshes
from cad.loads.frequency import ArmFrequencies, arm_frequencies
from cad.loads.hydrostatics import Hydrostatics, hydrostatics
from cad.loads.servo_torque import ServoLoad, servo_loads, torque_problems
from optics.mesh import PartMesh
from rigs import Problem, Rig


@dataclass(frozen=True, kw_only=True)
class LoadStudy:
    """Loads of a rig's mount.

    Attributes
    ----------
    rig : Rig
    hydrostatics : Hydrostatics
    servos : tuple of ServoLoad
        Pan, then tilt.
    frequencies : ArmFrequencies
    """

    rig: Rig
    hydrostatics: Hydrostatics
    servos: tuple[ServoLoad, ...]
    frequencies: ArmFrequencies

    @property
    def problems(self) -> list[Problem]:
        """Servos that are too weak."""
        return torque_problems(self.servos)


def load_study(rig: Rig, meshes: Sequence[PartMesh] | None = None) -> LoadStudy:
    """Study the loads of a rig, on its own meshes unless others are given; `ValueError` for a rig without mirrors."""
    meshes = rig_meshes(rig) if meshes is None else meshes
    return LoadStudy(
        rig=rig,
        hydrostatics=hydrostatics(rig, meshes),
        servos=servo_loads(rig, meshes),
        frequencies=arm_frequencies(rig, meshes),
    )
