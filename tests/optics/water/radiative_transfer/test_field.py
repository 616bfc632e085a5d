"""The radiance field: its tables against the solution they sample, its parts, its cache and its bad arguments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from optics.water.inherent_optics import InherentOptics, inherent_optics
from optics.water.radiative_transfer import radiance_field
from optics.water.radiative_transfer.column import (
    WINDOW_STREAMS,
    multiple_radiance,
    once_radiance,
    sky_radiance,
    solve_columns,
)
from optics.water.radiative_transfer.field import RADIANCE_VERSION
from optics.water.radiative_transfer.line_of_sight import scattering_angle
from rigs import Water

WAVELENGTHS = np.array([480.0, 600.0])
SKY = 0.05
SUN = np.array([1.0, 0.9])


def even_sky(cosine):
    return np.full((len(WAVELENGTHS), len(cosine)), SKY)


@pytest.fixture(scope="module")
def optics():
    return inherent_optics(Water(jerlov_type="IB"), WAVELENGTHS)


@pytest.fixture(scope="module")
def columns(optics):
    sky = np.full((len(WAVELENGTHS), WINDOW_STREAMS), SKY)
    return solve_columns(optics, sun_cosine_air=0.8, sun_irradiance=SUN, sky_radiance=sky)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def field(optics, cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MIRRORGAZE_CACHE", str(cache))
        return radiance_field(optics, sun_cosine_air=0.8, sun_irradiance=SUN, sky_radiance=even_sky)


@pytest.fixture
def here(cache, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(cache))
    return cache


def test_tables_have_the_shapes_they_say(field):
    w, z, m, p = len(WAVELENGTHS), len(field.depth_m), len(field.cosine), len(field.azimuth_rad)
    assert field.multiple.shape == field.irradiance.shape == (w, z, m, p)
    for layer in (field.downwelling, field.upwelling, field.scalar, field.diffuse_attenuation):
        assert layer.shape == (w, z)
    assert field.depth_m[0] == 0
    assert (np.diff(field.cosine) > 0).all()
    assert field.cosine[0] == -1
    assert field.cosine[-1] == 1
    assert (field.multiple >= 0).all()
    assert (field.irradiance >= 0).all()


def test_light_that_counts_as_not_scattered_is_the_forward_peak(field, optics):
    np.testing.assert_allclose(field.attenuation, optics.absorption + optics.scattering)
    reduced = optics.absorption + optics.scattering * (1 - field.forward_fraction)
    np.testing.assert_allclose(field.beam_attenuation, reduced, rtol=1e-12)


def test_molecules_scatter_with_the_particles(columns, optics):
    angle = np.array([[0.01, 0.3], [1.5, 3.0]])
    for position, column in enumerate(columns):
        expected = optics.phase_function(angle.ravel())[position].reshape(angle.shape)
        np.testing.assert_allclose(column.phase(angle), expected, rtol=1e-12)
        moments = optics.moments(2)[position]
        fraction = column.scaled.forward_fraction
        assert column.scaled.phase_moments[1] == pytest.approx((moments[1] - fraction) / (1 - fraction), rel=1e-5)


def test_horizontal_planes_receive_what_the_layers_say(field):
    """Harmonics of 64 degrees against quadrature: the sum that is cut off weighs 1e-6 from above, 1e-3 from below."""
    sun = field.sun_cosine * field.sun_irradiance
    beam = sun[:, None] * np.exp(-field.beam_attenuation[:, None] * field.depth_m / field.sun_cosine[:, None])
    np.testing.assert_allclose(field.irradiance[:, :, -1, 0] + beam, field.downwelling, rtol=1e-5)
    np.testing.assert_allclose(field.irradiance[:, :, 0, 0], field.upwelling, rtol=1e-3)
    assert np.ptp(field.irradiance[:, :, -1], axis=-1).max() < 1e-12


def test_planes_of_any_tilt_receive_the_radiance_around_them(field, columns):
    """``int L(w) max(0, w . n) dw`` over 300 x 400 directions: midpoints, 5e-4 at the kinks of window and horizon.

    The beam that counts as not scattered hides in no table: light scattered once is taken without its forward peak.
    """
    column, depth = columns[0], field.depth_m[20:21]
    count, around = 300, 400
    cosine = -1 + (2 * np.arange(count) + 1) / count
    azimuth = np.pi * (2 * np.arange(around) + 1) / around
    modes, scaled = column.modes, column.scaled
    angle = scattering_angle(cosine, azimuth, modes.sun_cosine)
    degree = np.arange(len(scaled.phase_moments))
    series = (2 * degree + 1) * scaled.phase_moments / (4 * np.pi)
    smooth = np.polynomial.legendre.legval(np.cos(angle), series) * (1 - scaled.forward_fraction)
    whole = column.phase(angle)
    once = once_radiance(column, depth, cosine, azimuth)[0] * smooth / whole
    reflected = multiple_radiance(column, depth, cosine, azimuth)[0]
    total = once + reflected + sky_radiance(column, lambda air: np.full_like(air, SKY), depth, cosine)[0][:, None]
    sine = np.sqrt(1 - cosine**2)
    towards = np.stack(
        [np.outer(sine, np.cos(azimuth)), np.outer(sine, np.sin(azimuth)), np.outer(cosine, np.ones(around))], axis=-1
    )
    for m, p in ((10, 0), (15, 8), (25, 4), (40, 16)):
        n_z, phi = field.cosine[m], field.azimuth_rad[p]
        normal = np.array([np.sqrt(1 - n_z**2) * np.cos(phi), np.sqrt(1 - n_z**2) * np.sin(phi), n_z])
        received = (total * np.maximum(towards @ normal, 0)).sum() * (2 / count) * (2 * np.pi / around)
        assert field.irradiance[0, 20, m, p] == pytest.approx(received, rel=3e-3)


def test_linear_interpolation_finds_the_radiance_between_the_nodes(field, columns):
    """Against the total radiance at random depths and directions, once the decay with depth is taken out.

    `docs/explanation/radiative_transfer.md` states the errors: a median of 0.3 %, 99 of 100 directions within 2 %.
    """
    rng = np.random.default_rng(1)
    depth, azimuth = rng.uniform(0.1, 20, 8), rng.uniform(0, np.pi, 20)
    cosine = np.concatenate([rng.uniform(-1, 1, 40), rng.uniform(0.6, 0.72, 20)])
    points = np.stack(np.meshgrid(depth, cosine, azimuth, indexing="ij"), axis=-1)
    for position, column in enumerate(columns):
        decay = field.asymptotic_attenuation[position]
        table = field.multiple[position] * np.exp(decay * field.depth_m)[:, None, None]
        grid = (field.depth_m, field.cosine, field.azimuth_rad)
        found = RegularGridInterpolator(grid, table)(points) * np.exp(-decay * depth)[:, None, None]
        exact = multiple_radiance(column, depth, cosine, azimuth)
        total = exact + once_radiance(column, depth, cosine, azimuth)
        total += sky_radiance(column, lambda air: np.full_like(air, SKY), depth, cosine)[..., None]
        error = np.abs(found - exact) / total
        assert np.median(error) < 0.003
        assert np.quantile(error, 0.99) < 0.02


def test_the_same_comes_from_the_cache(field, optics, here, monkeypatch):
    def fail(*args, **kwargs):
        raise AssertionError("solved again")

    monkeypatch.setattr("optics.water.radiative_transfer.field.solve_columns", fail)
    again = radiance_field(optics, sun_cosine_air=0.8, sun_irradiance=SUN, sky_radiance=even_sky)
    for name, value in vars(field).items():
        np.testing.assert_array_equal(getattr(again, name), value)
    with pytest.raises(AssertionError, match="solved again"):
        radiance_field(optics, sun_cosine_air=0.79, sun_irradiance=SUN, sky_radiance=even_sky)
    with pytest.raises(AssertionError, match="solved again"):
        radiance_field(optics, sun_cosine_air=0.8, sun_irradiance=SUN, sky_radiance=lambda c: 2 * even_sky(c))


def test_a_damaged_file_is_made_again(field, optics, here):
    (path,) = here.glob("radiance-field/*.npz")
    path.write_bytes(path.read_bytes()[:1000])
    again = radiance_field(optics, sun_cosine_air=0.8, sun_irradiance=SUN, sky_radiance=even_sky)
    np.testing.assert_array_equal(again.multiple, field.multiple)
    assert [left.name for left in path.parent.iterdir()] == [path.name]


def test_bad_arguments_are_told_all_at_once(optics, here):
    dark = InherentOptics(
        wavelength_nm=optics.wavelength_nm,
        absorption=np.zeros(2),
        scattering=-optics.scattering,
        molecular_fraction=optics.molecular_fraction,
        phase=optics.phase,
        n_water=optics.n_water,
    )
    with pytest.raises(ValueError) as problems:
        radiance_field(
            dark, sun_cosine_air=0.0, sun_irradiance=np.ones(3), sky_radiance=lambda c: np.ones(4), deepest_m=0.0
        )
    text = str(problems.value)
    for part in (
        "sun_cosine_air above 0",
        "deepest_m above",
        "shape (2,)",
        "w = 2",
        "absorption above 0",
        "scattering",
    ):
        assert part in text
    assert len(text.splitlines()) == 6


def test_a_kept_field_is_what_would_be_solved_today(field, check_recorded):
    """Eigenvalues of other machines' libraries agree to far more than 1e-7."""
    check_recorded("radiance field", RADIANCE_VERSION, rel=1e-7, **vars(field))
