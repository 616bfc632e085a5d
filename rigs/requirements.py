"""What a design is asked for: a section of the rig file, judged wherever the answer is known."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from rigs.section import Number, Positive, Section

Azimuth = Annotated[Number, Field(ge=-360, le=360)]
Elevation = Annotated[Number, Field(ge=-90, le=90)]


class Requirements(Section):
    """What the design must reach; nothing is asked for by default.

    `directions_deg` are azimuths and elevations of directions that some joint values must show over both mirrors, and
    `covered_percent` is the share of all directions. `target_px` is the smallest number of pixels across a target of
    `target_diameter_mm` that is `target_distance_mm` away, anywhere in the image. `gaze_error_deg` is the largest RMS
    error of a dive's gaze while the target is held. Mass and print time are those of the whole mount.
    """

    directions_deg: tuple[tuple[Azimuth, Elevation], ...] = ()
    covered_percent: Annotated[Number, Field(gt=0, le=100)] | None = None
    target_px: Positive | None = None
    target_diameter_mm: Positive | None = None
    target_distance_mm: Positive | None = None
    gaze_error_deg: Positive | None = None
    mount_mass_g: Positive | None = None
    print_hours: Positive | None = None

    @model_validator(mode="after")
    def _a_target_is_whole(self) -> Requirements:
        named = ("target_px", "target_diameter_mm", "target_distance_mm")
        missing = [name for name in named if getattr(self, name) is None]
        if 0 < len(missing) < len(named):
            raise ValueError(f"expected all of {', '.join(named)} or none; missing: {', '.join(missing)}")
        return self
