"""What the studio's processes are asked and answer: plain data, for which the page's process needs no renderer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from optics.gaze.sights import Sights
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from rigs import Rig
from studio.surroundings import Overlay, Surroundings

Fineness = Literal["coarse", "fine"]


@dataclass(frozen=True, kw_only=True)
class ViewRequest:
    """A pose, and how it is to be seen.

    Attributes
    ----------
    rig : Rig
    surroundings : Surroundings
    q1_deg, q2_deg : float
    width_px : int
        The height follows from the camera's.
    overlay : {"none", "regions", "labels", "distance"}
    sensor : bool
        As the rig's image sensor takes it, with its noise.
    full : bool
        Look whether the full light is in the cache by now.
    asked_s : float
        When it was asked for, on `time.monotonic`'s clock, which processes share.
    """

    rig: Rig
    surroundings: Surroundings
    q1_deg: float
    q2_deg: float
    width_px: int = 640
    overlay: Overlay = "none"
    sensor: bool = False
    full: bool = False
    asked_s: float = 0.0


@dataclass(frozen=True, kw_only=True)
class View:
    """What the camera sees at a pose.

    Attributes
    ----------
    request : ViewRequest
    image : array of uint8, shape (height, width, 3)
    light : {"draft", "full"}
    target_px : tuple of two floats, optional
        Where the target's centre is by the optics alone, pixels of the image; None when the camera does not see it.
    target_m : array, shape (3,)
        Body frame.
    target_radius_m : float
        Half of its extent.
    axis_m : array, shape (k, 3)
        The central ray: pinhole, port, M1, M2 and out, as far as it gets; body frame.
    cone_m : array, shape (2, k, 3)
        Rays at the rim of what both mirrors pass: where they leave M2, and further out; body frame.
    gaze_deg : tuple of three floats
        Azimuth, elevation and roll of the image.
    region : array of uint8, shape (height, width)
        `optics.status.Region` of each pixel.
    sights : Sights
        Where pixels look.
    render_ms : float
        Of the image.
    """

    request: ViewRequest
    image: NDArray[np.uint8]
    light: str
    target_px: tuple[float, float] | None
    target_m: FloatArray
    target_radius_m: float
    axis_m: FloatArray
    cone_m: FloatArray
    gaze_deg: tuple[float, float, float]
    region: NDArray[np.uint8]
    sights: Sights
    render_ms: float


@dataclass(frozen=True, kw_only=True)
class Shell:
    """The sphere of directions as triangles, seen from outside through its near half.

    Attributes
    ----------
    vertices : array, shape (cells, 3)
        Unit vectors of the body frame.
    faces : array of int, shape (m, 3)
        Clockwise as seen from outside.
    colours : array of uint8, shape (cells, 3)
        By how many poses see a direction, or by what makes it blind.
    blind : tuple of (str, tuple of three ints, float)
        What makes directions blind, its colour and its share of the sphere, the largest first.
    """

    vertices: FloatArray
    faces: NDArray[np.int32]
    colours: NDArray[np.uint8]
    blind: tuple[tuple[str, tuple[int, int, int], float], ...]


@dataclass(frozen=True, kw_only=True)
class Covered:
    """What some pose of a rig shows of the sphere.

    Attributes
    ----------
    rig : Rig
    fineness : {"coarse", "fine"}
    shell : Shell
    covered, upper, lower : float
        Shares of the sphere and of its halves.
    mean_msr, most_msr : float
        Usable field of view over both mirrors, millisteradians, over the poses.
    pixels_per_degree : float
        Median of the best resolution over the seen cells.
    elapsed_s : float
    """

    rig: Rig
    fineness: Fineness
    shell: Shell
    covered: float
    upper: float
    lower: float
    mean_msr: float
    most_msr: float
    pixels_per_degree: float
    elapsed_s: float


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Parts of a rig as triangles.

    Attributes
    ----------
    rig : Rig
    meshes : tuple of PartMesh
    mass_kg : dict
        What each part but the hull weighs in air, by its name.
    elapsed_s : float
    """

    rig: Rig
    meshes: tuple[PartMesh, ...]
    mass_kg: dict[str, float]
    elapsed_s: float


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """Sentences on what is wrong with a rig, none when nothing is."""

    rig: Rig
    sentences: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Checked:
    """What the checks of a built mount found.

    Attributes
    ----------
    rig : Rig
    rows : tuple of (str, str, str)
        Check, how many findings passed, and the one that is nearest to its limit.
    problems : tuple of str
        What is wrong.
    clearance_mm : dict
        Smallest proven gap of each part that others move past, by its name.
    print_s : dict
        Print time of each printed part, by its name; empty when something is wrong.
    sliced : bool
        Whether a slicer says so, or it is estimated.
    """

    rig: Rig
    rows: tuple[tuple[str, str, str], ...]
    problems: tuple[str, ...]
    clearance_mm: dict[str, float]
    print_s: dict[str, float]
    sliced: bool
