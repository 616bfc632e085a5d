"""From the rig file over the mount's meshes to the sphere: what the presets see with their own mount in the way."""

from __future__ import annotations

import numpy as np
import pytest

from cad.assembly.meshes import rig_meshes
from optics.coverage.coverage import compute_coverage
from optics.coverage.outcome import BLOCKERS, Outcome
from optics.layout import Layout
from optics.mesh import Role
from rigs import Rig


@pytest.mark.parametrize("name", ["aqua2", "bluerov2"])
def test_presets_see_most_of_the_sphere_past_their_mount(name: str) -> None:
    """Coverage of a preset with and without its own parts.

    Rationale: the rays, the solids and the rig file have to agree on where everything is. A mirror's plate that is
    off by a tenth of a millimetre would blind the rig or block nothing.
    Expected: at a horizontal gaze the mount takes at most a tenth of what the bare mirrors show; at the zenith the
    camera hits its own fold mirror; parts only ever take from the view; at least four fifths of the sphere are seen.
    """
    rig = Rig.load(name)
    layout = Layout.from_rig(rig)
    parts = rig_meshes(rig)
    q1 = layout.pan.values(32)
    q2 = np.radians(np.sort([0.0, 45.0, *np.linspace(layout.tilt.min_deg, layout.tilt.max_deg, 30)]))
    bare, built = (compute_coverage(rig, kept, q1=q1, q2=q2, nside=16) for kept in ([], parts))
    horizontal, zenith = (int(np.abs(np.degrees(q2) - angle).argmin()) for angle in (0.0, 45.0))
    middle = len(q1) // 2
    assert (built.pixels[..., Outcome.SEEN] <= bare.pixels[..., Outcome.SEEN]).all()
    assert built.solid_angle_sr[horizontal, middle] > 0.9 * bare.solid_angle_sr[horizontal, middle]
    assert built.pixels[zenith, middle, Outcome.MIRROR_PLATE] > 0
    assert (built.poses_seeing <= bare.poses_seeing).all()
    assert 0.8 < built.covered_fraction < bare.covered_fraction


def test_each_part_takes_its_share() -> None:
    rig = Rig.load("aqua2")
    parts = rig_meshes(rig)
    grid = {"q1": np.radians(np.linspace(-77, 77, 16)), "q2": np.radians(np.linspace(-32, 122, 16))}
    lost = {}
    for role, outcomes in (
        (Role.HULL, [Outcome.HULL]),
        (Role.MOUNT, [Outcome.FOLD_BRACKET, Outcome.MOUNT]),
        (Role.SERVO, [Outcome.SERVO]),
        (Role.MIRROR, [Outcome.MIRROR_PLATE]),
    ):
        alone = compute_coverage(rig, [part for part in parts if part.role is role], **grid).pixels
        assert alone[..., list(BLOCKERS)].sum() == alone[..., outcomes].sum()
        outcome = outcomes[0]
        lost[outcome] = alone[..., outcome].sum()
    together = compute_coverage(rig, parts, **grid).pixels
    # The first part in the way takes the blame, so that together each takes at most what it takes alone.
    assert 0 < together[..., Outcome.HULL].sum() <= lost[Outcome.HULL]
    assert 0 < together[..., Outcome.MIRROR_PLATE].sum() <= lost[Outcome.MIRROR_PLATE]
