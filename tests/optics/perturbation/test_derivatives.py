"""Derivatives of the projection: closed forms, central differences and their order, Newton differentiated directly."""

from __future__ import annotations

import numpy as np
import plain_perturbations
import pytest

from optics.camera import camera_from_spec
from optics.gaze.jacobian import direction_jacobian
from optics.kernels.backend import Array3f64, Float64, dr
from optics.layout import Layout
from optics.perturbation.derivatives import parameter_names, projection_jacobian, ray_jacobian
from optics.perturbation.train import PerturbedTrain
from optics.ports.port import port_from_spec
from optics.status import Status
from optics.train import pixel_grid
from rigs import Joint, Rig

Q1, Q2 = 0.3, 0.1

AQUA2 = Rig.load("aqua2")
BLUEROV2 = Rig.load("bluerov2")

TURNED_JOINTS = AQUA2.gaze.joints.model_copy(
    update={
        "pan": Joint(min_deg=-170, max_deg=170, offset_deg=12.0, sign=-1),
        "tilt": Joint(min_deg=-90, max_deg=90, offset_deg=-7.0, sign=-1),
    }
)

RIGS = {
    "flat": AQUA2,
    "tilted": AQUA2.with_gaze(joints=TURNED_JOINTS).model_copy(
        update={"port": AQUA2.port.model_copy(update={"normal": (0.1, -0.15, 1.0)})}
    ),
    "centred dome": BLUEROV2,
    "decentred dome": BLUEROV2.model_copy(
        update={
            "port": BLUEROV2.port.model_copy(update={"centre_mm": (2.0, -3.0, -8.0)}),
            "camera": BLUEROV2.camera.model_copy(
                update={"yaw_deg": 20.0, "pitch_deg": -10.0, "distortion": (-0.1, 0.02, 8e-4, -6e-4, 0.0)}
            ),
        }
    ),
    "bench": Rig.load("bench"),
    "rational": Rig.load("bench").model_copy(
        update={
            "camera": Rig.load("bench").camera.model_copy(
                update={"distortion": (0.1, -0.05, 8e-4, -6e-4, 0.01, 0.2, -0.03, 0.02)}
            )
        }
    ),
    "fisheye": Rig.model_validate(
        {
            **Rig.load("bench").model_dump(),
            "camera": {
                **Rig.load("bench").camera.model_dump(exclude={"distortion"}),
                "model": "fisheye",
                "distortion": (-0.02, 0.005, -0.001, 2e-4),
            },
        }
    ),
}

STEP = 2e-3
"""Metres, radians, and units of an index or a pixel: far above rounding, far below the curvature of anything."""

ROUNDING_PX = 1e-12
"""Of a projected pixel, as `test_train` sees it. A difference quotient magnifies it by 1 / STEP."""


def points_of(rig, count=12):
    """What some pixels see through the unbounded train, one of them on the axis, at 0.4 to 4 m."""
    train = unbounded(rig)
    pixels = np.vstack([pixel_grid(train.camera, 4, 3), [[train.camera.cx_px, train.camera.cy_px]]])
    rays = train.trace(pixels)
    seen = rays.status == Status.OK
    reach = np.geomspace(0.4, 4, len(pixels))[:, np.newaxis]
    assert seen[-1]
    return (rays.origin_m + reach * rays.direction)[seen]


def unbounded(rig, perturbations=(), q1=Q1, q2=Q2):
    return plain_perturbations.unbounded(rig, dict(perturbations), q1, q2)


def changed(rig, name, step):
    """The train with one parameter changed, made by the public classes."""
    if name in ("q1", "q2"):
        return unbounded(rig, **{"q1": Q1, "q2": Q2, name: {"q1": Q1, "q2": Q2}[name] + step})
    return unbounded(rig, {name: step})


def quotient(rig, points, name, step):
    """Central difference quotient, its error falling with the square of the step."""
    ends = []
    for way in (step, -step):
        if name.startswith("point"):
            shift = way * np.eye(3)["xyz".index(name.split("_")[1])]
            ends.append(unbounded(rig).project(points + shift).pixels)
        else:
            ends.append(changed(rig, name, way).project(points).pixels)
    return (ends[0] - ends[1]) / (2 * step)


@pytest.mark.parametrize("rig", RIGS)
def test_every_derivative_is_the_limit_of_difference_quotients(rig):
    """Central differences converge to it with the second order: halving the step quarters the error.

    Where they do not differ from it but for rounding, the parameter acts linearly and there is no order to see.
    Extrapolating two quotients (Richardson) leaves a fourth-order error, here under a fiftieth of the second-order one.
    """
    rig = RIGS[rig]
    points = points_of(rig)
    found = projection_jacobian(PerturbedTrain(rig), points, (Q1, Q2))
    # Two kernels, each with its rounding: a graphics card fuses products and sums in one as it does not in the other.
    np.testing.assert_allclose(found.outputs, unbounded(rig).project(points).pixels, rtol=0, atol=2 * ROUNDING_PX)
    for name in parameter_names(rig):
        coarse, fine = (quotient(rig, points, name, step) for step in (STEP, STEP / 2))
        exact = found.of(name)
        rounding = 20 * ROUNDING_PX / STEP
        error, finer = np.linalg.norm(coarse - exact), np.linalg.norm(fine - exact)
        np.testing.assert_allclose((4 * fine - coarse) / 3, exact, rtol=0, atol=rounding + 0.02 * finer, err_msg=name)
        if error > 1e4 * rounding:
            assert np.log2(error / finer) == pytest.approx(2, abs=0.05), name


def test_without_a_port_the_derivatives_are_those_of_a_pinhole():
    """Of u = fx x / z + cx: du/dx = fx / z, du/dz = -fx x / z^2, du/dfx = x / z."""
    bench = Rig.load("bench")
    rig = Rig.model_validate({**bench.model_dump(), "port": {"shape": "none"}})
    camera = rig.camera.model_copy(update={"distortion": (0.0,) * 5})
    rig = rig.model_copy(update={"camera": camera})
    x, y, z = point = np.array([0.1, -0.2, 2.0])
    found = projection_jacobian(PerturbedTrain(rig), [point])
    expected = {
        "point_x": (camera.fx_px / z, 0),
        "point_y": (0, camera.fy_px / z),
        "point_z": (-camera.fx_px * x / z**2, -camera.fy_px * y / z**2),
        "fx": (x / z, 0),
        "fy": (0, y / z),
        "cx": (1, 0),
        "cy": (0, 1),
    }
    # Brown-Conrady about no distortion: a unit of k1 moves u by fx x' r^2, of p1 by fx 2 x' y', and so on.
    a, b = x / z, y / z
    square = a**2 + b**2
    expected |= {
        "k1": (camera.fx_px * a * square, camera.fy_px * b * square),
        "k2": (camera.fx_px * a * square**2, camera.fy_px * b * square**2),
        "k3": (camera.fx_px * a * square**3, camera.fy_px * b * square**3),
        "p1": (camera.fx_px * 2 * a * b, camera.fy_px * (square + 2 * b**2)),
        "p2": (camera.fx_px * (square + 2 * a**2), camera.fy_px * 2 * a * b),
    }
    assert set(expected) == set(found.parameters)
    for name, derivative in expected.items():
        np.testing.assert_allclose(found.of(name)[0], derivative, rtol=1e-14, atol=1e-13)


def test_on_the_axis_of_a_flat_port_the_slope_is_the_apparent_depth():
    """Paraxial: a point at depths a, b, c in air, window, water appears at a + b / n_port + c / n_water."""
    rig = Rig.load("bench")
    port, camera = port_from_spec(rig.port, rig.water), rig.camera.model_copy(update={"distortion": (0.0,) * 5})
    rig = rig.model_copy(update={"camera": camera})
    depth = 1.5 - port.distance_m - port.thickness_m
    apparent = port.distance_m + port.thickness_m / port.n_port + depth / port.n_water
    found = projection_jacobian(PerturbedTrain(rig), [[0, 0, 1.5]], parameters=("point_x", "point_y"))
    np.testing.assert_allclose(
        found.values[0], np.diag([camera.fx_px, camera.fy_px]) / apparent, rtol=1e-13, atol=1e-10
    )


def test_a_fisheye_has_derivatives_on_its_axis():
    """The image is f t there, a pinhole's; the formula of the model divides zero by zero."""
    pinhole = RIGS["bench"].camera.model_dump(exclude={"model", "distortion"})
    rig = Rig.model_validate(
        {**RIGS["bench"].model_dump(), "camera": {"model": "fisheye", **pinhole}, "port": {"shape": "none"}}
    )
    found = projection_jacobian(
        PerturbedTrain(rig), [[0, 0, 2.0], [1e-7, 0, 2.0]], parameters=("point_x", "point_y", "point_z")
    )
    expected = np.array([[rig.camera.fx_px / 2, 0, 0], [0, rig.camera.fy_px / 2, 0]])
    # Off the axis by 5e-8 the derivative along z is f times that, over 2 m.
    np.testing.assert_allclose(found.values, np.stack([expected] * 2), rtol=0, atol=1e-4)


@pytest.mark.parametrize("rig", ["tilted", "decentred dome"])
def test_the_last_newton_step_carries_the_same_derivative(rig):
    """Where F = 0, d(x - F/F')/dp = -F_p/F': `project` differentiated as it stands, off the axis, gives the same."""
    rig = Rig.model_validate({**RIGS["bench"].model_dump(), "port": RIGS[rig].port.model_dump()})
    points = points_of(rig)[:-1]
    found = projection_jacobian(PerturbedTrain(rig), points, parameters=("point_x", "point_y", "point_z"))
    camera, port = camera_from_spec(rig.camera), port_from_spec(rig.port, rig.water)
    leaves = [Float64(np.ascontiguousarray(column)) for column in points.T]
    dr.enable_grad(*leaves)
    model, distorted = camera.kind
    direction, _, _ = port.project(port.parameters(), Array3f64(*leaves))
    for row, value in enumerate(model.pixel(camera.parameters(), distorted, direction)[:2]):
        dr.backward_from(value, flags=dr.ADFlag.ClearInterior)
        derivatives = np.stack([dr.grad(leaf).numpy() for leaf in leaves], axis=1)
        dr.clear_grad(leaves)
        # Derivatives are hundreds of pixels per metre.
        np.testing.assert_allclose(found.values[:, row], derivatives, rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("rig", RIGS)
def test_rays_turn_by_the_limit_of_difference_quotients(rig):
    """As for pixels: extrapolated central differences of `trace`, and the error's second order taken away."""
    rig = RIGS[rig]
    pixels = pixel_grid(unbounded(rig).camera, 4, 3)
    pixels = pixels[unbounded(rig).trace(pixels).status == Status.OK]
    in_air, _ = unbounded(rig).camera.unproject(pixels)
    found = ray_jacobian(PerturbedTrain(rig), in_air, (Q1, Q2))
    np.testing.assert_allclose(found.outputs, unbounded(rig).trace(pixels).direction, rtol=0, atol=1e-15)
    for index, name in enumerate(found.parameters):
        coarse, fine = (
            (changed(rig, name, step).trace(pixels).direction - changed(rig, name, -step).trace(pixels).direction)
            / (2 * step)
            for step in (STEP, STEP / 2)
        )
        # Unit vectors round to 1e-16, over the step 1e-13; the error of the fourth order is a fiftieth of the second's.
        exact = found.values[:, :, index]
        atol = 1e-12 + 0.02 * np.abs(fine - exact).max()
        np.testing.assert_allclose((4 * fine - coarse) / 3, exact, rtol=0, atol=atol, err_msg=name)


def test_the_gaze_turns_as_the_closed_form_says():
    """`optics.gaze.jacobian` has the direction's Jacobian by the joints in closed form, in the body frame."""
    layout = Layout.from_rig(AQUA2)
    found = ray_jacobian(PerturbedTrain(AQUA2), [[0.0, 0.0, 1.0]], (Q1, Q2), parameters=("q1", "q2"))
    turn = layout.body_from_camera.rotation.as_matrix()
    np.testing.assert_allclose(turn @ found.values[0], direction_jacobian(layout, Q1, Q2), rtol=0, atol=1e-14)


def test_a_ray_without_a_direction_has_no_derivative():
    rig = RIGS["bench"]
    found = ray_jacobian(PerturbedTrain(rig), [[0.0, 0.0, 1.0], [np.nan, 0.0, 1.0]])
    assert np.isnan(found.outputs[1]).all()
    assert np.isnan(found.values[1]).all()
    assert ray_jacobian(PerturbedTrain(rig), np.empty((0, 3))).values.shape == (0, 3, len(found.parameters))
    with pytest.raises(ValueError, match=r"expected parameters among .*, got fx"):
        ray_jacobian(PerturbedTrain(rig), [[0.0, 0.0, 1.0]], parameters=("fx",))


def test_a_plane_does_not_mind_being_moved_within_itself():
    found = projection_jacobian(PerturbedTrain(AQUA2), points_of(AQUA2), (Q1, Q2))
    for mirror in ("m1", "m2"):
        for freedom in ("shift_x", "shift_y", "turn_z"):
            np.testing.assert_allclose(found.of(f"{mirror}_{freedom}"), 0, atol=1e-10)
    # The tilt axis is M2's x; a positive tilt raises the normal, which is a negative turn about it.
    np.testing.assert_allclose(found.of("m2_turn_x"), -found.of("q2"), rtol=1e-12, atol=1e-9)


def test_poses_may_differ_from_point_to_point():
    q1, q2 = np.array([0.3, -0.8, 1.1]), np.array([0.1, 0.4, -0.2])
    points = np.stack([points_of(AQUA2)[0]] * 3)
    together = projection_jacobian(PerturbedTrain(AQUA2), points, np.stack([q1, q2], axis=1))
    for index in range(3):
        alone = projection_jacobian(PerturbedTrain(AQUA2), points[[index]], (q1[index], q2[index]))
        np.testing.assert_allclose(together.outputs[index], alone.outputs[0], rtol=0, atol=ROUNDING_PX)
        np.testing.assert_allclose(together.values[index], alone.values[0], rtol=1e-12, atol=1e-9)


def test_a_point_without_a_pixel_has_no_derivative():
    bench = RIGS["bench"]
    found = projection_jacobian(PerturbedTrain(bench), [[0, 0, 1e-3], [np.nan, 0, 1], [0.1, 0.1, 1.0]])
    assert np.isnan(found.values[:2]).all()
    assert np.isnan(found.outputs[:2]).all()
    assert np.isfinite(found.values[2]).all()
    assert projection_jacobian(PerturbedTrain(bench), np.empty((0, 3))).values.shape == (
        0,
        2,
        len(parameter_names(bench)),
    )


def test_wrong_arguments_are_refused():
    with pytest.raises(ValueError, match=r"expected parameters among point_x, .*, got q1"):
        projection_jacobian(PerturbedTrain(RIGS["bench"]), [[0, 0, 1]], parameters=("q1",))
    with pytest.raises(ValueError, match=r"expected q of shape \(..., 2\), got \(1,\)"):
        projection_jacobian(PerturbedTrain(AQUA2), [[0, 0, 1]], [0.1])
