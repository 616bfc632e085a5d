"""Blur by forward scattering: against small-angle theory, scattered photons, and what must not change."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from optics.status import Region
from rigs import Rig, Water
from scenes.forward_scatter import (
    FARTHEST_M,
    blurred,
    gaussian_shares,
    path_transform,
    peak_edge,
    peak_rings,
    pixel_angle,
)
from scenes.light.light import underwater_light
from scenes.stage.frame import Frame

SHAPE = (120, 160)
DISTANCE = 5.0

FIT = 0.02
"""Three Gaussians for the transform, at optical depths of the peak up to 2; `docs/explanation/forward_scatter.md`."""

SINGLE_PRECISION = 1e-5
"""Sums of 2e4 float32 pixels."""

STEPS = 0.02
"""Distances are taken in 256 steps of the square root: half a step is 1.4 % at 3 m."""


@pytest.fixture(scope="module")
def light():
    return underwater_light(Water(jerlov_type="3C"))


@pytest.fixture(scope="module")
def rig():
    """The camera's own image is as small as the frames of these tests."""
    rig = Rig.load("aqua2")
    camera = rig.camera.model_copy(update={"width_px": SHAPE[1], "height_px": SHAPE[0], "cx_px": 79.5, "cy_px": 59.5})
    return rig.model_copy(update={"camera": camera})


def frame_of(radiance, distance=DISTANCE, region=Region.DIRECT):
    image = np.zeros((*SHAPE, 3), dtype=np.float32)
    image[:] = radiance
    nothing = np.zeros(SHAPE, dtype=np.float32)
    return Frame(
        radiance=image,
        distance_m=np.broadcast_to(np.float32(distance), SHAPE).astype(np.float32),
        point_m=image,
        normal=image,
        label=nothing.astype(np.uint8),
        region=np.broadcast_to(np.uint8(region), SHAPE).astype(np.uint8),
        instance=nothing.astype(np.int32),
        target_fraction=nothing,
    )


def point():
    image = np.zeros((*SHAPE, 3), dtype=np.float32)
    image[SHAPE[0] // 2, SHAPE[1] // 2] = 1
    return image


@dataclass(frozen=True)
class Peak:
    angle: np.ndarray
    share: np.ndarray

    @property
    def mean_square(self):
        return self.share @ self.angle**2


@pytest.fixture(scope="module")
def peak(light):
    return Peak(*peak_rings(light.optics.phase, peak_edge(light)))


def optical_depth(light, distance=DISTANCE):
    """Scatterings within the peak on the way, by channel: f b r."""
    return light.bands.weight @ (light.optics.scattering * light.field.forward_fraction) * distance


def test_peak_holds_what_the_light_field_counts_as_unscattered(light):
    """Fraction of the particles' light within the edge: delta-M's f = chi_64 (Wiscombe 1977)."""
    assert light.optics.phase.fraction_within(peak_edge(light)) == pytest.approx(
        light.optics.phase.moments(65)[64], rel=1e-9
    )
    assert np.degrees(peak_edge(light)) == pytest.approx(1.0, abs=0.1)


def test_light_is_spread_by_the_variance_of_small_angle_theory(light, rig, peak):
    """A point's image: mean square distance = f b r <theta^2> / 3 (the mean of t^2 over the path; Wells 1973).

    Expected: within `FIT`, and the loss of the point itself below 1 - exp(-f b r) by no more than what stays within
    its own pixel.
    """
    out = blurred(frame_of(point()), light, rig)
    v, u = np.indices(SHAPE)
    square = (v - SHAPE[0] // 2) ** 2 + (u - SHAPE[1] // 2) ** 2
    spread = (square[..., np.newaxis] * out).sum(axis=(0, 1)) / out.sum(axis=(0, 1)) * pixel_angle(rig) ** 2
    np.testing.assert_allclose(spread, optical_depth(light) * peak.mean_square / 3, rtol=FIT + STEPS)
    left = out[SHAPE[0] // 2, SHAPE[1] // 2]
    assert (left > np.exp(-optical_depth(light))).all()
    assert (left < 1).all()


@pytest.mark.parametrize("depth", [0.1, 0.5, 2.0])
def test_gaussians_have_the_transform_of_the_water(light, depth):
    """exp(-tau (1 - G)), of light scattered any number of times, at all frequencies of an image."""
    edge, finest = peak_edge(light), np.pi / 1.3e-3
    sigma = edge / 2 / 2.0 ** np.arange(4)
    shares = gaussian_shares(light.optics.phase, edge, sigma, np.array([depth]), finest)[0]
    frequency = np.linspace(0, finest, 60)
    found = 1 - shares @ (1 - np.exp(-0.5 * np.multiply.outer(sigma, frequency) ** 2))
    expected = np.exp(-depth * (1 - path_transform(light.optics.phase, edge, frequency)))
    np.testing.assert_allclose(found, expected, atol=FIT)


def test_transform_is_that_of_photons(light, peak):
    """Rationale: photons that scatter at random places of the path, in two dimensions, know nothing of transforms.

    Expected: mean of cos(q x) over 2e5 photons, within four standard errors.
    """
    rng = np.random.default_rng(2)
    photons, depth = 200_000, 0.8
    count = rng.poisson(depth, photons)
    owner = np.repeat(np.arange(photons), count)
    angle = rng.choice(peak.angle, size=len(owner), p=peak.share)
    offset = angle * rng.random(len(owner)) * np.cos(rng.uniform(0, 2 * np.pi, len(owner)))
    x = np.bincount(owner, offset, minlength=photons)
    for frequency in (50.0, 300.0, 1500.0):
        wave = np.cos(frequency * x)
        expected = np.exp(-depth * (1 - path_transform(light.optics.phase, peak_edge(light), np.array([frequency]))))
        assert abs(wave.mean() - expected[0]) < 4 * wave.std() / np.sqrt(photons)


def test_no_light_is_lost_or_made(light, rig):
    """By region, whatever the distances: pixels exchange light by pairs."""
    rng = np.random.default_rng(0)
    frame = frame_of(rng.random((*SHAPE, 3)), distance=rng.uniform(0.5, 9.0, SHAPE))
    region = np.where(np.arange(SHAPE[1]) < 70, Region.GAZE, Region.FOLD).astype(np.uint8)
    frame = replace(frame, region=np.broadcast_to(region, SHAPE).copy())
    out = blurred(frame, light, rig)
    assert np.abs(out - frame.radiance).max() > 0.05
    for each in (Region.GAZE, Region.FOLD):
        inside = frame.region == each
        before, after = (image[inside].sum(axis=0, dtype=np.float64) for image in (frame.radiance, out))
        np.testing.assert_allclose(after, before, rtol=2e-4)  # the two halves of a coarse blur are not quite adjoint


def test_an_even_image_stays_even(light, rig):
    """At any distances: a plane-parallel light field has no edge that could be blurred."""
    distance = np.random.default_rng(1).uniform(0.3, 20, SHAPE)
    frame = frame_of((0.2, 0.5, 0.7), distance=np.where(distance > 15, np.inf, distance))
    np.testing.assert_allclose(blurred(frame, light, rig), frame.radiance, rtol=SINGLE_PRECISION)


def test_regions_exchange_no_light(light, rig):
    """A mirror's edge stays sharp: what one region shows changes no byte of another, and the housing stays black."""
    rng = np.random.default_rng(3)
    region = np.full(SHAPE, int(Region.DIRECT), dtype=np.uint8)
    region[30:90, 40:120] = Region.GAZE
    region[:8] = Region.HOUSING
    first = replace(frame_of(rng.random((*SHAPE, 3))), region=region)
    gaze = (region == Region.GAZE)[..., np.newaxis]
    second = replace(first, radiance=np.where(gaze, np.float32(5), first.radiance))
    outs = [blurred(each, light, rig) for each in (first, second)]
    np.testing.assert_array_equal(outs[0][~gaze[..., 0]], outs[1][~gaze[..., 0]])
    np.testing.assert_array_equal(outs[0][:8], first.radiance[:8])


def test_near_things_are_sharper_than_far_ones(light, rig):
    near, far = (blurred(frame_of(point(), distance=each), light, rig).max() for each in (0.3, 6.0))
    assert far < 0.8
    assert near > 0.95


def test_a_ball_in_open_water_is_blurred_as_at_its_own_distance(light, rig):
    """Open water has no distance: beside a ball it counts as no farther off.

    Expected: the ball's edge is as it would be before a wall at the ball's own distance.
    """
    v, u = np.indices(SHAPE)
    ball = (v - 60) ** 2 + (u - 80) ** 2 < 20**2
    image = np.where(ball[..., np.newaxis], 0.8, 0.3)
    outs = [blurred(frame_of(image, distance=distance), light, rig) for distance in (np.where(ball, 2.0, np.inf), 2.0)]
    np.testing.assert_allclose(outs[0], outs[1], atol=2e-3)
    assert np.abs(outs[0] - image).max() > 0.01


@pytest.mark.parametrize("molecules", ["", ",b_molecular_per_m"])
def test_water_that_scatters_nothing_blurs_nothing(tmp_path, rig, molecules):
    """With and without particles in what little it scatters."""
    file = tmp_path / "clear.csv"
    rows = [f"{wavelength},0.1,1e-9{',0' if molecules else ''}" for wavelength in (400, 700)]
    file.write_text("\n".join([f"wavelength_nm,a_per_m,b_per_m{molecules}", *rows, ""]))
    clear = underwater_light(Water(iop_file=file))
    frame = frame_of(point(), distance=FARTHEST_M)
    # Without particles there is no blur at all; with them f b r is 1e-8.
    np.testing.assert_allclose(blurred(frame, clear, rig), frame.radiance, atol=1e-7 if molecules else 0)


def test_half_the_size_is_half_the_blur_in_pixels(light, rig):
    """The same view at another size: angles do not change, pixels do."""
    smaller = replace(frame_of(point()), radiance=point()[::2, ::2], distance_m=np.full((60, 80), DISTANCE, np.float32))
    smaller = replace(smaller, region=np.full((60, 80), int(Region.DIRECT), np.uint8))
    out, full = blurred(smaller, light, rig), blurred(frame_of(point()), light, rig)

    def variance(image):
        v, u = np.indices(image.shape[:2])
        row, column = np.unravel_index(image[..., 0].argmax(), image.shape[:2])
        return ((v - row) ** 2 + (u - column) ** 2).ravel() @ image[..., 0].ravel() / image[..., 0].sum()

    assert variance(full) / variance(out) == pytest.approx(4, rel=0.1)  # a kernel below half a pixel is left out
