"""Stiffness of solids made of cubes, beside beams and rods."""

import numpy as np
import pytest
import trimesh

from cad.loads.voxels import POISSON_RATIO, _unit_stiffness, condensed_stiffness, voxelise

E = 2e9


def bar(length, width, height, edge):
    box = trimesh.creation.box((length, width, height))
    box.apply_translation((length / 2, 0, 0))
    return voxelise(np.array(box.vertices), np.array(box.faces, dtype=np.int32), edge)


def stiffness_of(voxels, length):
    near = voxels.edge_m / 10
    return condensed_stiffness(
        voxels,
        E,
        held=lambda p: p[:, 0] < near,
        loaded=lambda p: p[:, 0] > length - near,
        point_m=np.array([length, 0.0, 0.0]),
    )


def timoshenko(length, width, height):
    """Deflection per force at the end of a cantilever: bending, and shear with the coefficient 5/6."""
    shear = E / (2 * (1 + POISSON_RATIO))
    return length**3 / (3 * E * width * height**3 / 12) + length / (5 / 6 * shear * width * height)


def test_a_cube_resists_neither_moves_nor_turns_and_nothing_else():
    eigenvalues = np.linalg.eigvalsh(_unit_stiffness())
    np.testing.assert_allclose(eigenvalues[:6], 0, atol=1e-12)
    assert eigenvalues[6] > 1e-2


def test_a_box_is_filled_exactly():
    voxels = bar(0.06, 0.01, 0.01, 0.0025)
    assert voxels.fill.sum() * voxels.edge_m**3 == pytest.approx(6e-6, rel=1e-12)


@pytest.mark.parametrize("cubes", [1, 2, 4])
def test_a_cantilever_bends_as_a_beam_does(cubes):
    """Even one cube thick, within 4 %; both ends are clamped flat, which a beam's theory does not know."""
    length, side = 0.096, 0.008
    compliance = np.linalg.inv(stiffness_of(bar(length, side, side, side / cubes), length))
    assert compliance[2, 2] == pytest.approx(timoshenko(length, side, side), rel=0.04)
    assert compliance[1, 1] == pytest.approx(compliance[2, 2], rel=1e-9)
    # The end turns by L^2 / (2 E I) under a unit force.
    assert -compliance[4, 2] == pytest.approx(length**2 / (2 * E * side**4 / 12), rel=0.04)


def test_a_rod_stretches_by_its_length_over_its_section():
    """Clamped ends hold the section from shrinking: a little stiffer than L / (E A), by less than 4 %."""
    length, side = 0.1, 0.008
    compliance = np.linalg.inv(stiffness_of(bar(length, side, side, side / 2), length))
    rod = length / (E * side**2)
    assert 0.96 * rod < compliance[0, 0] < rod


def test_a_part_filled_layer_counts_by_its_part():
    """8 mm of height in cubes of 3 mm: three layers, the outer two filled by 5/6; stiffness within 15 %."""
    length, side = 0.09, 0.008
    compliance = np.linalg.inv(stiffness_of(bar(length, side, side, 0.003), length))
    assert compliance[2, 2] == pytest.approx(timoshenko(length, side, side), rel=0.15)


def test_patches_that_hold_nothing_are_refused():
    voxels = bar(0.02, 0.01, 0.01, 0.005)
    with pytest.raises(ValueError, match="held patch, got 0"):
        condensed_stiffness(
            voxels,
            E,
            held=lambda p: np.zeros(len(p), dtype=bool),
            loaded=lambda p: p[:, 0] > 0.019,
            point_m=np.zeros(3),
        )
    with pytest.raises(ValueError, match="thicker than 50 mm"):
        sheet = trimesh.creation.box((0.001, 0.001, 0.0001))
        voxelise(np.array(sheet.vertices), np.array(sheet.faces, dtype=np.int32), 0.05)
