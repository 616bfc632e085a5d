"""Figures of light: they show the numbers they are given, and colours as they fade."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from optics.water.inherent_optics import inherent_optics
from optics.water.radiative_transfer.pend_oreille import compared_layers, compared_radiance
from optics.water.scattering import henyey_greenstein_phase
from reports.figures.light import (
    attenuation_figure,
    bias_figure,
    coefficients_figure,
    flicker_figure,
    image_balanced_at_surface,
    images_figure,
    lake_figure,
    phase_figure,
)
from rigs import Rig, Water
from scenes.image import WHITE_LEVEL, display_image
from scenes.reference.agreement import Agreement
from scenes.stage.frame import Frame
from scenes.stage.scene import make_scene


@pytest.fixture(scope="module")
def open_water():
    return make_scene(Rig.load("aqua2"), world="blue", depth_m=10.0)


def frame_of(radiance):
    """A frame that shows one radiance everywhere; the rest of it does not matter."""
    shape = (2, 3)
    empty = np.zeros(shape)
    return Frame(
        radiance=np.broadcast_to(radiance, (*shape, 3)).astype(np.float32),
        distance_m=empty,
        point_m=np.zeros((*shape, 3)),
        normal=np.zeros((*shape, 3)),
        label=empty.astype(np.uint8),
        region=empty.astype(np.uint8),
        instance=empty.astype(np.int32),
        target_fraction=empty,
    )


def encoded(linear):
    """IEC 61966-2-1, of values above its toe."""
    return 255 * (1.055 * np.asarray(linear) ** (1 / 2.4) - 0.055)


def card(scene):
    """White card held level at the robot's depth, behind the port: radiance falls by the square of the index."""
    return scene.light.white_radiance(scene.depth_m) / scene.light.n_water**2


ROUNDING = 0.51
"""Half a grey level, and single precision."""


def test_a_white_card_loses_its_red_with_depth_and_keeps_its_green(open_water):
    """Closed form: the card's colour is the ratio of its channels here and at the surface."""
    red, green, blue = image_balanced_at_surface(frame_of(card(open_water)), open_water)[0, 0].astype(float)
    kept = open_water.light.white_radiance(10.0) / open_water.light.white_radiance(0.0)
    assert green == pytest.approx(encoded(WHITE_LEVEL), abs=ROUNDING)
    assert red == pytest.approx(encoded(WHITE_LEVEL * kept[0] / kept[1]), abs=ROUNDING)
    assert red < green < blue
    balanced_at_depth = display_image(frame_of(card(open_water)), open_water)[0, 0]
    assert balanced_at_depth == pytest.approx(encoded(WHITE_LEVEL), abs=ROUNDING)


def test_a_card_at_the_surface_is_white(open_water):
    """There is nothing to balance where the balance was taken."""
    lifted = replace(open_water, world_from_body=RigidTransform.from_translation([0.0, 0.0, 0.0]))
    shown = image_balanced_at_surface(frame_of(card(lifted)), lifted)
    assert shown == pytest.approx(encoded(WHITE_LEVEL), abs=ROUNDING)


def test_coefficients_and_phase_functions_are_drawn_as_they_are():
    optics = inherent_optics(Water(jerlov_type="III"), np.array([450.0, 550.0, 650.0]))
    left, right = coefficients_figure({"III": optics}).axes
    assert left.lines[0].get_ydata() == pytest.approx(optics.absorption)
    assert right.lines[0].get_ydata() == pytest.approx(optics.scattering)
    isotropic = henyey_greenstein_phase(0.0)
    density, share = phase_figure({"isotropic": isotropic}).axes
    # The table's own error of isotropic scattering is 3e-6 (`docs/explanation/water.md`).
    assert density.lines[0].get_ydata() == pytest.approx(1 / (4 * np.pi), rel=1e-5)
    angle = np.radians(share.lines[0].get_xdata())
    assert share.lines[0].get_ydata() == pytest.approx((1 - np.cos(angle)) / 2, abs=1e-5)


def test_attenuation_is_drawn_to_the_depth_asked_for(open_water):
    field = open_water.light.field
    tabulated = np.full(len(field.wavelength_nm), 0.1)
    left, right = attenuation_figure(field, tabulated, deepest_m=10.0).axes
    assert len(left.lines) == len(right.lines) == 2 * len(field.wavelength_nm)
    shown = field.depth_m <= 10.0
    assert left.lines[0].get_xdata() == pytest.approx(field.diffuse_attenuation[0, shown])
    assert left.lines[1].get_xdata() == pytest.approx([0.1])


def test_the_lake_is_drawn_with_all_its_readings():
    radiance, layers = compared_radiance(), compared_layers()
    plane, cosines, ratio = lake_figure(radiance, layers).axes
    drawn = sum(len(line.get_ydata()) for line in plane.lines if line.get_marker() == "o")
    assert drawn == radiance.depth_m.size * 2 * radiance.tilt_deg.size
    assert cosines.lines[0].get_xdata() == pytest.approx(layers.mean_cosine_down[0])
    assert ratio.lines[1].get_xdata() == pytest.approx(layers.irradiance_ratio[1])


def test_images_stand_in_rows_and_columns():
    images = [[np.full((4, 6, 3), 10 * row + column, dtype=np.uint8) for column in range(3)] for row in range(2)]
    figure = images_figure(images, ["a", "b"], ["1", "2", "3"])
    assert [axes.images[0].get_array()[0, 0, 0] for axes in figure.axes] == [0, 1, 2, 10, 11, 12]
    assert [axes.get_title() for axes in figure.axes[:3]] == ["1", "2", "3"]
    assert [figure.axes[k].get_ylabel() for k in (0, 3)] == ["a", "b"]
    with pytest.raises(ValueError, match=r"expected 2 x 2 images, got rows of \[3, 3\]"):
        images_figure(images, ["a", "b"], ["1", "2"])


def test_flicker_is_drawn_beside_all_that_was_measured():
    (axes,) = flicker_figure(np.array([1.0, 2.0]), np.array([[0.3, 0.2], [0.2, 0.1], [0.1, 0.05]])).axes
    measured, rendered = axes.lines[:3], axes.lines[3:]
    # Rows of the data file: six depths at three wavelengths.
    assert sum(len(line.get_xdata()) for line in measured) == 18
    assert [list(line.get_xdata()) for line in rendered] == [[0.3, 0.2], [0.2, 0.1], [0.1, 0.05]]


def test_biases_are_drawn_in_per_cent_with_twice_their_error():
    found = Agreement(
        name="whole image",
        pixels=10,
        fast=(1.02, 1.0, 1.0),
        reference=(1.0, 1.0, 1.0),
        bias=(0.02, 0.0, -0.01),
        standard_error=(0.005, 0.01, 0.02),
        z=(4.0, 0.0, -0.5),
    )
    (axes,) = bias_figure({"tank": [found]}, bound=0.03).axes
    for container, bias, error in zip(axes.containers, (2.0, 0.0, -1.0), (1.0, 2.0, 4.0), strict=True):
        points, _, (bars,) = container
        assert points.get_xdata() == pytest.approx([bias])
        assert bars.get_segments()[0][:, 0] == pytest.approx([bias - error, bias + error])
    assert [label.get_text() for label in axes.get_yticklabels()] == ["tank: whole image"]
