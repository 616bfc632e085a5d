"""The housing's window and the mirrors of the reference renderer: what gets through, what comes back."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import PinholeCamera
from optics.kernels.backend import mi
from optics.ports.port import DomePort, FlatPort
from optics.water.materials import aluminium_index
from rigs import Rig
from scenes.light.materials import albedo_table
from scenes.reference.bodies import mirror_shape
from scenes.reference.estimate import estimate
from scenes.reference.housing import housing
from scenes.reference.render import camera_rays

LARGEST_Z = 4.0
"""Of some 40 comparisons in these tests none should lie outside of this (1 in 16 000 does)."""

ATTENUATION = np.array([0.6, 0.2, 0.05])
SHINING = np.array([1.0, 2.0, 3.0])
N_PORT, N_WATER = 1.49, 1.34

SINGLE_PRECISION = 2e-4
"""Lengths of 1 m are known to 1e-4 m: a ray starts that far off the surface it leaves."""

PORTS = {
    "flat": FlatPort(distance_m=0.02, thickness_m=0.008, n_port=N_PORT, n_water=N_WATER, aperture_radius_m=0.03),
    "tilted": FlatPort(
        distance_m=0.02,
        thickness_m=0.008,
        normal=(0.0, 0.2, 1.0),
        n_port=N_PORT,
        n_water=N_WATER,
        aperture_radius_m=0.03,
    ),
    "dome": DomePort(radius_m=0.05, thickness_m=0.003, n_port=N_PORT, n_water=N_WATER, aperture_radius_m=0.045),
}


def absorbing():
    texture = {"type": "rawconstant", "value": list(ATTENUATION)}
    volume = {"type": "constvolume", "value": texture}
    return mi.load_dict({"type": "homogeneous", "sigma_t": volume, "albedo": 0.0})


def glowing(to_world):
    return {
        "type": "rectangle",
        "to_world": to_world,
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rawconstant", "value": [0.0, 0.0, 0.0]}},
        "emitter": {"type": "area", "radiance": {"type": "rawconstant", "value": list(SHINING)}},
    }


def check(result, expected, *, systematic, precision):
    """z-test with the estimate's own variance, which must be small enough for the test to mean something."""
    error = np.sqrt(result.variance)
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + systematic * expected).all(), (result, expected)
    assert (error < precision * expected).all(), error / expected


def fresnel(n_before, n_behind, sine):
    """Transmittance of one face, by the sine before it (Born & Wolf 1.5.2), for both polarisations apart."""
    before, behind = np.sqrt(1 - sine**2), np.sqrt(1 - (n_before / n_behind * sine) ** 2)
    r_s = (n_before * before - n_behind * behind) / (n_before * before + n_behind * behind)
    r_p = (n_behind * before - n_before * behind) / (n_behind * before + n_before * behind)
    return 1 - (r_s**2 + r_p**2) / 2


@pytest.mark.parametrize("name", PORTS)
def test_lamp_through_the_port(name):
    """T / n^2 exp(-c r): Fresnel at two faces, basic radiance, and the water from the outer face to the lamp.

    The camera is above the lamp's sheet, so that the sheet is flat on its axis; light thrown to and fro in the window
    adds 1 / (1 - R1 R2). Rays through tilted windows leave at an angle, which the length of the path shows.
    """
    port, water, reach = PORTS[name], absorbing(), 1.5
    sheet = mi.ScalarTransform4f().translate([0, 0, reach]).rotate([1, 0, 0], 180).scale([50, 50, 1])
    scene = mi.load_dict({"type": "scene", "lamp": glowing(sheet), **housing(port, np.eye(4), water)})
    ahead = lambda pixel, sampler: mi.RayDifferential3f(mi.Point3f(0, 0, 0), mi.Vector3f(0, 0, 1))  # noqa: E731
    result = estimate(scene, ahead, pixels=1, samples=2**17, seed=(1,))
    if name == "dome":
        sine, length = 0.0, reach - port.radius_m - port.thickness_m
    else:
        normal = np.array(port.normal) / np.linalg.norm(port.normal)
        sine = np.sqrt(1 - normal[2] ** 2)
        # Trace by hand: in the plane of the axis and the normal, angles from the normal.
        outwards = (np.array([0, 0, 1]) - normal[2] * normal) / max(sine, 1e-30)
        start = np.array([0, 0, port.distance_m / normal[2]])
        in_port = normal * np.sqrt(1 - (sine / N_PORT) ** 2) + outwards * sine / N_PORT
        in_water = normal * np.sqrt(1 - (sine / N_WATER) ** 2) + outwards * sine / N_WATER
        out = start + in_port * port.thickness_m / (in_port @ normal)
        length = (reach - out[2]) / in_water[2]
    first, second = fresnel(1.0, N_PORT, sine), fresnel(N_PORT, N_WATER, sine / N_PORT)
    through = first * second / (1 - (1 - first) * (1 - second))
    expected = SHINING * through / N_WATER**2 * np.exp(-ATTENUATION * length)
    error = np.sqrt(result.variance)
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + SINGLE_PRECISION * expected).all(), (
        result.mean / expected
    )
    assert (error < 0.003 * expected).all()


@pytest.mark.parametrize("name", ["flat", "dome"])
def test_outside_the_aperture_the_housing_is_black(name):
    port, water = PORTS[name], absorbing()
    sheet = mi.ScalarTransform4f().translate([0, 0, 0.5]).rotate([1, 0, 0], 180).scale([50, 50, 1])
    scene = mi.load_dict({"type": "scene", "lamp": glowing(sheet), **housing(port, np.eye(4), water)})
    # A millimetre inside and outside of the rim.
    for sign in (-1, 1):
        rim = port.aperture_radius_m + 0.001 * sign
        if name == "dome":
            slope = np.tan(np.arcsin(rim / port.radius_m))
        else:
            slopes = np.linspace(0, 2, 200_001)
            in_port = np.tan(np.arcsin(slopes / np.hypot(1, slopes) / N_PORT))
            slope = np.interp(rim, port.distance_m * slopes + port.thickness_m * in_port, slopes)
        toward = mi.Vector3f(*map(float, np.array([slope, 0, 1]) / np.hypot(1, slope)))
        result = estimate(
            scene,
            lambda pixel, sampler, toward=toward: mi.RayDifferential3f(mi.Point3f(0, 0, 0), toward),
            pixels=1,
            samples=64,
            seed=(1,),
        )
        assert (result.mean == 0).all() == (sign > 0), (name, sign, result.mean)


def test_mirror_under_water():
    """Reflectance of aluminium in water at 45 degrees by its complex index, and the whole way of the light."""
    wavelength = np.array([450.0, 550.0, 650.0])
    water = absorbing()
    plate = Rig.load("aqua2").gaze.fold_mirror
    pose = RigidTransform.from_components([0.0, 0.0, 1.0], Rotation.from_euler("y", 180 + 45, degrees=True))
    # The lamp stands beside the mirror, where the folded view looks.
    normal = pose.rotation.apply([0, 0, 1])
    towards = np.array([0, 0, 1]) - 2 * normal[2] * normal
    lamp_pose = np.eye(4)
    lamp_pose[:3, :3] = np.column_stack([[0, 1, 0], np.cross(-towards, [0, 1, 0]), -towards])
    lamp_pose[:3, 3] = np.array([0, 0, 1.0]) + 0.5 * towards
    scene = mi.load_dict(
        {
            "type": "scene",
            "mirror": mirror_shape(pose, plate, N_WATER, albedo_table()[:, :3], wavelength),
            "lamp": glowing(mi.ScalarTransform4f(lamp_pose)),
        }
    )
    ahead = lambda pixel, sampler: mi.RayDifferential3f(mi.Point3f(0, 0, 0), mi.Vector3f(0, 0, 1))  # noqa: E731
    result = estimate(scene, ahead, medium=water, pixels=1, samples=2**17, seed=(1,))
    n, k = aluminium_index(wavelength)
    index, cosine = (n + 1j * k) / N_WATER, np.cos(np.pi / 4)
    refracted = np.sqrt(index**2 - (1 - cosine**2))
    r_s = np.abs((cosine - refracted) / (cosine + refracted)) ** 2
    r_p = np.abs((index**2 * cosine - refracted) / (index**2 * cosine + refracted)) ** 2
    expected = SHINING * (r_s + r_p) / 2 * np.exp(-ATTENUATION * 1.5)
    error = np.sqrt(result.variance)
    assert (np.abs(result.mean - expected) < LARGEST_Z * error + SINGLE_PRECISION * expected).all(), (
        result.mean / expected
    )
    assert (error < 0.05 * expected).all()


def test_rays_fill_their_pixels():
    """The corners of the image, in air, from the pinhole's own formula."""
    camera = PinholeCamera(width_px=8, height_px=6, fx_px=10.0, fy_px=12.0, cx_px=3.5, cy_px=2.5)
    count = 4 * 3 * 4096
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, count)
    pixel = mi.UInt32(np.repeat(np.arange(12), 4096))
    ray = camera_rays(camera, RigidTransform.identity(), 4, 3)(pixel, sampler)
    direction = np.array(ray.d).T.reshape(12, 4096, 3)
    u = direction[..., 0] / direction[..., 2] * 10.0 + 3.5
    v = direction[..., 1] / direction[..., 2] * 12.0 + 2.5
    columns, rows = np.arange(12) % 4, np.arange(12) // 4
    np.testing.assert_allclose(u.min(axis=1), 2 * columns - 0.5, atol=0.01)
    np.testing.assert_allclose(u.max(axis=1), 2 * columns + 1.5, atol=0.01)
    np.testing.assert_allclose(v.min(axis=1), 2 * rows - 0.5, atol=0.01)
    np.testing.assert_allclose(v.max(axis=1), 2 * rows + 1.5, atol=0.01)
