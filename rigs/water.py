"""The rig file's `[water]`: whose numbers for absorption and scattering, which phase function, how salty and warm."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from rigs.section import Number, Section

JerlovType = Literal["I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C"]
WaterSource = Literal["williamson-hollins", "solonenko-mobley", "pure"]
PhaseFunctionName = Literal["fournier-forand", "petzold", "henyey-greenstein"]

TYPES_OF_SOURCE: dict[str, tuple[str, ...]] = {
    "williamson-hollins": ("IB", "II", "III", "1C", "3C", "5C"),
    "solonenko-mobley": get_args(JerlovType),
}
"""Jerlov types that each source gives absorption and scattering of."""

PETZOLD_MEAN_COSINE = 0.924
"""Mean cosine of Petzold's average phase function (Mobley, Ocean Optics Web Book)."""


class Water(Section):
    """The water the rig works in; index by Quan & Fry.

    Absorption and scattering are those of a Jerlov type by one of two sources, of pure sea water (`source = "pure"`),
    or the user's own (`iop_file`: a CSV with the columns wavelength_nm, a_per_m, b_per_m and, if it is known,
    b_molecular_per_m). The phase function is that of the particles: `backscattered_fraction` shapes Fournier-Forand
    (without it, it is Petzold's 0.0183), `mean_cosine` Henyey-Greenstein.
    """

    salinity_ppt: Annotated[Number, Field(ge=0, le=35)] = 35.0
    temperature_celsius: Annotated[Number, Field(ge=0, le=30)] = 20.0
    source: WaterSource = "williamson-hollins"
    jerlov_type: JerlovType = "IB"
    iop_file: Path | None = None
    phase_function: PhaseFunctionName = "fournier-forand"
    backscattered_fraction: Annotated[Number, Field(ge=0.001, le=0.05)] | None = None
    mean_cosine: Annotated[Number, Field(ge=0, le=0.99)] | None = None

    @model_validator(mode="after")
    def _coefficients_have_one_origin(self) -> Self:
        said = self.model_fields_set
        if self.iop_file is not None and said & {"jerlov_type", "source"}:
            raise ValueError("expected iop_file or a Jerlov type with its source, got both")
        if self.source == "pure" and "jerlov_type" in said:
            raise ValueError(f'expected no jerlov_type with source = "pure", got {self.jerlov_type!r}')
        check_type_of_source(self.jerlov_type, self.source)
        return self

    @model_validator(mode="after")
    def _shape_belongs_to_the_phase_function(self) -> Self:
        for key, name in (("backscattered_fraction", "fournier-forand"), ("mean_cosine", "henyey-greenstein")):
            if getattr(self, key) is not None and self.phase_function != name:
                raise ValueError(f'expected {key} with phase_function = "{name}" only, got "{self.phase_function}"')
        return self

    @property
    def label(self) -> str:
        """What the water is, in a few words: `Jerlov IB`, `pure sea water`, or the name of the user's file."""
        if self.iop_file is not None:
            return self.iop_file.name
        return "pure sea water" if self.source == "pure" else f"Jerlov {self.jerlov_type}"

    def of_type(self, jerlov_type: JerlovType, source: WaterSource | None = None) -> Water:
        """The same water (salt, heat, phase function) with the coefficients of a Jerlov type.

        Without a `source` it is the water's own, or the default where the water has none for types.

        Raises
        ------
        ValueError
            When the source has no such type.
        """
        if source is None:
            source = self.source if self.source in TYPES_OF_SOURCE else "williamson-hollins"
        check_type_of_source(jerlov_type, source)
        return self.model_copy(update={"jerlov_type": jerlov_type, "source": source, "iop_file": None})


def check_type_of_source(jerlov_type: str, source: str) -> None:
    """Raise a `ValueError` when a source gives no coefficients of a Jerlov type."""
    types = TYPES_OF_SOURCE.get(source)
    if types is not None and jerlov_type not in types:
        others = [f'"{name}"' for name, known in TYPES_OF_SOURCE.items() if jerlov_type in known]
        hint = f"; source = {', '.join(others)} has it" if others else ""
        raise ValueError(f'expected jerlov_type {", ".join(types)} with source = "{source}", got {jerlov_type!r}{hint}')
