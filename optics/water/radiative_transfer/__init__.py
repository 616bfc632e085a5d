"""Light under a flat sea surface: plane-parallel radiative transfer by discrete ordinates.

Cosines are those of the direction that is *looked along*, positive upwards; seen so, light from above has a positive
cosine, and depth and optical depth grow along it. Azimuths are counted from the sun's.
`docs/explanation/radiative_transfer.md` has the equations.
"""

from optics.water.radiative_transfer.field import RadianceField, radiance_field

__all__ = ["RadianceField", "radiance_field"]
