"""The joint of a fold bracket in halves: its screws and plates against the closed forms of a symmetric row."""

from __future__ import annotations

import pytest

from cad.checks.attachment import joint_findings
from cad.loads.joint_strength import INSERT_N, STRENGTH_PA, joint_strength
from cad.parts.bracket.bracket_joint import FRONT_PLATE_MM, REAR_PLATE_MM, bracket_joint
from cad.parts.bracket.bracket_placement import bracket_placement
from rigs.catalogue import MATERIALS


@pytest.fixture(scope="module")
def jointed(split):
    return split.rig, split.meshes, bracket_joint(bracket_placement(split.rig, split.layout))


def test_the_outer_screws_pull_against_an_edge(jointed):
    """Two at one lever d: M / 2 d + F / 2; torsion on the two at +-a: M / 2 a + F / 2."""
    rig, meshes, joint = jointed
    found = joint_strength(rig, meshes)
    lever = min(abs(joint.screws_mm[0, 1] - edge) for edge in joint.levels_mm) / 1000
    assert found.pull_n == pytest.approx(found.force_n / 2 + found.moment_n_m / (2 * lever))
    outer = joint.screws_mm[:, 0].max() / 1000
    assert found.shear_n == pytest.approx(found.force_n / 2 + found.moment_n_m / (2 * outer))


def test_a_plate_is_a_cantilever_from_its_web(jointed):
    """With the screw at the reach e: sigma = 6 T e / h t^2, and w = T e^3 / 3 E I of each plate."""
    rig, meshes, joint = jointed
    found = joint_strength(rig, meshes)
    reach = (joint.sides_mm[1] - joint.placement.wall_mm / 2 - joint.screws_mm[:, 0].max()) / 1000
    height, plates = joint.placement.girder_mm / 1000, (FRONT_PLATE_MM / 1000, REAR_PLATE_MM / 1000)
    assert found.stress_pa == pytest.approx(6 * found.pull_n * reach / (height * plates[0] ** 2))
    modulus = MATERIALS[rig.gaze.mount.material].youngs_modulus_pa
    bent = sum(found.pull_n * reach**3 / (3 * modulus * height * plate**3 / 12) for plate in plates)
    lever = min(abs(joint.screws_mm[0, 1] - edge) for edge in joint.levels_mm) / 1000
    assert found.tilt_rad == pytest.approx(bent / lever)


def test_the_weakest_decides_and_is_told(jointed):
    rig, meshes, _ = jointed
    found = joint_strength(rig, meshes)
    used = max(
        found.pull_n / INSERT_N,
        found.stress_pa / STRENGTH_PA,
        found.shear_n / (STRENGTH_PA * 0.004 * FRONT_PLATE_MM / 1000),
    )
    (finding,) = joint_findings(rig, meshes)
    assert finding.figure == found.margin == pytest.approx(1 / (2 * used))
    assert finding.problem is None


def test_a_bracket_in_one_piece_has_no_joint(built):
    assert joint_findings(built.rig, built.meshes) == []
