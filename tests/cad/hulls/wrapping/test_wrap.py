"""Wraps of boxes, sheets, shells, fins and random soups of them: closed, around all of it, and near.

On grids of 40 cells along the longest side, where a tenth of a second is enough.
"""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from cad.hulls.mesh_repair import NotClosedError, manifold
from cad.hulls.wrapping import fit, solid_field
from cad.hulls.wrapping.bodies import kept_bodies
from cad.hulls.wrapping.fit import GAP, check_that_it_stays_out_of_itself
from cad.hulls.wrapping.solid_field import OFFSET, SolidField
from cad.hulls.wrapping.wrap import Wrap, wrapped
from optics.kernels.crossings import MISSED, CrossedSurface

CELLS = 40


@pytest.fixture(autouse=True, scope="module")
def coarse_grid():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solid_field, "CELLS_ALONG", CELLS)
        yield


def sheet(length: float, width: float) -> trimesh.Trimesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [length / 2, width / 2, 0]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def pipe(length: float, radius: float) -> trimesh.Trimesh:
    """Cylinder without ends."""
    whole = trimesh.creation.cylinder(radius=radius, height=length, sections=24)
    return trimesh.Trimesh(whole.vertices, whole.faces[np.abs(whole.face_normals[:, 2]) < 0.5], process=False)


def bowl(radius: float, opening_deg: float) -> trimesh.Trimesh:
    """Ball without what is within an angle of its top."""
    ball = trimesh.creation.icosphere(3, radius=radius)
    keep = ball.triangles_center[:, 2] < radius * np.cos(np.radians(opening_deg))
    return trimesh.Trimesh(ball.vertices, ball.faces[keep], process=False)


def cell_of(mesh: trimesh.Trimesh) -> float:
    return float(mesh.extents.max()) / CELLS


def places_on(mesh: trimesh.Trimesh, count: int = 100) -> np.ndarray:
    rng = np.random.default_rng(1)
    corners = np.asarray(mesh.triangles)[rng.choice(len(mesh.faces), count, p=mesh.area_faces / mesh.area)]
    return np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), count), corners)


def turns(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Exact winding numbers."""
    return np.asarray(igl.winding_number(np.array(mesh.vertices), np.array(mesh.faces), np.ascontiguousarray(points)))


def check_solid(found: Wrap) -> None:
    """Closed and manifold; 0 turns just outside of it, and 1 just inside, as only a surface without crossings has."""
    surface = found.surface
    assert surface.is_watertight and surface.is_winding_consistent and surface.volume > 0
    assert manifold(np.asarray(surface.vertices), np.asarray(surface.faces)) is not None
    check_that_it_stays_out_of_itself(surface)
    large = np.argsort(surface.area_faces)[-50:]
    step = 1e-5 * surface.extents.max() * surface.face_normals[large]
    for side, inside in ((1, 0), (-1, 1)):
        assert turns(surface, surface.triangles_center[large] + side * step) == pytest.approx(inside, abs=1e-6)


def check_holds(found: Wrap, given_surface: trimesh.Trimesh) -> None:
    assert turns(found.surface, places_on(given_surface)) == pytest.approx(1, abs=1e-6)


def test_a_box_is_held_and_hardly_larger():
    """Sides of 600, 200 and 100 mm: each comes out by the gap that is left, but along the edges."""
    box = trimesh.creation.box(extents=(600, 200, 100))
    found = wrapped(box)
    check_solid(found)
    check_holds(found, box)
    assert found.median == pytest.approx(GAP * cell_of(box), rel=0.1)
    assert box.volume < found.surface.volume < box.volume + OFFSET * cell_of(box) * box.area / 4
    assert (found.left_out, found.bars, found.bodies) == ((), (), 1)


def test_a_sheet_becomes_a_thin_solid():
    """Not thicker than what it is drawn to on both sides, but for its rim."""
    flat = sheet(300, 200)
    found = wrapped(flat)
    check_solid(found)
    check_holds(found, flat)
    rim = 2 * (300 + 200) * (2 * OFFSET * cell_of(flat)) ** 2
    assert found.surface.volume < 2 * GAP * cell_of(flat) * flat.area * 1.1 + rim


@pytest.mark.parametrize("opening_deg", [10.0, 45.0])
def test_a_shell_with_an_opening_is_full(opening_deg):
    """Its volume is that of the ball without the cap beyond the opening's rim, or more."""
    shell = bowl(100, opening_deg)
    found = wrapped(shell)
    check_solid(found)
    check_holds(found, shell)
    height = 100 * (1 - np.cos(np.radians(opening_deg)))
    ball, cap = 4 / 3 * np.pi * 100**3, np.pi * height**2 * (100 - height / 3)
    assert 0.97 * (ball - cap) < found.surface.volume < 1.03 * ball


def test_a_pipe_open_at_both_ends_is_full():
    tube = pipe(300, 40)
    found = wrapped(tube)
    check_solid(found)
    assert found.surface.volume > 0.9 * np.pi * 40**2 * 300


def test_a_thin_fin_stays_thin():
    """A fin of 1 mm on a box, a fifth of a cell: it is held, and the room beside it stays open."""
    body, fin = trimesh.creation.box(extents=(300, 80, 80)), trimesh.creation.box(extents=(60, 1, 80))
    fin.apply_translation((-100, 0, 70))
    both = trimesh.util.concatenate([body, fin])
    found = wrapped(both)
    check_solid(found)
    check_holds(found, both)
    beside = np.array([[-100, side * 1.5 * cell_of(both), z] for side in (-1, 1) for z in (60, 80, 100)])
    assert turns(found.surface, beside) == pytest.approx(0, abs=1e-6)


def test_triangles_that_face_both_ways_make_the_same_solid():
    ball = trimesh.creation.icosphere(3, radius=100)
    mixed = trimesh.Trimesh(
        ball.vertices, np.where(np.arange(len(ball.faces))[:, None] % 2, ball.faces, ball.faces[:, ::-1])
    )
    assert wrapped(mixed).surface.volume == pytest.approx(wrapped(ball).surface.volume, rel=1e-3)


def test_bodies_are_kept_joined_or_left(monkeypatch):
    """Boxes of 300 and 100 mm that are 60 mm apart, and a cube of 2 mm, which is less than a fiftieth."""
    monkeypatch.setattr(solid_field, "CELLS_ALONG", 2 * CELLS)
    large, small = trimesh.creation.box(extents=(300, 80, 80)), trimesh.creation.box(extents=(100, 60, 60))
    small.apply_translation((260, 0, 0))
    crumb = trimesh.creation.box(extents=(2, 2, 2))
    crumb.apply_translation((0, 100, 0))
    soup = trimesh.util.concatenate([large, small, crumb])
    cell = cell_of(soup) / 2
    found = {keep: wrapped(soup, keep) for keep in ("all", "joined", "largest")}
    assert {keep: wrap.bodies for keep, wrap in found.items()} == {"all": 2, "joined": 1, "largest": 1}
    for wrap in found.values():
        check_solid(wrap)
        check_holds(wrap, large)
    for keep in ("all", "joined"):
        check_holds(found[keep], small)
        (left_out,) = found[keep].left_out
        assert left_out.side == pytest.approx(2, abs=cell)
        assert left_out.middle == pytest.approx((0, 100, 0), abs=cell)
    assert found["joined"].bars == pytest.approx([60 - 2 * OFFSET * cell], abs=2 * cell)
    assert found["largest"].surface.bounds[1, 0] < 150 + OFFSET * cell
    assert [round(part.middle[0]) for part in found["largest"].left_out] == pytest.approx([260, 0], abs=cell)


def test_a_surface_in_tatters_gets_a_coarser_grid_and_not_more_triangles(monkeypatch):
    """A ball of which a third of the triangles are missing, as if no simpler wrap could be found for it."""
    ball = trimesh.creation.icosphere(3, radius=100.0)
    tatters = trimesh.Trimesh(ball.vertices, ball.faces[np.arange(len(ball.faces)) % 3 > 0], process=False)
    fine = wrapped(tatters)
    monkeypatch.setattr(fit, "MOST_TRIANGLES", 1500)
    monkeypatch.setattr(fit, "LARGEST_TOLERANCE", 0.0)
    coarse = wrapped(tatters)
    assert len(coarse.surface.faces) <= 2 * 1500 < len(fine.surface.faces)
    assert coarse.closed > 1.4 * fine.closed
    check_solid(coarse)
    check_holds(coarse, tatters)


def test_a_body_of_one_node_that_is_left_out_has_a_size():
    """What a surface winds around without being near is not grown by the offset: nothing is smaller than a cell."""
    values = np.ones((30, 12, 12), dtype=np.float32)
    values[2:20, 3:9, 3:9] = -1
    values[26, 6, 6] = -1
    found = kept_bodies(SolidField(low=np.zeros(3), cell=2.0, values=values), "largest")
    (small,) = found.left_out
    assert small.side == pytest.approx(2.0)


def hit_heights(mesh: trimesh.Trimesh, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Height at which vertical lines hit a surface first; NaN where they miss it."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    face = CrossedSurface.of(vertices, faces).first(start, end)
    heights, hit = np.full(len(start), np.nan), face != MISSED
    corner, normal = vertices[faces[face[hit], 0]], mesh.face_normals[face[hit]]
    heights[hit] = corner[:, 2] + ((corner - start[hit])[:, :2] * normal[:, :2]).sum(axis=1) / normal[:, 2]
    return heights


def test_rays_hit_triangles_and_solid_alike_but_in_an_opening():
    """Vertical rays at a bowl of 100 mm that opens upwards, 71 mm wide each side of its axis, its rim at 71 mm.

    From below the two are hit alike. From above the triangles are hit beside the opening, and through it at the bottom,
    from within; the solid there closes the opening near the level of its rim.
    """
    shell = bowl(100, 45.0)
    solid, near = wrapped(shell).surface, cell_of(shell)
    rng = np.random.default_rng(2)
    above = np.column_stack([rng.uniform(-130, 130, (4000, 2)), np.full(4000, 300.0)])
    below = above * [1, 1, -1]
    across = np.linalg.norm(above[:, :2], axis=1)
    rising = [hit_heights(mesh, below, above) for mesh in (shell, solid)]
    falling = [hit_heights(mesh, above, below) for mesh in (shell, solid)]
    for heights in (*rising, *falling):
        assert np.isnan(heights[across > 100 + near]).all()
        assert not np.isnan(heights[across < 98]).any()
    beside, entering = (across > 76) & (across < 90), across < 55
    assert rising[0][across < 90] == pytest.approx(rising[1][across < 90], abs=2 * near)
    assert falling[0][beside] == pytest.approx(falling[1][beside], abs=2 * near)
    assert (falling[0][entering] < -80).all()
    assert (falling[1][entering] > 60).all()


def test_a_box_dented_through_itself_is_found_out():
    box = trimesh.creation.box(extents=(600, 200, 100)).subdivide().subdivide().subdivide()
    check_that_it_stays_out_of_itself(box)
    x, y, z = box.vertices.T
    box.vertices[(z > 49) & (abs(x) < 160) & (abs(y) < 60), 2] = -150
    with pytest.raises(NotClosedError, match=r"\d+ of its edges going through itself"):
        check_that_it_stays_out_of_itself(box)
    found = wrapped(box)
    check_solid(found)
    check_holds(found, box)


PRIMITIVES = {
    "box": lambda a, b: trimesh.creation.box(extents=(a, b, 0.6 * b)),
    "ball": lambda a, b: trimesh.creation.icosphere(2, radius=b / 2),
    "pipe": lambda a, b: pipe(a, b / 2),
    "sheet": sheet,
}


@st.composite
def soups(draw) -> tuple[trimesh.Trimesh, bool]:
    """One to four primitives anywhere, at any angle, facing either way; and whether all of them are closed."""
    pieces, kinds = [], draw(st.lists(st.sampled_from(sorted(PRIMITIVES)), min_size=1, max_size=4))
    for kind in kinds:
        piece = PRIMITIVES[kind](draw(st.floats(60, 200)), draw(st.floats(30, 120)))
        turn = trimesh.transformations.euler_matrix(*(draw(st.floats(0, 6)) for _ in range(3)))
        turn[:3, 3] = [draw(st.floats(-120, 120)) for _ in range(3)]
        piece.apply_transform(turn)
        if draw(st.booleans()):
            piece.invert()
        pieces.append(piece)
    return trimesh.util.concatenate(pieces), set(kinds) <= {"box", "ball"}


@settings(max_examples=8, deadline=None, derandomize=True)
@given(soups())
def test_any_soup_is_held_by_a_solid(drawn):
    """All of it; and where nothing is open the wrap is nowhere further away than a corner of the first wrap can be."""
    soup, is_closed = drawn
    found = wrapped(soup)
    check_solid(found)
    check_holds(found, soup)
    assert found.median <= OFFSET * cell_of(soup)
    if is_closed:
        corners = np.ascontiguousarray(found.surface.vertices[::20])
        square, _, _ = igl.point_mesh_squared_distance(corners, np.array(soup.vertices), np.array(soup.faces))
        assert np.sqrt(square.max()) < 2 * OFFSET * cell_of(soup)
