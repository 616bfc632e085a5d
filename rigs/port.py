"""Section of the rig file about the port, the window between the camera and the water."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigs.section import Positive, Section, Vector3

PortMaterial = Literal["pmma", "polycarbonate", "n-bk7", "borofloat33", "sapphire", "fused-silica"]


class FlatPortSpec(Section):
    """Plane-parallel window; `distance_mm` is measured from the pinhole to the inner face along the normal."""

    shape: Literal["flat"]
    material: PortMaterial
    distance_mm: Positive
    thickness_mm: Positive
    normal: Vector3 = (0.0, 0.0, 1.0)
    aperture_diameter_mm: Positive

    @model_validator(mode="after")
    def _normal_points_out(self) -> Self:
        if self.normal[2] <= 0:
            raise ValueError(f"expected a normal that points out of the housing (z > 0), got {self.normal}")
        return self


class DomePortSpec(Section):
    """Spherical shell; the centre is given in the camera frame, (0, 0, 0) is a perfectly centred dome."""

    shape: Literal["dome"]
    material: PortMaterial
    centre_mm: Vector3 = (0.0, 0.0, 0.0)
    inner_radius_mm: Positive
    thickness_mm: Positive
    aperture_diameter_mm: Positive

    @model_validator(mode="after")
    def _pinhole_and_rim_are_inside(self) -> Self:
        offset = sum(c * c for c in self.centre_mm) ** 0.5
        if offset >= self.inner_radius_mm:
            raise ValueError(
                f"expected the pinhole inside the dome: centre_mm is {offset:g} mm away from it, "
                f"but inner_radius_mm is {self.inner_radius_mm:g}"
            )
        if self.aperture_diameter_mm > 2 * self.inner_radius_mm:
            raise ValueError(
                f"expected an aperture of at most the inner diameter {2 * self.inner_radius_mm:g} mm, "
                f"got aperture_diameter_mm = {self.aperture_diameter_mm:g}"
            )
        return self


class NoPortSpec(Section):
    """No window: camera, mirrors and scene share one medium."""

    shape: Literal["none"]


Port = Annotated[FlatPortSpec | DomePortSpec | NoPortSpec, Field(discriminator="shape")]
