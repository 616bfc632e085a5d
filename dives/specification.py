"""Sections of the dive file: a rig, the light and water around it, what moves beside it, and how the loop runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self, get_args

import tomlkit
from pydantic import Field, model_validator

from dives.trajectories.attitude_sensor import AttitudeSettings
from dives.trajectories.motions import Hover, PathStart, RobotMotion, Straight, TargetPath
from rigs import ImageSensorSpec, JerlovType, Rig
from rigs.display import facts_table
from rigs.section import NotNegative, Number, Positive, Section, Vector3, Whole
from scenes.light.materials import Material
from scenes.light.waves import STRONGEST_WIND_M_PER_S
from scenes.stage.scene import DEPTHS_M, WIND_M_PER_S
from scenes.stage.targets import Ball, TargetShape, target_named
from tracking.loop.ablations import LOOPS
from tracking.loop.variants import Variant
from tracking.perception import RED_BALL, DetectorSettings

LONGEST_DIVE_S = 3600.0

BallColour = Literal["red", "orange", "yellow", "green", "blue", "white", "grey", "black"]

BALL_MATERIALS: dict[str, Material] = {
    colour: Material.TARGET if colour == "red" else Material[f"PRINT_{colour.upper()}"]
    for colour in get_args(BallColour)
}
"""Patches of the ColorChecker, whose reflectance spectra are known (`scenes.light.materials`)."""


class DiveThing(Section):
    """What it is (`scenes.stage.targets.target_named`), and of a ball how large and of which colour."""

    shape: str = "ball"
    diameter_m: Positive | None = None
    colour: BallColour | None = None

    @property
    def name(self) -> str:
        """What it is, in words: "yellow ball", "buoy", a file's name."""
        return f"{self.colour or 'red'} ball" if self.shape == "ball" else Path(self.shape).stem

    def load_shape(self) -> TargetShape:
        """Shape, a ball in its size and colour.

        Raises
        ------
        ValueError
            For an unknown name, a file that cannot be used, or size or colour of what is no ball.
        """
        shape = target_named(self.shape)
        if isinstance(shape, Ball):
            radius_m = shape.radius_m if self.diameter_m is None else self.diameter_m / 2
            return Ball(radius_m=radius_m, material=BALL_MATERIALS[self.colour or "red"])
        if self.diameter_m is not None or self.colour is not None:
            raise ValueError(
                f"expected diameter_m and colour for a ball only, got one for {self.shape!r}; leave it out"
            )
        return shape


class PlacedThing(DiveThing):
    """One that stays at a position or goes along a path."""

    position_m: Vector3 | None = None
    path: TargetPath | None = None

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.position_m is None) == (self.path is None):
            raise ValueError(f"expected one of position_m and path, got {'none' if self.path is None else 'both'}")
        return self

    @property
    def course(self) -> TargetPath:
        """Its path; of what stays at a position, one that goes nowhere."""
        if self.path is not None:
            return self.path
        assert self.position_m is not None  # it has one of them
        return Straight(shape="straight", start_m=self.position_m, velocity_m_per_s=(0.0, 0.0, 0.0))


class DiveTarget(PlacedThing):
    """What is to be tracked, and where it begins."""

    start: PathStart = PathStart()


class Decoy(PlacedThing):
    """Something else than the target, which may look like it or hide it."""


class DiveSun(Section):
    """Where the sun stands; azimuth from the robot's bow at the start (the world's x) to the left."""

    elevation_deg: Annotated[Number, Field(gt=0, le=90)] = 60.0
    azimuth_deg: Number = 120.0


class DiveWind(Section):
    """Wind over the sea; azimuth of where it blows to, as the sun's."""

    speed_m_per_s: Annotated[Number, Field(ge=0, le=STRONGEST_WIND_M_PER_S)] = WIND_M_PER_S
    azimuth_deg: Number = 0.0


class ColourOverrides(Section):
    """Colours of the target, where they differ from the detector's own (`tracking.perception.ColourWindow`)."""

    hue_from_deg: Annotated[Number, Field(ge=0, le=360)] | None = None
    hue_to_deg: Annotated[Number, Field(ge=0, le=360)] | None = None
    saturation_min: Annotated[Number, Field(ge=0, le=1)] | None = None
    value_min: Annotated[Number, Field(ge=0, le=1)] | None = None
    value_max: Annotated[Number, Field(ge=0, le=1)] | None = None


class DetectorOverrides(Section):
    """What counts as the target, where it differs from the detector's own (`tracking.perception.DetectorSettings`)."""

    window: ColourOverrides = ColourOverrides()
    opening_px: Annotated[Whole, Field(ge=1, le=99)] | None = None
    closing_px: Annotated[Whole, Field(ge=1, le=99)] | None = None
    area_min_px: NotNegative | None = None
    circularity_min: Annotated[Number, Field(ge=0, le=1)] | None = None
    aspect_max: Annotated[Number, Field(ge=1)] | None = None
    colour: str | None = None
    over_water: Number | None = None
    least_speed_m_per_s: Positive | None = None
    onnx: str | None = None


class DiveLimits(Section):
    """What a dive must reach to pass (`dives.metrics.verdict`).

    The acquisition counts from the first image, the functional check included; time on target and gaze error (RMS)
    count from the acquisition on. A rig that requires a gaze error of its own is judged by that.
    """

    acquisition_time_s: Positive = 20.0
    time_on_target_percent: Annotated[Number, Field(gt=0, le=100)] = 95.0
    gaze_error_deg: Positive = 1.0
    false_tracking_percent: Annotated[Number, Field(ge=0, le=100)] = 5.0


class DiveSpecification(Section):
    """What a dive file says.

    Places are counted from the robot's start (`dives.paths`). The camera's frame rate is the dive's; how long
    its exposures may be and how fast it is read out is the rig's (`[image_sensor]`). `control_latency_ms` counts from
    the end of an image's last row to the command that it leads to. Without `functional_check` the dive begins as after
    one: the loop looks from the first image on, and the servos stand in the middle of their ranges, where the driver
    knows them to be. `seed` is that of noise, servos and sway, `world_seed` that of what stands and drifts around. With
    `attitude` the default loop is told how the robot turns.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    description: str = ""
    rig: str
    world: str = "reef"
    depth_m: Annotated[Number, Field(ge=DEPTHS_M[0], le=DEPTHS_M[1])]
    jerlov_type: JerlovType | None = None
    cloud: Annotated[Number, Field(ge=0, le=1)] = 0.0
    sun: DiveSun = DiveSun()
    wind: DiveWind = DiveWind()
    snow: bool = False
    target: DiveTarget
    decoys: tuple[Decoy, ...] = ()
    robot: RobotMotion = Hover(motion="hover")
    attitude: Annotated[AttitudeSettings | None, Field(exclude_if=lambda settings: settings is None)] = None
    variant: str = "default"
    functional_check: bool = True
    control_latency_ms: NotNegative = 10.0
    detector: DetectorOverrides = DetectorOverrides()
    offline_detector: DetectorOverrides | None = None
    frame_rate_hz: Annotated[Number, Field(gt=0, le=1000)] = 30.0
    duration_s: Annotated[Number, Field(gt=0, le=LONGEST_DIVE_S)]
    seed: Annotated[Whole, Field(ge=0)] = 0
    world_seed: Annotated[Whole, Field(ge=0)] = 0
    video: Literal["ffv1", "h264", "frames", "none"] = "ffv1"
    overlay: bool = True
    limits: DiveLimits = DiveLimits()

    @property
    def frames(self) -> int:
        """Number of images: the last one is taken before the duration is over."""
        return max(1, round(self.duration_s * self.frame_rate_hz))

    def load_rig(self) -> Rig:
        """Read the rig, and run its camera at the dive's frame rate.

        Raises
        ------
        ValueError
            For a rig that cannot be used, or whose image sensor is too slow for the dive.
        FileNotFoundError
            When there is no such rig.
        """
        return self.at_frame_rate(Rig.load(self.rig))

    def at_frame_rate(self, rig: Rig) -> Rig:
        """A rig whose camera runs at the dive's frame rate; `ValueError` when its image sensor is too slow."""
        said = {} if rig.image_sensor is None else rig.image_sensor.model_dump(exclude_unset=True)
        sensor = ImageSensorSpec.model_validate(said | {"frame_rate_hz": self.frame_rate_hz})
        return rig.model_copy(update={"image_sensor": sensor})

    def loop_variant(self) -> Variant:
        """The loop that the dive names."""
        variant = LOOPS[self.variant]
        return variant if self.functional_check else variant.without_check()

    def detector_settings(self) -> DetectorSettings:
        """What counts as the target while the loop runs."""
        return overridden(RED_BALL, self.detector)

    def offline_settings(self) -> DetectorSettings | None:
        """What counts as the target when the recorded dive is detected again; None when it is not."""
        return None if self.offline_detector is None else overridden(RED_BALL, self.offline_detector)

    def _repr_html_(self) -> str:
        water = "the rig's" if self.jerlov_type is None else f"Jerlov type {self.jerlov_type}"
        facts = [
            ("Rig", self.rig),
            ("World", f"{self.world}, {self.depth_m:g} m deep, water: {water}"),
            ("Target", f"{self.target.name}, {self._goes()}"),
            ("Robot", self.robot.motion),
            ("Loop", f"{self.variant}, {self.frame_rate_hz:g} frames/s for {self.duration_s:g} s"),
        ]
        return facts_table(f"{self.name}: {self.description}" if self.description else self.name, facts)

    def _goes(self) -> str:
        path, position = self.target.path, self.target.position_m
        return f"path: {path.shape}" if path else f"stays at {position}"

    def as_toml(self) -> str:
        """The whole dive as a file, defaults included."""
        return tomlkit.dumps(self.model_dump(mode="json", exclude_none=True))


def overridden(settings: DetectorSettings, overrides: DetectorOverrides) -> DetectorSettings:
    """Settings with what the overrides say in their place; `ValueError` when they do not fit each other."""
    window = replace(settings.window, **overrides.window.model_dump(exclude_none=True))
    return replace(settings, window=window, **overrides.model_dump(exclude_none=True, exclude={"window"}))
