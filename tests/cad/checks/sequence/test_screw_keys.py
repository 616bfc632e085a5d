"""Keys on screws: a lid over the head stops the long arm, then the short one; walls around stop the swing."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest

from cad.assembly.assembly import Part
from cad.checks.sequence.screw_keys import KEYS_MM, is_screw, key_blockers, screw_of
from cad.parts.hardware import SCREW_SIZES, along, cap_screw
from optics.mesh import Group, Role

_, LONG, SHORT = KEYS_MM[3.0]


def screw_at(thread="M3", place=(0, 0, 0), axis=(0, 0, 1)):
    solid = cap_screw(thread, 10).shape.moved(along(place, axis))
    return Part(name="screw", group=Group.PAN, role=Role.HARDWARE, make=lambda: solid)


def block(low, high):
    """A box in millimetres, as a body in metres."""
    return manifold3d.Manifold.cube(np.subtract(high, low) / 1000).translate(np.array(low) / 1000)


@pytest.mark.parametrize("thread", list(SCREW_SIZES))
def test_a_screw_is_read_off_its_solid(thread):
    """A cap screw with its head on (1, 2, 3), looking along (0, -1, 0): its top is a thread's width above."""
    part = screw_at(thread, (1, 2, 3), (0, -1, 0))
    screw, size = screw_of(part), float(thread[1:])
    assert is_screw(part)
    assert screw.thread_mm == size
    assert size in KEYS_MM
    assert screw.outwards == pytest.approx([0, -1, 0], abs=1e-9)
    assert screw.top_mm == pytest.approx([1, 2 - size, 3], abs=1e-6)


@pytest.mark.parametrize(
    ("height", "hit"),
    [(LONG + 4, set()), (LONG - 4, {"long arm"}), (SHORT + 4, {"long arm"}), (SHORT - 4, {"long arm", "short arm"})],
)
def test_a_lid_over_a_screw_stops_the_arm_that_is_longer_than_its_height(height, hit):
    """The head of the screw is 3 mm high."""
    lid = block((-80, -80, 3 + height), (80, 80, 5 + height))
    assert set(key_blockers(screw_of(screw_at()), np.eye(4), {"lid": lid})) == hit


def test_a_key_needs_sixty_degrees_for_its_other_arm():
    """In a trench 8 mm wide and higher than the key's short arm only the long arm's handle, above it, can swing."""
    trench = block((-80, 4, 0), (80, 80, 40)) + block((-80, -80, 0), (80, -4, 40))
    assert set(key_blockers(screw_of(screw_at()), np.eye(4), {"trench": trench})) == set()
    deep = block((-80, 4, 0), (80, 80, 80)) + block((-80, -80, 0), (80, -4, 80))
    hit = key_blockers(screw_of(screw_at()), np.eye(4), {"trench": deep})
    assert hit == {"long arm": "trench", "short arm": "trench"}


def test_the_key_is_where_the_screw_s_frame_is():
    pose = np.eye(4)
    pose[:3, 3] = (0.2, 0, 0)
    lid = block((-10, -10, 6), (10, 10, 8))
    assert len(key_blockers(screw_of(screw_at()), np.eye(4), {"lid": lid})) == 2
    assert key_blockers(screw_of(screw_at()), pose, {"lid": lid}) == {}
