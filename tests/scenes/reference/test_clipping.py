"""Open surfaces without what lies in a convex body."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import trimesh

from scenes.reference.clipping import FINEST, outside_of


def test_a_round_hole_in_a_sheet_has_its_area():
    """A cylinder of radius r goes through a sheet: it takes pi r^2, and a rim no wider than `FINEST` of its side."""
    sheet = trimesh.Trimesh([[0, 0, 0], [100, 0, 0], [100, 60, 0], [0, 60, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    radius = 11.0
    drill = manifold3d.Manifold.cylinder(10, radius, circular_segments=256, center=True).translate((40, 30, 0))
    removed = sheet.area - outside_of(sheet, drill).area
    rim = FINEST * 2 * radius
    assert np.pi * radius**2 * 0.999 < removed < np.pi * (radius + rim) ** 2
    far = np.linalg.norm(outside_of(sheet, drill).vertices[:, :2] - [40, 30], axis=1)
    assert far.min() > radius * np.cos(np.pi / 256)


def test_what_a_body_does_not_reach_stays_and_what_it_holds_goes():
    ball = trimesh.creation.icosphere(1, radius=10)
    assert outside_of(ball, manifold3d.Manifold.sphere(3, 16)).area == pytest.approx(ball.area)
    assert not len(outside_of(ball, manifold3d.Manifold.cube((30, 30, 30), center=True)).faces)
