"""Where the groups of parts are for given joint values; light, so that cached meshes can be posed at once."""

from __future__ import annotations

from scipy.spatial.transform import RigidTransform

from optics.layout import Layout
from optics.mesh import Group


def body_from_group(layout: Layout, group: Group, q1: float, q2: float) -> RigidTransform:
    """Pose of a group's frame in the body frame, metres; joint values in radians."""
    if group is Group.FIXED:
        return RigidTransform.identity()
    if group is Group.PAN:
        return layout.body_from_pan(q1)
    return layout.body_from_m2(q1, q2)
