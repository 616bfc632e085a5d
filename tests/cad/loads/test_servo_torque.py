"""Torques on the servos."""

import numpy as np
import pytest
import trimesh

from cad.assembly.meshes import rig_meshes
from cad.loads import plate
from cad.loads.masses import GRAVITY_M_PER_S2
from cad.loads.servo_torque import SAFETY_FACTOR, servo_loads, torque_problems
from optics.mesh import Group, PartMesh, Role
from rigs import Rig


def plate_mesh(width, height, thickness, offset=(0.0, 0.0, 0.0)):
    box = trimesh.creation.box((width, height, thickness))
    box.apply_translation(offset)
    return PartMesh(
        name="gaze_mirror",
        group=Group.TILT,
        role=Role.MIRROR,
        vertices_m=np.array(box.vertices),
        faces=np.array(box.faces, dtype=np.int32),
    )


def test_a_plate_on_its_axis_has_the_closed_forms_of_a_plate(aqua2):
    _, tilt = servo_loads(aqua2, [plate_mesh(0.08, 0.1, 0.003)])
    density, rate = 1023.343, np.radians(aqua2.gaze.servos.tilt.speed_deg_per_s)
    assert tilt.off_balance_air == pytest.approx(0, abs=1e-12)
    assert tilt.turning == pytest.approx(plate.turning_moment(0.1, 0.08, rate, density), rel=1e-5)
    flow = plate.largest_flow_moment(0.1, 0.08, aqua2.vehicle.speed_m_per_s, density)
    assert tilt.flow == pytest.approx(flow, rel=1e-5)
    solid = 2500 * 0.08 * 0.1 * 0.003 * (0.1**2 + 0.003**2) / 12
    assert tilt.inertia_kg_m2 == pytest.approx(solid + plate.added_inertia(0.1, 0.08, density), rel=1e-5)


def test_weight_off_the_axis_pulls_with_its_lever_and_buoyancy_takes_its_part(aqua2):
    """Glass 10 mm off the axis: m g 0.01 in air, (1 - rho_water / rho_glass) of that in water."""
    _, tilt = servo_loads(aqua2, [plate_mesh(0.08, 0.1, 0.003, offset=(0.0, 0.006, -0.008))])
    weight = GRAVITY_M_PER_S2 * 2500 * 0.08 * 0.1 * 0.003
    assert tilt.off_balance_air == pytest.approx(weight * 0.01, rel=1e-9)
    assert tilt.off_balance_water == pytest.approx(weight * 0.01 * (1 - 1023.343 / 2500), rel=1e-5)


def test_aqua2s_servos_are_strong_enough(aqua2, aqua2_meshes):
    loads = servo_loads(aqua2, aqua2_meshes)
    assert torque_problems(loads) == []
    assert all(load.margin >= SAFETY_FACTOR for load in loads)


def test_a_mirror_twice_too_large_is_refused(aqua2):
    """Rationale: with the largest plate that the servo may turn as the measure, one of twice its sides must be refused.

    Expected: the largest square plate is found by bisection; at 1.001 times its side there is one problem, at twice its
    side the needed torque is at least 8 times as large (flow grows with the cube of the size, turning with its fifth
    power).
    """

    def loads(side):
        return servo_loads(aqua2, [plate_mesh(side, side, 0.003)])[1:]

    low, high = 0.01, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if not torque_problems(loads(middle)) else (low, middle)
    (problem,) = torque_problems(loads(1.001 * low))
    assert problem.place == "servos.tilt.torque_n_m"
    assert torque_problems(loads(0.999 * low)) == []
    assert loads(2 * low)[0].needed > 7.9 * loads(low)[0].needed
    assert torque_problems(loads(2 * low))


def test_a_rig_with_a_mirror_twice_too_large_is_refused_by_the_names_of_its_servos(aqua2):
    """The whole way from the rig file: aqua2's gaze mirror with twice its sides at twice its distance."""
    data = aqua2.model_dump()
    for key in ("width_mm", "height_mm", "distance_mm"):
        data["gaze_mirror"][key] *= 2
    # The larger yoke needs its column further back.
    data["mount"]["base_anchor_mm"] = (150.0, 60.0, -65.0)
    large = Rig.model_validate(data)
    places = [problem.place for problem in torque_problems(servo_loads(large, rig_meshes(large)))]
    assert places == ["servos.pan.torque_n_m", "servos.tilt.torque_n_m"]


def test_without_a_vehicle_there_is_no_flow(aqua2, aqua2_meshes):
    still = Rig.model_validate({**aqua2.model_dump(), "vehicle": None})
    assert [load.flow for load in servo_loads(still, aqua2_meshes)] == [0.0, 0.0]
