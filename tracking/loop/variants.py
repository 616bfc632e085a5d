"""The loops that are compared: the paper's as printed, as meant, and the default."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal, Self

from tracking.control.paper_law import GAIN
from tracking.estimation.centroid_filter import CentroidNoise
from tracking.estimation.direction_filter import DirectionNoise
from tracking.loop.behaviour import BehaviourSettings


@dataclass(frozen=True, kw_only=True)
class Variant:
    """What a loop is made of.

    Attributes
    ----------
    name : str
    corners : {"interpolated", "exact"}
        Eq. 6 on samples, or the exact train.
    law : {"paper-literal", "paper", "gaze"}
        Eqs. 8 to 15 as printed, as meant, or directions through the train.
    rescan : {"raster", "reachable"}
        How a lost target is searched: everywhere at once, or where it can have gone first.
    likely_first : bool
        Whether the search of everything begins where a target is likely to be; else it is a raster.
    ignores_robot : bool
        Whether what the crop shows of the robot itself is ignored, where the loop is told what that is.
    direct_view : bool
        Whether a search looks past the mirrors as well, where the loop is told what is seen there.
    contrast : bool
        Whether the target is found by its contrast with what is around it (`tracking.perception.contrast`), unless the
        detector's colour window is another than `RED_IN_WATER`; else by that window.
    appearance : bool
        Whether what is followed is found by its own colours as well (`tracking.perception.appearance`), where it is
        found by its contrast.
    behaviour : BehaviourSettings
    gains : tuple of float
        Of the paper's law, pan and tilt: the share of the error that one image takes away.
    centroid_noise : CentroidNoise
        Of the paper's filter.
    direction_noise : DirectionNoise
        Of the default's filter.
    target_distance_m : float
        At which the default assumes the target, from the gaze mirror.
    control_latency_s : float
        From the middle of an exposure to the command; the servos' own latency is in the rig file.
    """

    name: str
    corners: Literal["interpolated", "exact"]
    law: Literal["paper-literal", "paper", "gaze"]
    rescan: Literal["raster", "reachable"]
    likely_first: bool
    ignores_robot: bool
    direct_view: bool
    contrast: bool
    appearance: bool
    behaviour: BehaviourSettings
    gains: tuple[float, float] = (GAIN, GAIN)
    centroid_noise: CentroidNoise = field(default_factory=CentroidNoise)
    direction_noise: DirectionNoise = field(default_factory=DirectionNoise)
    target_distance_m: float = 2.0
    control_latency_s: float = 0.02

    def __post_init__(self) -> None:
        problems = []
        if not all(math.isfinite(gain) and gain > 0 for gain in self.gains):
            problems.append(f"expected gains above 0, got {self.gains}")
        if not (math.isfinite(self.target_distance_m) and self.target_distance_m > 0):
            problems.append(f"expected target_distance_m above 0, got {self.target_distance_m}")
        if not (math.isfinite(self.control_latency_s) and self.control_latency_s >= 0):
            problems.append(f"expected control_latency_s of at least 0, got {self.control_latency_s}")
        if problems:
            raise ValueError("; ".join(problems))

    def without_check(self) -> Self:
        """The same loop without its functional check: it looks from the first image on."""
        return replace(self, behaviour=replace(self.behaviour, check_s=0.0))


PAPER_BEHAVIOUR = BehaviourSettings(check_s=30.0, confirm_frames=1, predict_frames=30)

VARIANTS = {
    variant.name: variant
    for variant in (
        Variant(
            name="paper-literal",
            corners="interpolated",
            law="paper-literal",
            rescan="raster",
            likely_first=False,
            ignores_robot=False,
            direct_view=False,
            contrast=False,
            appearance=False,
            behaviour=PAPER_BEHAVIOUR,
        ),
        Variant(
            name="paper",
            corners="interpolated",
            law="paper",
            rescan="raster",
            likely_first=False,
            ignores_robot=False,
            direct_view=False,
            contrast=False,
            appearance=False,
            behaviour=PAPER_BEHAVIOUR,
        ),
        Variant(
            name="default",
            corners="exact",
            law="gaze",
            rescan="reachable",
            likely_first=True,
            ignores_robot=True,
            direct_view=True,
            contrast=True,
            appearance=True,
            # Wherever the paper's servos stand, they have met the check within 2 s: from then on the driver knows them.
            behaviour=BehaviourSettings(
                check_s=3.0,
                confirm_frames=3,
                look_frames=4,
                predict_frames=15,
                unseen_frames=15,
                wait_frames=300,
                earned=True,
            ),
        ),
    )
}
"""By name: "paper-literal", "paper" (its misprints read as they must be meant) and "default"."""
