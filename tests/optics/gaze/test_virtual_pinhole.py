"""The pinhole nearest to the train: exact where there is one, its residual where there is none, bent mirror edges."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
import yaml

from optics.gaze.camera_files import OPENCV_FILE, ROS_FILE, write_camera_files
from optics.gaze.kinematics import virtual_camera
from optics.gaze.mirror_edges import mirror_edges
from optics.gaze.virtual_pinhole import DISTANCES_M, fit_virtual_pinhole, residuals_at
from optics.layout import Layout
from optics.ports.port import port_from_spec
from optics.train import OpticalTrain
from rigs import Rig

AQUA2, BLUEROV2 = Rig.load("aqua2"), Rig.load("bluerov2")
Q = {"q1": np.radians(30.0), "q2": np.radians(-10.0)}

FITTED_EXACTLY_PX = 1e-9
"""A fit that can be exact stops at rounding, 1e-13 px, times the condition of its fifteen unknowns."""


def offset_of(rig, virtual):
    """Pose of the fitted camera relative to the two reflections: shift in metres, turn in radians."""
    off = virtual_camera(Layout.from_rig(rig), **Q).inv() * virtual.body_from_virtual
    return off.translation, off.rotation.as_rotvec()


def test_behind_a_centred_dome_the_pinhole_is_exact():
    """A centred dome refracts nothing: the fit returns the camera itself, at the pose of the two reflections."""
    virtual = fit_virtual_pinhole(BLUEROV2, **Q)
    camera = BLUEROV2.camera
    found = [virtual.camera.fx_px, virtual.camera.fy_px, virtual.camera.cx_px, virtual.camera.cy_px]
    np.testing.assert_allclose(found, [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px], rtol=0, atol=1e-8)
    shift, turn = offset_of(BLUEROV2, virtual)
    np.testing.assert_allclose(shift, 0, atol=1e-10)
    np.testing.assert_allclose(turn, 0, atol=1e-10)
    assert max(row.largest_px for row in virtual.residuals) < FITTED_EXACTLY_PX


def test_behind_a_flat_port_it_is_the_longer_lens_at_the_entrance_pupil():
    """Paraxial optics of a flat port: f grows by n_water, and the centre moves along the axis to the virtual pupil.

    A ray of a small slope s in air leaves the outer face at (d + t / n_port) s with the slope s / n_water in the water:
    it seems to come from n_water (d + t / n_port) behind that face, which itself is d + t in front of the pinhole. For
    the aqua2 that is 6 mm behind the pinhole. What a wide field adds falls with its square: with the image full of the
    gaze mirror, a lens twice as long comes four times as close.
    """
    port = port_from_spec(AQUA2.port, AQUA2.water)
    pupil = port.distance_m + port.thickness_m - port.n_water * (port.distance_m + port.thickness_m / port.n_port)
    errors = []
    for zoom in (4, 8):
        camera = AQUA2.camera.model_copy(update={"fx_px": 500.0 * zoom, "fy_px": 500.0 * zoom})
        rig = AQUA2.model_copy(update={"camera": camera})
        virtual = fit_virtual_pinhole(rig, **Q)
        shift, turn = offset_of(rig, virtual)
        np.testing.assert_allclose(shift[:2], 0, atol=1e-5)
        np.testing.assert_allclose(turn, 0, atol=1e-4)
        errors.append([virtual.camera.fx_px / camera.fx_px / port.n_water - 1, shift[2] / pupil - 1])
    np.testing.assert_allclose(errors[0], 0, atol=0.02)
    np.testing.assert_allclose(np.divide(*errors), 4, rtol=0.1)


def test_the_residual_is_the_distance_to_the_exact_projection():
    """By another way: OpenCV projects, the exact train projects, at points nobody fitted."""
    virtual = fit_virtual_pinhole(AQUA2, **Q)
    train = OpticalTrain.from_rig(AQUA2, **Q)
    rng = np.random.default_rng(4)
    left, top, right, bottom = virtual.region_px
    rays = train.trace(rng.uniform([left, top], [right, bottom], (500, 2)))
    points = rays.origin_m + rng.uniform(0.5, 10, (500, 1)) * rays.direction
    image = train.project(points)
    seen = (image.status == 0) & (rays.status == 0)
    assert seen.sum() > 200
    body = Layout.from_rig(AQUA2).body_from_camera.apply(points[seen])
    pose = virtual.body_from_virtual.inv()
    found, _ = cv2.projectPoints(
        np.ascontiguousarray(body),
        pose.rotation.as_rotvec(),
        pose.translation,
        virtual.camera_matrix,
        np.array(virtual.camera.distortion),
    )
    off = np.linalg.norm(found.reshape(-1, 2) - image.pixels[seen], axis=1)
    # The cells fitted reach to within half a cell, 5 px, of where these points are.
    assert off.max() < 1.5 * max(row.largest_px for row in virtual.residuals)
    assert off.max() > 0.1 * max(row.largest_px for row in virtual.residuals)


def test_a_fit_at_one_distance_is_worse_at_others():
    """Refraction makes it depend on distance: 1e-4 px where fitted, a hundred times more elsewhere."""
    virtual = fit_virtual_pinhole(AQUA2, **Q, distances_m=[2.0])
    near, fitted, far = residuals_at(AQUA2, virtual, [0.5, 2.0, 10.0])
    assert fitted.rms_px < 1e-3
    assert min(near.rms_px, far.rms_px) > 10 * fitted.rms_px


def test_fitted_over_the_distances_it_stays_below_a_tenth_of_a_pixel():
    virtual = fit_virtual_pinhole(AQUA2, **Q)
    assert [row.distance_m for row in virtual.residuals] == list(DISTANCES_M)
    assert max(row.largest_px for row in virtual.residuals) < 0.1
    for row in virtual.residuals:
        assert row.rms_px <= row.largest_px


def test_opencv_reads_the_file(tmp_path):
    virtual = fit_virtual_pinhole(AQUA2, **Q)
    opencv, _ = write_camera_files(virtual, "aqua2_virtual", tmp_path / "camera")
    storage = cv2.FileStorage(str(opencv), cv2.FILE_STORAGE_READ)
    assert storage.isOpened()
    # Every digit survives.
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), virtual.camera_matrix)
    np.testing.assert_array_equal(storage.getNode("distortion_coefficients").mat(), [virtual.camera.distortion])
    pose = virtual.body_from_virtual.as_matrix()
    np.testing.assert_array_equal(storage.getNode("body_from_virtual_camera").mat(), pose)
    np.testing.assert_array_equal(storage.getNode("fitted_at_m").mat(), [DISTANCES_M])
    assert storage.getNode("image_width").real() == 640
    storage.release()
    assert sorted(path.name for path in opencv.parent.iterdir()) == sorted([OPENCV_FILE, ROS_FILE])


def test_ros_reads_the_file(tmp_path):
    """The keys that camera_calibration_parsers asks for (parse_yml.cpp), with matrices row by row."""
    virtual = fit_virtual_pinhole(AQUA2, **Q)
    _, ros = write_camera_files(virtual, "aqua2_virtual", tmp_path)
    info = yaml.safe_load(ros.read_text())
    assert (info["image_width"], info["image_height"]) == (640, 480)
    assert (info["camera_name"], info["distortion_model"]) == ("aqua2_virtual", "plumb_bob")
    shapes = {
        "camera_matrix": (3, 3),
        "distortion_coefficients": (1, 5),
        "rectification_matrix": (3, 3),
        "projection_matrix": (3, 4),
    }
    for name, shape in shapes.items():
        assert (info[name]["rows"], info[name]["cols"]) == shape
        assert len(info[name]["data"]) == shape[0] * shape[1]
    np.testing.assert_array_equal(np.reshape(info["camera_matrix"]["data"], (3, 3)), virtual.camera_matrix)
    np.testing.assert_array_equal(info["distortion_coefficients"]["data"], virtual.camera.distortion)
    np.testing.assert_array_equal(np.reshape(info["projection_matrix"]["data"], (3, 4))[:, :3], virtual.camera_matrix)


def test_wrong_arguments_are_refused():
    with pytest.raises(ValueError, match=r"expected distances_m > 0, at least one, got \[0\.0\]"):
        fit_virtual_pinhole(AQUA2, distances_m=[0.0])
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        fit_virtual_pinhole(Rig.load("bench"))
    with pytest.raises(ValueError, match=r"expected q1 \(pan\) between -77\.5 and 77\.5 deg, got nan"):
        fit_virtual_pinhole(AQUA2, q1=np.nan)
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        mirror_edges(Rig.load("bench"))
    # A mirror turned edge-on to the light: the face is out of view.
    steep = AQUA2.with_gaze(gaze_mirror={"width_mm": 4.0, "height_mm": 4.0})
    with pytest.raises(ValueError, match=r"expected a pose at which the gaze mirror is in view, .* fills \d+ of 3072"):
        fit_virtual_pinhole(steep)


def test_without_refraction_the_edges_are_straight():
    """Planes and a pinhole map lines to lines: the paper's quadrilateral."""
    for edge in mirror_edges(BLUEROV2, **Q):
        assert edge.deviation_px < 1e-9
        assert edge.visible.any()


def test_a_flat_port_bends_the_edges_by_pixels():
    """For the aqua2, level: an edge's deviation from its chord, from traced rays that strike M2's outline.

    The pixel of a point of the edge is also where the ray of that pixel, followed over both mirrors, hits the point.
    """
    edges = mirror_edges(AQUA2)
    assert max(edge.deviation_px for edge in edges) == pytest.approx(2.0, abs=0.1)
    train = OpticalTrain.from_rig(AQUA2)
    for edge, (start, end) in zip(
        edges, zip(c := train.mirrors[1].corners_m, np.roll(c, -1, axis=0), strict=True), strict=True
    ):
        assert edge.visible.all()
        mirrors = tuple(replace(mirror, outline=None) for mirror in train.mirrors)
        rays = replace(train, mirrors=mirrors).trace(edge.pixels)
        along = np.linspace(0, 1, len(edge.pixels))[:, np.newaxis]
        np.testing.assert_allclose(rays.origin_m, start + along * (end - start), rtol=0, atol=1e-12)


def test_the_edges_deviation_is_that_of_a_bent_line():
    """A symmetric edge bends most in its middle: the sagitta, measured there by hand."""
    edge = mirror_edges(AQUA2)[0]
    middle = edge.pixels[len(edge.pixels) // 2]
    ends = edge.pixels[[0, -1]]
    # The bottom edge is level in the image and symmetric about the axis.
    assert ends[0][1] == pytest.approx(ends[1][1], abs=1e-9)
    assert edge.deviation_px == pytest.approx(abs(middle[1] - ends[0][1]), abs=1e-9)
