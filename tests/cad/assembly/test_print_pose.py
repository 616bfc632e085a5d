"""Print poses in closed form: tables stand on their tops, plates lie flat, what is too long lies along the bed."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cad.assembly.print_pose import overhang_base_support, print_orientation, print_pose
from optics.mesh import Group, PartMesh, Role
from rigs import Mount

DOWN = np.array([0.0, 0.0, -1.0])
MOUNT = Mount(fold_anchor_mm=(0, 0, 0), base_anchor_mm=(0, 0, 0))
ROUNDING_MM2 = 1e-6
"""Double precision on areas of thousands of square millimetres."""


def part(surface):
    return PartMesh(
        name="part",
        group=Group.FIXED,
        role=Role.MOUNT,
        vertices_m=np.asarray(surface.vertices) / 1000,
        faces=np.asarray(surface.faces, dtype=np.int32),
    )


def block(size, centre):
    return trimesh.creation.box(extents=size, transform=trimesh.transformations.translation_matrix(centre))


def table():
    """A top of 80 x 60 x 4 mm on a foot of 10 x 10 x 30 mm."""
    return trimesh.boolean.union([block((80, 60, 4), (0, 0, 32)), block((10, 10, 31), (0, 0, 15.5))])


def test_a_table_overhangs_by_its_top_less_its_foot():
    surface = table()
    overhang, base, support = overhang_base_support(np.asarray(surface.vertices), surface.faces, DOWN)
    assert overhang == pytest.approx(80 * 60 - 10 * 10, abs=ROUNDING_MM2)
    assert base == pytest.approx(10 * 10, abs=ROUNDING_MM2)
    assert support == pytest.approx((80 * 60 - 10 * 10) * 30, abs=ROUNDING_MM2 * 30)


@pytest.mark.parametrize(("lean_deg", "counts"), [(44.0, False), (46.0, True)])
def test_a_wall_counts_once_it_leans_by_more_than_45_degrees(lean_deg, counts):
    """A prism whose one side leans out: that side is 20 / cos(lean) mm long and 10 mm wide."""
    reach = 20 * np.tan(np.radians(lean_deg))
    outline = np.array([[0, 0], [10, 0], [10 + reach, 20], [0, 20]])
    corners = np.array([[x, y, z] for x, z in outline for y in (0.0, 10.0)])
    hull = trimesh.convex.convex_hull(corners)
    overhang, _, _ = overhang_base_support(np.asarray(hull.vertices), hull.faces, DOWN)
    expected = 10 * 20 / np.cos(np.radians(lean_deg)) if counts else 0.0
    assert overhang == pytest.approx(expected, abs=ROUNDING_MM2)


@given(st.integers(0, 2**32 - 1))
def test_a_table_is_laid_on_its_top_whatever_frame_it_comes_in(seed):
    turn = Rotation.random(rng=np.random.default_rng(seed))
    surface = table()
    surface.vertices = turn.apply(surface.vertices)
    pose = print_pose(part(surface), MOUNT)
    assert pose.bed_from_part.apply(turn.apply([0, 0, 1])) == pytest.approx([0, 0, -1], abs=1e-6)
    assert pose.size_mm == pytest.approx([80, 60, 34], abs=1e-6)
    assert (pose.overhang_mm2, pose.base_mm2) == pytest.approx((0, 4800), abs=1e-5)
    assert pose.fits and pose.firm


def test_a_part_that_only_fits_upright_or_across_is_laid_so():
    tall = part(trimesh.creation.box(extents=(20, 30, 240)))
    size = print_pose(tall, MOUNT).size_mm
    assert size == pytest.approx([240, 30, 20], abs=1e-6)
    narrow = MOUNT.model_copy(update={"printer_bed_mm": (100.0, 245.0, 100.0)})
    across = print_orientation(tall, narrow)
    assert np.ptp(across.apply(1000 * tall.vertices_m), axis=0) == pytest.approx([30, 240, 20], abs=1e-6)
    column = MOUNT.model_copy(update={"printer_bed_mm": (100.0, 100.0, 250.0)})
    assert print_pose(tall, column).size_mm[2] == pytest.approx(240, abs=1e-6)


def test_what_fits_no_way_says_so():
    assert not print_pose(part(trimesh.creation.box(extents=(300, 300, 300))), MOUNT).fits


def test_the_presets_printed_parts_fit_and_stand_firmly(built):
    for mesh in built.meshes:
        if mesh.role is Role.MOUNT:
            pose = print_pose(mesh, built.rig.gaze.mount)
            assert pose.fits, mesh.name
            assert pose.firm, mesh.name
