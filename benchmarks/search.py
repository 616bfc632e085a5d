"""Designs scored per second by the design search, beside the same scores from the coverage analysis, one by one."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from cad.assembly.meshes import rig_meshes
from optics.coverage.coverage import compute_coverage
from optics.layout import Layout
from optics.mesh import Group, Role
from optics.search.objectives import OBJECTIVES, design_of, rig_with
from optics.search.score import CoarseScorer, Grid
from optics.sizing.trade_off import plate_part
from rigs import Rig

RIG = "aqua2"
DESIGNS = 1000
PEER_DESIGNS = 10


def run() -> list[dict[str, Any]]:
    """One row: designs per second, on the same poses, rays and sphere."""
    rig = Rig.load(RIG)
    hull = [part for part in rig_meshes(rig) if part.role is Role.HULL]
    designs = np.round(design_of(rig) * np.random.default_rng(0).uniform(0.75, 1.4, (DESIGNS, 6)), 1)
    objectives, grid = tuple(OBJECTIVES.values()), Grid()
    scorer = CoarseScorer(rig, hull, grid)
    scorer.scores(designs[:64], objectives)
    start = time.perf_counter()
    scores = scorer.scores(designs, objectives)
    ours = DESIGNS / (time.perf_counter() - start)
    q1, q2 = rig.gaze.joints.pan.values(grid.pan_steps), rig.gaze.joints.tilt.values(grid.tilt_steps)

    def alone(design: np.ndarray) -> float:
        built = rig_with(rig, design)
        plate = plate_part("m1", built.gaze.fold_mirror, Layout.from_rig(built).body_from_m1, Group.FIXED)
        size = {"columns": grid.columns, "rows": grid.rows, "nside": grid.nside}
        return compute_coverage(built, [*hull, plate], q1=q1, q2=q2, **size).covered_fraction

    alone(designs[0])
    start = time.perf_counter()
    covered = [alone(design) for design in designs[:PEER_DESIGNS]]
    peer = PEER_DESIGNS / (time.perf_counter() - start)
    off = float(np.abs(scores[:PEER_DESIGNS, 0] - covered).max())
    return [
        {
            "name": f"search, {DESIGNS} designs x {grid.poses} poses x {grid.rays} rays, hull in the way",
            "ours": ours,
            "peer": peer,
            "unit": "designs/s",
            "ratio": ours / peer,
            "note": f"peer: our coverage, one by one, on the same grid; covered shares differ by at most {off:.3f}",
        }
    ]
