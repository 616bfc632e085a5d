"""Materials: sourced spectra, and colour factors that stay reflectances."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.mesh import Group, PartMesh, Role
from rigs.mounting import Colour
from scenes.light.materials import PATCHES, Material, albedo_table, colour_basis, material_of
from scenes.light.spectrum import Bands, camera_bands

WAVELENGTH_NM = np.linspace(350.0, 750.0, 81)


def test_every_material_but_the_users_own_has_a_measured_patch():
    assert set(Material) - set(PATCHES) == {Material.COLOURED}
    table = albedo_table()
    assert table.shape == (len(Material), len(camera_bands().wavelength_nm))
    assert (table[Material.COLOURED] == 1).all()
    assert (table > 0).all()
    assert (table <= 1).all()


def test_every_colour_of_a_mount_has_a_material():
    """Each its own; without a colour a part has that of its role, which for what is printed is grey."""
    triangle = {"vertices_m": np.eye(3), "faces": np.array([[0, 1, 2]], dtype=np.int32)}
    plain = PartMesh(name="yoke", group=Group.PAN, role=Role.MOUNT, **triangle)
    materials = [material_of(replace(plain, colour=colour)) for colour in get_args(Colour)]
    assert len(set(materials)) == len(get_args(Colour))
    assert material_of(plain) is material_of(replace(plain, colour="grey")) is Material.PRINT_GREY


def test_the_ball_is_the_red_patch_of_the_chart():
    """BabelColor average of 30 charts, patch red at 600 and 650 nm: 0.178 and 0.675 (colour-science 0.4.7)."""
    bands = Bands(wavelength_nm=np.array([600.0, 650.0]), weight=np.ones((3, 2)) / 2)
    np.testing.assert_allclose(albedo_table(bands)[Material.TARGET], [0.178, 0.675], atol=1e-12)


def test_colour_factors_of_one_leave_the_material_as_it_was_measured():
    np.testing.assert_allclose(colour_basis(WAVELENGTH_NM).sum(axis=0), 1.0, rtol=1e-15)


def test_a_channel_is_governed_by_its_own_factor():
    """Red factors colour red pixels: in each band its own part weighs more than both others together.

    Not more: the ends of green's band (488 and 592 nm, a third of its weight) lie in blue and in red.
    """
    bands = camera_bands()
    share = bands.weight @ colour_basis(bands.wavelength_nm).T
    assert (2 * np.diag(share) > share.sum(axis=1)).all()


@given(st.lists(st.floats(0, 1), min_size=3, max_size=3), st.floats(300, 900))
def test_factors_of_at_most_one_keep_a_reflectance(factors, wavelength_nm):
    """Positive parts that add up to 1: their mixture lies between its factors."""
    value = np.array(factors) @ colour_basis([wavelength_nm])[:, 0]
    assert min(factors) - 1e-12 <= value <= max(factors) + 1e-12


def test_unknown_parts_of_the_spectrum_are_far_ends_of_red_and_blue():
    ends = colour_basis([100.0, 1000.0])
    assert ends[:, 0] == pytest.approx([0, 0, 1], abs=1e-12)
    assert ends[:, 1] == pytest.approx([1, 0, 0], abs=1e-12)
