"""Where a camera can look out of a hull: its port stands proud of the skin at the nose, in the plane of symmetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cad.hulls.camera_housing import HOUSING_MM, housing_radius_mm, port_ahead_mm
from cad.placement.hull_field import HullField
from optics.kernels.arrays import FloatArray
from rigs import Rig

PROUD_MM = 5.0
"""How far the port's outer face stands in front of the skin: as on the presets."""
RIM_MM = 8.0
"""Around the port's aperture: its seal and flange."""
SITE_MM = 20.0
"""Sites are tried this far apart."""
DEEPEST_MM = 250.0
"""A port further behind the foremost point of the hull than this is not at the nose."""
BACKING_MM = 60.0
"""The hull comes within this behind at least half of the port's disc: a camera needs something to be held by."""


@dataclass(frozen=True, kw_only=True)
class CameraSite:
    """A place for the camera.

    Attributes
    ----------
    pinhole_mm : tuple of three floats
    ahead_mm : float
        From the pinhole to the port's outer face.
    radius_mm : float
        Of what the camera takes up about its view at least, `HOUSING_MM` back from that face: of the port without rim.
    behind_nose_mm : float
        How far the port's face is behind the hull's foremost point.
    gap_mm : float
        Mean gap between the port's disc and the skin behind it, at most `BACKING_MM`.
    """

    pinhole_mm: tuple[float, float, float]
    ahead_mm: float
    radius_mm: float
    behind_nose_mm: float = 0.0
    gap_mm: float = 0.0

    def room_mm(self, points_mm: FloatArray) -> float:
        """How far points, shape (n, 3), are from the camera at least, where they are beside it; negative within."""
        away = points_mm - self.pinhole_mm
        beside = (away[:, 0] < self.ahead_mm) & (away[:, 0] > self.ahead_mm - HOUSING_MM)
        return float(np.hypot(*away[beside, 1:].T).min(initial=np.inf)) - self.radius_mm


def pinned_site(rig: Rig, pinhole_mm: tuple[float, float, float]) -> CameraSite:
    """The place of a rig's camera where the user has chosen it."""
    return CameraSite(pinhole_mm=pinhole_mm, ahead_mm=port_ahead_mm(rig), radius_mm=housing_radius_mm(rig))


def port_radius_mm(rig: Rig) -> float:
    """Radius of what a port takes up on the hull."""
    return housing_radius_mm(rig) + RIM_MM


def camera_sites(rig: Rig, space: HullField, y_mm: float) -> list[CameraSite]:
    """Places for a rig's camera in the plane of one y, from the bottom of the hull to its top."""
    ahead = port_ahead_mm(rig)
    fronts = _fronts_mm(space)
    y, z = space.axis(1), space.axis(2)
    nose = float(np.nanmax(fronts))
    radius = port_radius_mm(rig)
    sites = []
    tip = float(z[np.unravel_index(np.nanargmax(fronts), fronts.shape)[1]])
    first, last = np.ceil((z[0] + radius - tip) / SITE_MM), np.floor((z[-1] - radius - tip) / SITE_MM)
    for level in tip + SITE_MM * np.arange(first, last + 1):
        disc = (y[:, np.newaxis] - y_mm) ** 2 + (z[np.newaxis] - level) ** 2 <= radius**2
        skin = fronts[disc]
        if np.isnan(skin).all():
            continue
        face = float(np.nanmax(skin)) + PROUD_MM
        gaps = np.minimum(np.nan_to_num(face - skin, nan=BACKING_MM), BACKING_MM)
        if np.mean(gaps < BACKING_MM) < 0.5 or face < nose - DEEPEST_MM:
            continue
        pinhole = (round(face - ahead, 1), round(y_mm, 1), round(float(level), 1))
        behind = nose + PROUD_MM - face
        site = CameraSite(
            pinhole_mm=pinhole,
            ahead_mm=ahead,
            radius_mm=radius - RIM_MM,
            behind_nose_mm=behind,
            gap_mm=float(gaps.mean()),
        )
        sites.append(site)
    return sites


def _fronts_mm(space: HullField) -> FloatArray:
    """Foremost x of the hull over (y, z), shape (ny, nz); NaN where there is none."""
    last = space.inside.shape[0] - 1 - np.argmax(space.inside[::-1], axis=0)
    fronts = space.origin_mm[0] + space.step_mm * (last + 0.5)
    return np.asarray(np.where(space.inside.any(axis=0), fronts, np.nan))
