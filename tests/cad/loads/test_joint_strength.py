"""The joint of a fold bracket in halves: its screws and plates against the closed forms of a symmetric row."""

from __future__ import annotations

import numpy as np
import pytest

from cad.checks.attachment import joint_findings
from cad.loads.joint_strength import INSERT_N, STRENGTH_PA, joint_strength
from cad.parts.bracket.bracket_joint import FRONT_PLATE_MM, REAR_PLATE_MM, bracket_joint
from cad.parts.bracket.bracket_placement import bracket_placement
from rigs.catalogue import MATERIALS


@pytest.fixture(scope="module")
def jointed(split):
    return split.rig, split.meshes, bracket_joint(bracket_placement(split.rig, split.layout))


def levers_m(joint):
    """Distances of the lower and the upper screws from the edge of the plates about which those pull most."""
    rows = np.unique(joint.screws_mm[:, 1])
    arms = [np.abs(rows - edge) / 1000 for edge in joint.levels_mm]
    return max(arms, key=lambda each: each.max() / (each**2).sum())


def test_the_furthest_screws_pull_most_against_an_edge(jointed):
    """Two a side at the levers a and b: M b / 2 (a^2 + b^2) + F / 4; torsion on four at r: M / 4 r + F / 4."""
    rig, meshes, joint = jointed
    found = joint_strength(rig, meshes)
    assert len(joint.screws_mm) == 4
    levers = levers_m(joint)
    pull = found.moment_n_m * levers.max() / (2 * (levers**2).sum())
    assert found.pull_n == pytest.approx(found.force_n / 4 + pull)
    around = np.hypot(joint.screws_mm[:, 0].max(), np.ptp(joint.screws_mm[:, 1]) / 2) / 1000
    assert found.shear_n == pytest.approx(found.force_n / 4 + found.moment_n_m / (4 * around))


def test_a_plate_is_a_cantilever_from_its_web(jointed):
    """With two screws at the reach e: sigma = 6 (2 T) e / h t^2, and w = 2 T e^3 / 3 E I of each plate."""
    rig, meshes, joint = jointed
    found = joint_strength(rig, meshes)
    reach = (joint.sides_mm[1] - joint.placement.web_mm / 2 - joint.screws_mm[:, 0].max()) / 1000
    height, plates = joint.placement.girder_mm / 1000, (FRONT_PLATE_MM / 1000, REAR_PLATE_MM / 1000)
    assert found.stress_pa == pytest.approx(6 * 2 * found.pull_n * reach / (height * plates[0] ** 2))
    modulus = MATERIALS[rig.gaze.mount.material].youngs_modulus_pa
    bent = sum(2 * found.pull_n * reach**3 / (3 * modulus * height * plate**3 / 12) for plate in plates)
    assert found.tilt_rad == pytest.approx(bent / levers_m(joint).mean())


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
