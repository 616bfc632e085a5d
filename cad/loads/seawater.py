"""How heavy the water is."""

from __future__ import annotations

from rigs import Water


def water_density(water: Water) -> float:
    """Density of a rig's water at the surface, kg/m^3.

    Millero & Poisson 1981, Deep-Sea Research 28A, 625 (the one-atmosphere equation of state EOS-80), standard error
    0.0036 kg/m^3. Pressure adds 0.5 kg/m^3 per 100 m.
    """
    s, t = water.salinity_ppt, water.temperature_celsius
    pure = (
        999.842594 + 6.793952e-2 * t - 9.095290e-3 * t**2 + 1.001685e-4 * t**3 - 1.120083e-6 * t**4 + 6.536332e-9 * t**5
    )
    linear = 8.24493e-1 - 4.0899e-3 * t + 7.6438e-5 * t**2 - 8.2467e-7 * t**3 + 5.3875e-9 * t**4
    power = -5.72466e-3 + 1.0227e-4 * t - 1.6546e-6 * t**2
    return float(pure + linear * s + power * s**1.5 + 4.8314e-4 * s**2)
