"""Convex pieces hold their part, are convex, and few."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import trimesh

from cad.assembly.closed_body import closed_body
from cad.export.robot.convex import MOST_PIECES, convex_pieces
from optics.mesh import Group, PartMesh, Role

ROUNDING = 1e-6
"""Of a volume: the pieces are cut and joined again in double precision."""


def part(surface: trimesh.Trimesh) -> PartMesh:
    return PartMesh(
        name="piece",
        group=Group.FIXED,
        role=Role.MOUNT,
        vertices_m=np.asarray(surface.vertices, dtype=np.float64),
        faces=np.asarray(surface.faces, dtype=np.int32),
    )


def test_a_box_is_one_piece_of_its_own_volume():
    (piece,) = convex_pieces(part(trimesh.creation.box(extents=(0.1, 0.2, 0.3))))
    assert piece.volume == pytest.approx(0.006)


def test_an_l_is_two_pieces_without_waste():
    """Its bars end at multiples of a tenth of its size, where cuts are tried."""
    upright = manifold3d.Manifold.cube((0.1, 0.1, 1.0))
    foot = manifold3d.Manifold.cube((1.0, 0.1, 0.1))
    mesh = (upright + foot).to_mesh64()
    pieces = convex_pieces(part(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)))
    assert sum(piece.volume for piece in pieces) == pytest.approx(0.019)
    assert len(pieces) == 2


def test_pieces_hold_the_part_and_little_else(aqua2):
    for mesh in aqua2.meshes:
        if mesh.role is Role.HULL:
            continue
        pieces = convex_pieces(mesh)
        body = closed_body(mesh)
        held = manifold3d.Manifold.batch_boolean([closed_body(part(piece)) for piece in pieces], manifold3d.OpType.Add)
        assert (body - held).volume() < ROUNDING * body.volume(), mesh.name
        assert all(piece.is_convex for piece in pieces), mesh.name
        assert len(pieces) <= MOST_PIECES


def test_an_open_surface_is_refused():
    box = trimesh.creation.box()
    box.update_faces(np.arange(len(box.faces)) > 0)
    with pytest.raises(ValueError, match="piece: expected a closed surface"):
        convex_pieces(part(box))
