"""What is said of the covered fraction holds what finer grids find."""

from __future__ import annotations

import numpy as np
import pytest

from optics.coverage.coverage import compute_coverage, covered_cells, stepped_joints
from optics.coverage.uncertainty import covered_range
from rigs import Rig

NSIDE = 32
FINE_DEG = 1.0


def longer_lens(name: str, factor: float) -> Rig:
    rig = Rig.load(name)
    lens = {key: factor * getattr(rig.camera, key) for key in ("fx_px", "fy_px")}
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=lens)})


@pytest.fixture(scope="module", params=[("aqua2", 1), ("torpedo", 1), ("bluerov2", 1), ("aqua2", 3)], ids=str)
def rig_and_fine(request) -> tuple[Rig, float]:
    """A rig without parts, and what it covers with steps of one degree."""
    rig = longer_lens(*request.param)
    q1, q2 = stepped_joints(rig, FINE_DEG)
    return rig, float(covered_cells(rig, [], q1=q1, q2=q2, nside=2 * NSIDE).mean())


@pytest.mark.parametrize("step_deg", [16.0, 8.0, 4.0, 2.0])
def test_the_range_holds_what_finer_grids_find(rig_and_fine, step_deg):
    rig, fine = rig_and_fine
    q1, q2 = stepped_joints(rig, step_deg)
    coarse = compute_coverage(rig, [], q1=q1, q2=q2, columns=4, rows=4, nside=NSIDE)
    found = covered_range(rig, [], coarse)
    print(f"{coarse.covered_fraction:.2%} {found=} {fine=:.2%}")
    assert found.low <= fine <= found.high
    assert found.low <= coarse.covered_fraction <= found.half_step_fraction <= found.high
    # A range that says nothing would hold anything: from four degrees on it is a few percent wide.
    assert found.high - found.low < {16.0: 1.0, 8.0: 1.0, 4.0: 0.03, 2.0: 0.015}[step_deg]


def test_half_the_steps_see_what_the_whole_grid_of_them_sees():
    """Looked at in blind cells only, and so in few families of cells."""
    rig = Rig.load("aqua2")
    q1, q2 = stepped_joints(rig, 8.0)
    coarse = compute_coverage(rig, [], q1=q1, q2=q2, columns=4, rows=4, nside=NSIDE)
    halved = (np.sort(np.concatenate([q, (q[1:] + q[:-1]) / 2])) for q in (q1, q2))
    expected = compute_coverage(rig, [], **dict(zip(("q1", "q2"), halved, strict=True)), columns=4, rows=4, nside=NSIDE)
    assert covered_range(rig, [], coarse).half_step_fraction == pytest.approx(expected.covered_fraction, abs=1e-12)
