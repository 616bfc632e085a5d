"""Reflection, vector Snell and Fresnel, as kernels on Dr.Jit arrays.

Every function is polymorphic in the float type: it works in the precision of what it is given.
"""

from __future__ import annotations

from typing import Any

from optics.kernels.backend import dr


def reflect(direction: Any, normal: Any) -> Any:
    """Mirror a direction at a plane with unit `normal`."""
    return dr.fma(-2 * dr.dot(direction, normal), normal, direction)


def refract(direction: Any, normal: Any, ratio: Any) -> tuple[Any, Any]:
    """Vector Snell.

    Parameters
    ----------
    direction : unit vectors of the incoming rays
    normal : unit normals on the side the rays go to (``dot(direction, normal) > 0``)
    ratio : index before over index behind, n1 / n2

    Returns
    -------
    direction : unit vectors behind the surface (undefined where totally reflected)
    transmitted : False where the ray is totally reflected

    Notes
    -----
    Born & Wolf, Principles of Optics, section 1.5.1: the tangential part of n * direction is conserved.
    """
    cosine_in = dr.dot(direction, normal)
    square = 1 - dr.square(ratio) * (1 - dr.square(cosine_in))
    cosine_out = dr.safe_sqrt(square)
    return ratio * direction + (cosine_out - ratio * cosine_in) * normal, square > 0


def dielectric_transmittance(cosine_in: Any, n_before: Any, n_behind: Any) -> Any:
    """Unpolarised Fresnel transmittance (power) of one surface between two transparent media.

    The radiance behind the surface is this times ``(n_behind / n_before)**2``. Born & Wolf, section 1.5.3.
    """
    sine2_out = dr.square(n_before / n_behind) * (1 - dr.square(cosine_in))
    cosine_out = dr.safe_sqrt(1 - sine2_out)
    s, p = n_before * cosine_in + n_behind * cosine_out, n_behind * cosine_in + n_before * cosine_out
    crossed = n_before * cosine_in * n_behind * cosine_out
    return dr.select(sine2_out < 1, 2 * crossed * (dr.square(s) + dr.square(p)) / dr.square(s * p), 0)


def window_transmittance(cosines: tuple[Any, Any, Any, Any], indices: tuple[Any, Any, Any]) -> Any:
    """Unpolarised Fresnel transmittance (power) of a window: two faces with one plane of incidence.

    Parameters
    ----------
    cosines : of the angles to the normals: before and behind the first face, before and behind the second face
    indices : before, inside and behind the window

    Notes
    -----
    Each polarisation passes both faces on its own, ``(T_s1 T_s2 + T_p1 T_p2) / 2``, which is not the product of the
    two unpolarised transmittances. Light reflected to and fro inside the window is left out. Written with one
    division, which is what such a kernel spends its time on: ``T_s = 4 x / s^2`` and ``T_p = 4 x / p^2`` with x the
    product of both ``n cos``.
    """
    before, near, far, behind = cosines
    n_before, n_window, n_behind = indices
    s = (n_before * before + n_window * near) * (n_window * far + n_behind * behind)
    p = (n_window * before + n_before * near) * (n_behind * far + n_window * behind)
    crossed = dr.square(n_window) * n_before * n_behind * before * near * far * behind
    return 8 * crossed * (dr.square(s) + dr.square(p)) / dr.square(s * p)


def conductor_reflectance(cosine_in: Any, n: Any, k: Any, n_medium: Any) -> Any:
    """Unpolarised Fresnel reflectance of a metal with index ``n + ik`` seen from a medium of index `n_medium`.

    Born & Wolf, section 14.2, with the metal's index taken relative to the medium.
    """
    eta, kappa = n / n_medium, k / n_medium
    cosine2 = dr.square(cosine_in)
    sine2 = 1 - cosine2
    difference = dr.square(eta) - dr.square(kappa) - sine2
    a2_plus_b2 = dr.safe_sqrt(dr.square(difference) + 4 * dr.square(eta * kappa))
    a = dr.safe_sqrt((a2_plus_b2 + difference) / 2)
    r_s = (a2_plus_b2 + cosine2 - 2 * a * cosine_in) / (a2_plus_b2 + cosine2 + 2 * a * cosine_in)
    sine4 = dr.square(sine2)
    first = cosine2 * a2_plus_b2 + sine4
    second = 2 * a * cosine_in * sine2
    r_p = r_s * (first - second) / (first + second)
    return (r_s + r_p) / 2
