"""Ports against a second formulation at 50 digits, Fermat's principle, closed forms and the paraxial limit."""

from __future__ import annotations

import mpmath
import numpy as np
import plain_optics
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.camera import FisheyeCamera, PinholeCamera
from optics.ports.port import DomePort, FlatPort, NoPort, port_from_spec
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from optics.water.materials import material_index
from optics.water.water import water_index
from rigs import Rig

FOCAL_PX = 500.0
CAMERA = PinholeCamera(width_px=801, height_px=601, fx_px=FOCAL_PX, fy_px=FOCAL_PX, cx_px=400.0, cy_px=300.0)

WIDE = FisheyeCamera(width_px=1801, height_px=1801, fx_px=FOCAL_PX, fy_px=FOCAL_PX, cx_px=900.0, cy_px=900.0)

PORTS = {
    "flat": FlatPort(distance_m=0.02, thickness_m=0.008),
    "tilted": FlatPort(distance_m=0.02, thickness_m=0.008, normal=(0.1, -0.2, 1.0), n_port=1.52, n_water=1.34),
    "dome": DomePort(centre_m=(0.004, -0.003, -0.01), radius_m=0.05, thickness_m=0.006),
    "dome before": DomePort(centre_m=(0.0, 0.0, 0.02), radius_m=0.05, thickness_m=0.006, n_port=1.77),
    "centred": DomePort(radius_m=0.05, thickness_m=0.006),
}

SNELL = 1e-12
"""The promise of the design, metres and unit vectors; 1e-16 is seen."""

SECOND_FORMULA_PX = 1e-8
"""Bisection stops at 1e-15 rad and the traced miss is known to 1e-16 m: 1e-12 px are seen, the promise is kept."""

FERMAT = 1e-12
"""A port 20 mm away curves the optical path by 50 per metre: 1e-16 m of rounding in the points make 5e-15."""

ROUND_TRIP_PX = 1e-9
"""The promise of the design for a projection's root."""


def train(port, camera=CAMERA):
    return OpticalTrain(camera=camera, port=port)


def unit(vector):
    return np.asarray(vector, dtype=float) / np.linalg.norm(vector)


def plain(port):
    """The port for the second formulation, in its 50-digit numbers."""
    indices = plain_optics.numbers((port.n_inside, port.n_port, port.n_water))
    thickness = mpmath.mpf(port.thickness_m)
    if isinstance(port, FlatPort):
        return plain_optics.PlainFlat(
            normal=plain_optics.unit(plain_optics.numbers(port.normal)),
            distance=mpmath.mpf(port.distance_m),
            thickness=thickness,
            indices=indices,
        )
    return plain_optics.PlainDome(
        centre=plain_optics.numbers(port.centre_m),
        radius=mpmath.mpf(port.radius_m),
        thickness=thickness,
        indices=indices,
    )


def points_in_view(port, count, seed=5, camera=CAMERA):
    """Pixels of the image, and points on their rays 0.2 to 10 m away."""
    rng = np.random.default_rng(seed)
    pixels = rng.uniform(-0.5, [camera.width_px - 0.5, camera.height_px - 0.5], (count, 2))
    rays = train(port, camera).trace(pixels)
    seen = rays.status == Status.OK
    assert seen.any()
    distance = np.exp(rng.uniform(np.log(0.2), np.log(10), (count, 1)))
    return pixels[seen], (rays.origin_m + distance * rays.direction)[seen]


@pytest.mark.parametrize("name", PORTS)
def test_rays_follow_a_second_formulation_at_fifty_digits(name):
    """Snell through both faces to 1e-12: position on the outer face and direction in the water."""
    port = PORTS[name]
    pixels = pixel_grid(CAMERA, 8, 6)
    rays = train(port).trace(pixels)
    with mpmath.workdps(plain_optics.DIGITS):
        for pixel, origin, direction in zip(pixels, rays.origin_m, rays.direction, strict=True):
            slope = plain_optics.numbers((*(pixel - [400, 300]), FOCAL_PX))
            _, outer, outgoing = plain_optics.faces(plain(port), plain_optics.unit(slope))
            np.testing.assert_allclose(origin, np.array(outer, dtype=float), rtol=0, atol=SNELL)
            np.testing.assert_allclose(direction, np.array(outgoing, dtype=float), rtol=0, atol=SNELL)


@pytest.mark.parametrize("name", [name for name in PORTS if name != "centred"])
def test_points_are_seen_where_a_second_formulation_finds_them(name):
    """Bisection on traced rays against the closed equations of `project`: the same pixel to 1e-8 px."""
    port = PORTS[name]
    _, points = points_in_view(port, 40)
    image = train(port).project(points)
    assert (image.status == Status.OK).all()
    directions = np.array([plain_optics.seen_direction(plain(port), point) for point in points])
    expected = [400, 300] + FOCAL_PX * directions[:, :2] / directions[:, 2:]
    np.testing.assert_allclose(image.pixels, expected, rtol=0, atol=SECOND_FORMULA_PX)


@pytest.mark.parametrize("name", PORTS)
def test_light_takes_a_stationary_path(name):
    """Fermat: moving either crossing along its face changes the optical path to a point in the second order only.

    The ray is the one that `project` found. Its crossings are shifted on their faces, and the path
    ``n_i |.| + n_p |.| + n_w |.|`` to the point is differentiated numerically at 50 digits; Snell does not enter.
    """
    port = PORTS[name]
    _, points = points_in_view(port, 6)
    pixels = train(port).project(points).pixels
    with mpmath.workdps(plain_optics.DIGITS):
        surface = plain(port)
        for pixel, point in zip(pixels, points, strict=True):
            direction = plain_optics.unit(plain_optics.numbers((*(pixel - [400, 300]), FOCAL_PX)))
            inner, outer, _ = plain_optics.faces(surface, direction)
            pinhole, target = plain_optics.numbers((0, 0, 0)), plain_optics.numbers(point)
            for tangent in ((1, 0), (0, 1)):

                def inner_moved(step, tangent=tangent, stops=(pinhole, inner, outer, target)):
                    shift = [step * x for x in tangent]
                    moved = plain_optics.moved_on_face(surface, stops[1], shift)
                    return plain_optics.optical_path(surface, (stops[0], moved, *stops[2:]))

                def outer_moved(step, tangent=tangent, stops=(pinhole, inner, outer, target)):
                    shift = [step * x for x in tangent]
                    moved = plain_optics.moved_on_face(surface, stops[2], shift)
                    return plain_optics.optical_path(surface, (*stops[:2], moved, stops[3]))

                assert abs(mpmath.diff(inner_moved, 0)) < FERMAT
                assert abs(mpmath.diff(outer_moved, 0)) < FERMAT


@given(thickness=st.floats(1e-4, 0.1), n_port=st.floats(1.2, 2.0), n_water=st.floats(1.0, 1.4))
def test_a_flat_window_does_not_turn_light_by_itself(thickness, n_port, n_water):
    """Parallel faces: the direction in the water follows from n_inside and n_water alone, whatever is between."""
    pixels = pixel_grid(CAMERA, 5, 4)
    port = FlatPort(distance_m=0.02, thickness_m=thickness, n_port=n_port, n_water=n_water)
    direction = train(port).trace(pixels).direction
    tangential = np.array([unit((*(pixel - [400, 300]), FOCAL_PX))[:2] for pixel in pixels]) / n_water
    np.testing.assert_allclose(direction[:, :2], tangential, rtol=0, atol=SNELL)


def test_a_centred_dome_refracts_nothing():
    pixels = pixel_grid(CAMERA, 20, 15)
    rays = train(PORTS["centred"]).trace(pixels)
    expected, _ = CAMERA.unproject(pixels)
    np.testing.assert_allclose(rays.direction, expected, rtol=0, atol=SNELL)
    np.testing.assert_allclose(rays.origin_m, 0.056 * expected, rtol=0, atol=SNELL)


@given(offset=st.floats(1e-15, 1e-6))
def test_a_dome_is_centred_in_the_limit(offset):
    """A dome that is off by next to nothing has an axis, a centred one has none: no jump between them."""
    _, points = points_in_view(PORTS["centred"], 20)
    off = DomePort(centre_m=(offset, 0, offset), radius_m=0.05, thickness_m=0.006)
    shift = np.abs(train(off).project(points).pixels - train(PORTS["centred"]).project(points).pixels).max()
    # 500 px focal length over 50 mm radius: at most about 1e4 px per metre of decentring.
    assert shift <= 2e4 * offset + ROUND_TRIP_PX


@given(
    x=st.floats(-0.9, 0.9),
    y=st.floats(-0.9, 0.9),
    n_inside=st.floats(1.0, 1.4),
    n_water=st.floats(1.0, 1.4),
    distance=st.floats(0.02, 0.2),
)
def test_rays_in_the_water_keep_the_dome_invariant(x, y, n_inside, n_water, distance):
    """What is conserved is n r sin(angle to the radius), from the pinhole to the water (Born & Wolf, 3.2.1)."""
    centre = np.array([0.006, -0.011, 0.004])
    port = DomePort(
        centre_m=tuple(centre), radius_m=distance + 0.014, thickness_m=0.005, n_inside=n_inside, n_water=n_water
    )
    rays = train(port).trace([[400 + 500 * x, 300 + 500 * y]])
    before = n_inside * np.cross(-centre, unit((x, y, 1)))
    behind = n_water * np.cross(rays.origin_m[0] - centre, rays.direction[0])
    np.testing.assert_allclose(behind, before, rtol=0, atol=SNELL)


def test_behind_a_flat_port_the_focal_length_is_n_times_longer():
    """Paraxial limit f_water = n f_air, reached in the second order of the angle (Treibitz et al., PAMI 34, 51, 2012).

    The excess over n shrinks four times with every halving of the angle; extrapolated, it is 1.333 to 1e-9.
    """
    port = FlatPort(distance_m=0.02, thickness_m=0.008, n_water=1.333)
    radii = 40.0 / 2 ** np.arange(4)
    rays = train(port).trace(np.stack([400 + radii, np.full(4, 300.0)], axis=1))
    slope_in_water = rays.direction[:, 0] / rays.direction[:, 2]
    magnification = radii / slope_in_water / FOCAL_PX
    excess = magnification - 1.333
    np.testing.assert_allclose(excess[:-1] / excess[1:], 4, rtol=2e-2)
    richardson = (4 * magnification[1:] - magnification[:-1]) / 3
    assert richardson[-1] == pytest.approx(1.333, abs=1e-8)


@pytest.mark.parametrize("name", PORTS)
@pytest.mark.parametrize("camera", [CAMERA, WIDE], ids=["pinhole", "fisheye"])
def test_project_undoes_trace(name, camera):
    pixels, points = points_in_view(PORTS[name], 3000, camera=camera)
    image = train(PORTS[name], camera).project(points)
    assert (image.status == Status.OK).all()
    np.testing.assert_allclose(image.pixels, pixels, rtol=0, atol=ROUND_TRIP_PX)


@pytest.mark.parametrize(
    ("n_inside", "n_port", "n_water"),
    [(1.0, 1.49, 1.333), (1.333, 1.49, 1.0), (1.333, 1.49, 1.333), (1.0, 1.49, 1.0), (1.5, 1.3, 1.4)],
)
def test_a_flat_port_is_inverted_up_to_grazing_rays_for_any_order_of_indices(n_inside, n_port, n_water):
    """Up to 89 degrees from the normal, from 1 mm to 100 m: every point of a transmitted ray is found again."""
    port = FlatPort(distance_m=0.02, thickness_m=0.008, n_inside=n_inside, n_port=n_port, n_water=n_water)
    rng = np.random.default_rng(11)
    angle, turn = rng.uniform(0, np.radians(89), 3000), rng.uniform(-np.pi, np.pi, 3000)
    pixels = 900 + FOCAL_PX * angle[:, np.newaxis] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rays = train(port, WIDE).trace(pixels)
    passed = rays.status == Status.OK
    # Without total reflection the ray passes; with it, up to the smallest critical angle.
    critical = np.arcsin(min(1.0, n_port / n_inside, n_water / n_inside))
    assert (passed == (angle < critical)).all()
    points = rays.origin_m + 10 ** rng.uniform(-3, 2, (3000, 1)) * rays.direction
    image = train(port, WIDE).project(points[passed])
    assert (image.status == Status.OK).all()
    np.testing.assert_allclose(image.pixels, pixels[passed], rtol=0, atol=ROUND_TRIP_PX)


@pytest.mark.parametrize("centre", [(0.0, 0.0, -0.0495), (0.0495, 0.0, 0.0), (0.03, 0.0, -0.039)])
def test_a_dome_is_inverted_from_next_to_its_wall(centre):
    """A pinhole 0.5 to 1 mm from the inner face of a 50 mm dome, rays up to 89 degrees."""
    port = DomePort(centre_m=centre, radius_m=0.05, thickness_m=0.005)
    pixels, points = points_in_view(port, 3000, camera=WIDE)
    image = train(port, WIDE).project(points)
    assert (image.status == Status.OK).all()
    np.testing.assert_allclose(image.pixels, pixels, rtol=0, atol=ROUND_TRIP_PX)


def test_a_dome_of_any_indices_gives_a_ray_through_the_point_or_says_that_it_found_none():
    """Where light bends outwards, total reflection ends the range of the root and a point may have two images.

    Whatever pixel comes, its traced ray must meet the point. With air inside, a root is found for every point.
    """
    rng = np.random.default_rng(12)
    unsolved = 0
    for n_inside in (*(1.0,) * 10, *rng.uniform(1.2, 1.5, 10)):
        centre = unit(rng.normal(size=3)) * rng.uniform(0.9, 0.999) * 0.05
        n_port, n_water = rng.uniform(1.3, 1.8), rng.uniform(1.0, 1.4)
        port = DomePort(
            centre_m=centre, radius_m=0.05, thickness_m=0.005, n_inside=n_inside, n_port=n_port, n_water=n_water
        )
        _, points = points_in_view(port, 1000, camera=WIDE)
        image = train(port, WIDE).project(points)
        found = image.status != Status.NOT_CONVERGED
        assert found.any()
        assert n_inside > 1 or (image.status == Status.OK).all()
        assert np.isnan(image.pixels[~found]).all()
        unsolved += np.count_nonzero(~found)
        rays = train(port, WIDE).trace(image.pixels[found])
        miss = np.linalg.norm(np.cross(points[found] - rays.origin_m, rays.direction), axis=1)
        # Ten metres away; the ray's direction multiplies what is left of the angle next to the wall.
        np.testing.assert_allclose(miss, 0, rtol=0, atol=10 * SNELL)
    assert unsolved > 0


def test_from_water_into_air_rays_are_totally_reflected_beyond_the_critical_angle():
    """A camera in a flooded housing: arcsin(1 / 1.333) = 48.6 degrees, 566.8 px at 500 px focal length."""
    port = FlatPort(distance_m=0.02, thickness_m=0.008, n_inside=1.333, n_water=1.0)
    radius = FOCAL_PX * np.tan(np.arcsin(1 / 1.333))
    pixels = [[400 + radius - 1e-6, 300], [400 + radius + 1e-6, 300]]
    rays = train(port).trace(pixels)
    assert rays.status.tolist() == [Status.OK, Status.TOTAL_REFLECTION]
    assert train(port).transmittance(pixels)[1] == 0


def test_a_ray_away_from_a_flat_port_misses_it():
    """Also with a denser medium inside, where refraction would call it totally reflected; no light comes that way."""
    for n_inside in (1.0, 1.333):
        port = FlatPort(distance_m=0.02, thickness_m=0.008, n_inside=n_inside, n_water=1.0)
        pixels = [[900 + FOCAL_PX * np.radians(100), 900], [900 + FOCAL_PX * 3.1, 900]]
        rays = train(port, WIDE).trace(pixels)
        assert rays.status.tolist() == [Status.MISSED_PORT, Status.MISSED_PORT]
        assert train(port, WIDE).transmittance(pixels).tolist() == [0, 0]


@pytest.mark.parametrize("name", ["flat", "tilted", "dome"])
def test_the_aperture_bounds_the_view(name):
    """A ray is let through if it leaves the window closer to the axis than the clear radius."""
    limited = {
        "flat": FlatPort(distance_m=0.02, thickness_m=0.008, aperture_radius_m=0.01),
        "tilted": FlatPort(distance_m=0.02, thickness_m=0.008, normal=(0.1, -0.2, 1.0), aperture_radius_m=0.01),
        "dome": DomePort(centre_m=(0.004, -0.003, -0.01), radius_m=0.05, thickness_m=0.006, aperture_radius_m=0.02),
    }[name]
    pixels = pixel_grid(CAMERA, 40, 30)
    rays = train(limited).trace(pixels)
    with mpmath.workdps(20):
        surface = plain(limited)
        for pixel, status in zip(pixels, rays.status, strict=True):
            inner, outer, _ = plain_optics.faces(surface, [float(x) for x in unit((*(pixel - [400, 300]), FOCAL_PX))])
            if name == "dome":
                miss = np.hypot(float(inner[0]) - 0.004, float(inner[1]) + 0.003) - 0.02
            else:
                miss = np.linalg.norm(np.array(outer, dtype=float) - 0.028 * unit(limited.normal)) - 0.01
            assert status == (Status.OK if miss <= 0 else Status.MISSED_PORT)


def test_without_a_port_light_goes_straight():
    pixels = pixel_grid(CAMERA, 7, 5)
    rays = train(NoPort()).trace(pixels)
    np.testing.assert_array_equal(rays.origin_m, np.zeros((35, 3)))
    np.testing.assert_allclose(rays.direction, CAMERA.unproject(pixels)[0], rtol=0, atol=1e-15)
    assert train(NoPort()).transmittance(pixels).tolist() == [1.0] * 35


def test_points_that_are_not_in_the_water_have_no_pixel():
    flat = train(PORTS["flat"]).project([[0, 0, 0.01], [0.3, 0.2, 0.027], [0, 0, -1], [5.0, 0, -0.1]])
    assert flat.status.tolist() == [Status.INSIDE_HOUSING] * 4
    dome = train(PORTS["dome"]).project([[0, 0, 0.01], [0.03, 0, 0.02], [0.004, -0.003, 0.045]])
    assert dome.status.tolist() == [Status.INSIDE_HOUSING] * 3
    assert np.isnan(flat.pixels).all()
    assert np.isnan(dome.pixels).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FlatPort(distance_m=0.0, thickness_m=0.01), "expected distance_m > 0, got 0.0"),
        (lambda: FlatPort(distance_m=0.02, thickness_m=0.01, n_water=np.nan), "expected n_water > 0, got nan"),
        (lambda: FlatPort(distance_m=0.02, thickness_m=0.01, normal=(0, 0, 0)), "expected normal to have a direction"),
        (lambda: FlatPort(distance_m=0.02, thickness_m=0.01, normal=(0, 1)), "expected normal to be three finite"),
        (lambda: DomePort(centre_m=(0, 0, 0.05), radius_m=0.05, thickness_m=0.01), "expected the pinhole inside"),
        (lambda: DomePort(radius_m=0.05, thickness_m=0.01, aperture_radius_m=-1), "expected aperture_radius_m > 0"),
    ],
)
def test_wrong_numbers_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_rig_files_port_is_built_with_its_own_water():
    rig = Rig.load("aqua2")
    port = port_from_spec(rig.port, rig.water)
    assert isinstance(port, FlatPort)
    assert (port.distance_m, port.thickness_m, port.aperture_radius_m) == (0.02, 0.008, 0.026)
    assert port.n_port == material_index("pmma", 550.0)
    assert port.n_water == water_index(550.0, 35.0, 25.0)
