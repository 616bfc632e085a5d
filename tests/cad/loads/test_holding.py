"""What holds the ends of a mount, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from cad.assembly.meshes import rig_meshes
from cad.checks.attachment import holding_findings
from cad.loads.holding import BOLT_N, FRICTION, TAPE_DYNAMIC_PA, TAPE_STATIC_PA, holdings
from cad.loads.masses import mount_in_body, together
from cad.loads.plate import BROADSIDE_COEFFICIENT
from cad.loads.seawater import water_density
from rigs import Rig


def held(end: str, **mount):
    rig = Rig.load("bluerov2").with_gaze(mount=mount)
    meshes = rig_meshes(rig)
    return rig, meshes, next(found for found in holdings(rig, meshes) if found.end == end)


def test_screws_hold_by_friction_and_against_tipping():
    _, _, found = held("fold")
    press = 4 * BOLT_N
    expected = min(FRICTION * press / found.force_n, press * 0.023 / found.moment_n_m) / 2
    assert found.margin == pytest.approx(expected)
    assert found.margin > 1


def test_the_load_is_the_worse_of_air_and_of_flow():
    """Weight of what hangs on the end in air; or in water, with the flow broadside on the mirror."""
    rig, meshes, found = held("fold")
    own = [body for body in mount_in_body(rig, meshes, 0.0, 0.0) if body.name.startswith("fold_")]
    whole, density = together("fold", own), water_density(rig.water)
    mirror = rig.gaze.fold_mirror
    area = mirror.width_mm * mirror.height_mm / 1e6
    flow = BROADSIDE_COEFFICIENT * density / 2 * rig.vehicle.speed_m_per_s**2 * area
    expected = max(whole.weight_in_water_n(0.0), abs(whole.weight_in_water_n(density)) + flow)
    assert found.force_n == pytest.approx(expected)


def test_tape_that_is_too_small_is_a_problem_with_its_key():
    """A rigid sheet under force F and moment M: F / (l w) + 6 M / (l w^2) at its edge; lasting loads decide."""
    rig, meshes, found = held("base", base_attachment="pads")
    whole = together(
        "base", [b for b in mount_in_body(rig, meshes, 0.0, 0.0) if not b.name.startswith(("fold_", "band_"))]
    )
    force = whole.weight_in_water_n(water_density(rig.water))
    moment = force * np.linalg.norm(whole.centre_of_mass_m - np.array(rig.gaze.mount.base_anchor_mm) / 1000)
    edge = force / (0.09 * 0.07) + 6 * moment / (0.09 * 0.07 * 0.07)
    assert TAPE_STATIC_PA < TAPE_DYNAMIC_PA
    assert found.margin == pytest.approx(TAPE_STATIC_PA / edge)
    problems = [finding.problem for finding in holding_findings(rig, meshes) if finding.problem is not None]
    assert [problem.place for problem in problems] == ["mount.base_attachment"]
