"""Figures of water and light: what the water does, how light fades, and how far two renderers are apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_table
from optics.water.inherent_optics import InherentOptics
from optics.water.radiative_transfer import RadianceField
from optics.water.radiative_transfer.pend_oreille import ComparedLayers, ComparedRadiance
from optics.water.scattering import PhaseFunction
from reports.figures.plotting import INK, STYLE
from scenes.image import display_image
from scenes.light.spectrum import CHANNELS, DATA
from scenes.reference.agreement import Agreement
from scenes.stage.frame import Frame
from scenes.stage.scene import Scene

Image = NDArray[np.uint8]

CHANNEL_COLOURS = ("#d1495b", "#2a9d8f", "#30638e")
DEPTH_COLOUR_MAP = "viridis_r"
GREEN = CHANNELS.index("green")

WAVELENGTH_COLOURS = {443.0: "#30638e", 532.0: "#2a9d8f", 670.0: "#d1495b"}
"""Of the measured flicker."""


def image_balanced_at_surface(frame: Frame, scene: Scene) -> Image:
    """Frame as a camera shows it that took its white balance at the surface, shape (height, width, 3).

    `scenes.image.display_image` takes it at depth, as a careful diver does, and so hides how red fades. Exposure is
    the same: a white card at the robot's depth keeps its green.
    """
    here, above = scene.light.white_radiance(scene.depth_m), scene.light.white_radiance(0.0)
    kept = here / above / (here[GREEN] / above[GREEN])
    return display_image(replace(frame, radiance=(frame.radiance * kept).astype(np.float32)), scene)


def coefficients_figure(waters: Mapping[str, InherentOptics]) -> Figure:
    """Absorption and scattering of waters over the wavelength."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        for position, (name, optics) in enumerate(waters.items()):
            for axes, values in ((left, optics.absorption), (right, optics.scattering)):
                axes.semilogy(optics.wavelength_nm, values, label=name, color=f"C{position}")
        for axes, title in ((left, "absorption a (1/m)"), (right, "scattering b (1/m)")):
            axes.set_title(title)
            axes.set_xlabel("wavelength (nm)")
        right.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False, fontsize=8)
    return figure


def phase_figure(phases: Mapping[str, PhaseFunction]) -> Figure:
    """Phase functions over the scattering angle, and the share of the light that is scattered by less."""
    angle = np.geomspace(1e-3, np.pi, 400)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        for name, phase in phases.items():
            left.loglog(np.degrees(angle), phase(angle), label=name)
            right.semilogx(np.degrees(angle), [phase.fraction_within(each) for each in angle], label=name)
        left.set_title("phase function (1/sr)")
        right.set_title("share scattered by less")
        for axes in (left, right):
            axes.set_xlabel("scattering angle (degrees)")
        left.legend(loc="lower left", frameon=False, fontsize=8)
    return figure


def attenuation_figure(field: RadianceField, tabulated: FloatArray, *, deepest_m: float = 20.0) -> Figure:
    """Kd by depth at each wavelength of a field, with a campaign's table as dots at the left edge, and mean cosines."""
    shown = field.depth_m <= deepest_m
    depth = field.depth_m[shown]
    colours = mpl.colormaps["turbo"](np.clip((field.wavelength_nm - 400) / 300, 0, 1))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        for row, table, wavelength, colour in zip(
            field.diffuse_attenuation, tabulated, field.wavelength_nm, colours, strict=True
        ):
            left.semilogx(row[shown], depth, color=colour, label=f"{wavelength:.0f} nm")
            left.plot(table, 0, "o", color=colour, clip_on=False)
        for rows, style in ((field.mean_cosine_down, "-"), (field.mean_cosine_up, "--")):
            for row, colour in zip(rows, colours, strict=True):
                right.plot(row[shown], depth, style, color=colour)
        left.set_title("Kd (1/m), tabulated as dots")
        right.set_title("mean cosine of light from above (-) and from below (--)")
        for axes in (left, right):
            axes.set_ylabel("depth (m)")
            axes.set_ylim(deepest_m, 0)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=9, frameon=False, fontsize=7)
    return figure


def lake_figure(radiance: ComparedRadiance, layers: ComparedLayers) -> Figure:
    """Lake Pend Oreille: radiance in the plane of the sun by depth, and Eu/Ed and mean cosines; dots are measured."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.5, 4.2), layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=[1.7, 1, 1])
        _sun_plane(left, radiance)
        pairs = ((layers.mean_cosine_down, "from above", "C0"), (layers.mean_cosine_up, "from below", "C1"))
        for (measured, computed), name, colour in pairs:
            middle.plot(measured, layers.depth_m, "o", color=colour)
            middle.plot(computed, layers.depth_m, color=colour, label=name)
        middle.set_title("mean cosine")
        middle.legend(loc="lower center", frameon=False, fontsize=8)
        right.plot(layers.irradiance_ratio[0], layers.depth_m, "o", color=INK)
        right.plot(layers.irradiance_ratio[1], layers.depth_m, color=INK)
        right.set_title("Eu / Ed")
        right.set_xlim(left=0)
        for axes in (middle, right):
            axes.set_ylabel("depth (m)")
            axes.invert_yaxis()
    return figure


def _sun_plane(axes: Axes, radiance: ComparedRadiance) -> None:
    """Radiance along the circle through zenith, sun, nadir; open dots where the report itself doubts the reading."""
    colours = mpl.colormaps[DEPTH_COLOUR_MAP](np.linspace(0.1, 1, len(radiance.depth_m)))
    towards, away = 0, len(radiance.azimuth_deg) - 1
    tilt = np.concatenate([-radiance.tilt_deg[::-1], radiance.tilt_deg])
    for z, colour in enumerate(colours):

        def around(values: NDArray[np.generic], z: int = z) -> NDArray[np.generic]:
            return np.concatenate([values[z, ::-1, away], values[z, :, towards]])

        measured, doubted = around(radiance.measured), around(radiance.suspect).astype(bool)
        axes.semilogy(tilt, around(radiance.computed), color=colour, label=f"{radiance.depth_m[z]:.1f} m")
        axes.semilogy(tilt[~doubted], measured[~doubted], "o", color=colour, markersize=4)
        axes.semilogy(tilt[doubted], measured[doubted], "o", color=colour, markersize=4, fillstyle="none")
    axes.set_title("radiance in the plane of the sun (relative)")
    axes.set_xlabel("direction looked along, from the zenith towards the sun (degrees)")
    axes.legend(loc="upper left", frameon=False, fontsize=7)


def images_figure(images: Sequence[Sequence[Image]], rows: Sequence[str], columns: Sequence[str]) -> Figure:
    """Images side by side, named by row and column."""
    shape = len(rows), len(columns)
    if any(len(row) != shape[1] for row in images) or len(images) != shape[0]:
        raise ValueError(f"expected {shape[0]} x {shape[1]} images, got rows of {[len(row) for row in images]}")
    height, width = images[0][0].shape[:2]
    inches = 10.5 / shape[1]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.5, shape[0] * inches * height / width + 0.4), layout="constrained")
        grid = figure.subplots(*shape, squeeze=False)
        for axes_of_row, row in zip(grid, images, strict=True):
            for axes, image in zip(axes_of_row, row, strict=True):
                axes.imshow(image, interpolation="nearest")
                axes.set(xticks=[], yticks=[])
        for axes, name in zip(grid[0], columns, strict=True):
            axes.set_title(name)
        for axes, name in zip(grid[:, 0], rows, strict=True):
            axes.set_ylabel(name)
    return figure


def flicker_figure(depth_m: FloatArray, variation: FloatArray) -> Figure:
    """Coefficient of variation of what a camera saw by channel, shape (3, z), beside what Darecki et al. measured."""
    table = read_table(DATA / "darecki2011_irradiance_cv.csv")
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 3.8), layout="constrained")
        axes = figure.subplots()
        for wavelength, colour in WAVELENGTH_COLOURS.items():
            rows = table["wavelength_nm"] == wavelength
            label = f"measured, {wavelength:.0f} nm"
            axes.plot(table["cv"][rows], table["depth_m"][rows], "o", color=colour, label=label)
        for name, row, colour in zip(CHANNELS, variation, CHANNEL_COLOURS, strict=True):
            axes.plot(row, depth_m, color=colour, label=f"rendered, {name}")
        axes.set_xscale("log")
        axes.set_xlabel("coefficient of variation")
        axes.set_ylabel("depth (m)")
        axes.invert_yaxis()
        axes.legend(loc="lower right", frameon=False, fontsize=8)
    return figure


def bias_figure(scenes: Mapping[str, Sequence[Agreement]], *, bound: float) -> Figure:
    """Bias of the fast renderer by scene, set of pixels and channel, with twice its standard error."""
    rows = [(f"{scene}: {each.name}", each) for scene, found in scenes.items() for each in found]
    places = np.arange(len(rows))[::-1]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.5, 0.32 * len(rows) + 1.0), layout="constrained")
        axes = figure.subplots()
        axes.axvspan(-100 * bound, 100 * bound, color=INK, alpha=0.08, linewidth=0)
        for channel, (name, colour) in enumerate(zip(CHANNELS, CHANNEL_COLOURS, strict=True)):
            bias = [100 * each.bias[channel] for _, each in rows]
            error = [200 * each.standard_error[channel] for _, each in rows]
            shifted = places + 0.2 * (1 - channel)
            axes.errorbar(bias, shifted, xerr=error, fmt="o", color=colour, markersize=4, label=name)
        axes.axvline(0, color=INK, linewidth=0.8)
        axes.set_yticks(places, [name for name, _ in rows])
        axes.set_xlabel("fast over reference, minus 1 (%)")
        axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
    return figure
