"""What a data set's file says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import core_schema

from dives.datasets.distributions import Distribution, Drawn, Fixed
from dives.specification import BallColour
from rigs.section import NotNegative, Number, Positive, Section, Whole
from scenes.light.waves import STRONGEST_WIND_M_PER_S
from scenes.stage.scene import DEPTHS_M, WIND_M_PER_S

Format = Literal["coco", "yolo", "bop", "webdataset", "parquet", "tum", "euroc", "mcap"]

BoxLabel = Literal["target", "decoy", "world", "hull", "mount", "servo", "mirror_back", "snow"]

MOST_SAMPLES = 10_000_000


@dataclass(frozen=True)
class OneOrMore:
    """Marks a key that takes one value or a list of them: an axis of the set's grid."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        listed = core_schema.no_info_before_validator_function(_as_list, handler(source))
        return core_schema.no_info_after_validator_function(_all_different, listed)

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler) -> Any:
        several = handler(schema)
        return {"anyOf": [several["items"], several | {"minItems": 1}]}


def _as_list(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else (value,)


def _all_different(values: tuple[Any, ...]) -> tuple[Any, ...]:
    if not values or len(set(values)) != len(values):
        raise ValueError(f"expected one value, or a list of different ones, got {list(values)}")
    return values


Share = Annotated[Number, Field(ge=0, le=1)]
Depth = Annotated[Number, Field(ge=DEPTHS_M[0], le=DEPTHS_M[1])]
Height = Annotated[Number, Field(gt=0, le=90)]
WindSpeed = Annotated[Number, Field(ge=0, le=STRONGEST_WIND_M_PER_S)]
Seed = Annotated[Whole, Field(ge=0)]
Pixels = Annotated[Whole, Field(ge=16, le=20000)]

Names = Annotated[tuple[str, ...], OneOrMore()]
Numbers = Annotated[tuple[Number, ...], OneOrMore()]

Angle = Annotated[Distribution, Drawn(-360, 360)]
Length = Annotated[Distribution, Drawn(-1000, 1000)]
Speed = Annotated[Distribution, Drawn(-100, 100)]
TurnRate = Annotated[Distribution, Drawn(-3600, 3600)]
Size = Annotated[Distribution, Drawn(0.001, 100)]


class SunAxes(Section):
    """Where the sun stands, as a dive file says it; each key takes one value or a list."""

    elevation_deg: Annotated[tuple[Height, ...], OneOrMore()] = (60.0,)
    azimuth_deg: Numbers = (120.0,)


class WindAxes(Section):
    """Wind over the sea, as a dive file says it; each key takes one value or a list."""

    speed_m_per_s: Annotated[tuple[WindSpeed, ...], OneOrMore()] = (WIND_M_PER_S,)
    azimuth_deg: Numbers = (0.0,)


class SceneAxes(Section):
    """What is lit once: each key takes one value or a list, and every combination of them is a scene of its own.

    `water` is a Jerlov type or a CSV file of absorption and scattering (`iop_file` of a rig file); without it it is the
    rig's own.
    """

    rig: Names
    world: Names = ("tank",)
    world_seed: Annotated[tuple[Seed, ...], OneOrMore()] = (0,)
    depth_m: Annotated[tuple[Depth, ...], OneOrMore()]
    water: Names | None = None
    cloud: Annotated[tuple[Share, ...], OneOrMore()] = (0.0,)
    snow: Annotated[tuple[bool, ...], OneOrMore()] = (False,)
    sun: SunAxes = SunAxes()
    wind: WindAxes = WindAxes()


class JointDraws(Section):
    """Joint values at a clip's beginning, without them all that the rig's joints reach, and how fast they turn."""

    q1_deg: Angle | None = None
    q2_deg: Angle | None = None
    q1_deg_per_s: TurnRate = Fixed(0.0)
    q2_deg_per_s: TurnRate = Fixed(0.0)


class RobotDraws(Section):
    """Where the robot is, from the world's z axis at the scene's depth, and how it stands: first yaw, pitch, then roll.

    x, y and z are the world's, z upwards from the scene's depth. In a clip it moves and turns evenly.
    """

    x_m: Length = Fixed(0.0)
    y_m: Length = Fixed(0.0)
    z_m: Annotated[Distribution, Drawn(-1, 1)] = Fixed(0.0)
    yaw_deg: Angle = Fixed(0.0)
    pitch_deg: Angle = Fixed(0.0)
    roll_deg: Angle = Fixed(0.0)
    x_m_per_s: Speed = Fixed(0.0)
    y_m_per_s: Speed = Fixed(0.0)
    z_m_per_s: Speed = Fixed(0.0)
    yaw_deg_per_s: TurnRate = Fixed(0.0)


class ThingDraws(Section):
    """A thing in the water: what it is, and where it is seen from the robot.

    Azimuth (to the left) and elevation count `seen_from` the gaze, so that 0 and 0 is on its axis, or from the robot's
    bow; the distance counts from the gaze mirror, or from the robot's origin. `yaw_deg` is its own heading, from the
    world's x to the left. `present` is the share of clips that have it. It is there at a clip's beginning, and moves
    evenly along the world's axes.
    """

    seen_from: Literal["gaze", "bow"] = "gaze"
    azimuth_deg: Angle = Fixed(0.0)
    elevation_deg: Angle = Fixed(0.0)
    distance_m: Annotated[Distribution, Drawn(0.05, 1000)] = Fixed(2.0)
    yaw_deg: Angle = Fixed(0.0)
    x_m_per_s: Speed = Fixed(0.0)
    y_m_per_s: Speed = Fixed(0.0)
    z_m_per_s: Speed = Fixed(0.0)
    present: Share = 1.0


class TargetDraws(ThingDraws):
    """The target; `shape` and `colour` take one value or a list, axes of the grid. A ball has size and colour."""

    shape: Names = ("ball",)
    colour: Annotated[tuple[BallColour, ...], OneOrMore()] | None = None
    diameter_m: Size | None = None


class DecoyDraws(ThingDraws):
    """Something else than the target: one shape, of one size and colour if it is a ball."""

    shape: str = "ball"
    colour: BallColour | None = None
    diameter_m: Positive | None = None


class ImageAxes(Section):
    """How an image is taken.

    `sensor` is the rig's image sensor with its noise, exposed automatically; without it the image is what a diver's
    white card shows. `exposure_ev` over- or underexposes the sensor, in powers of two. Another size looks at the same
    field of view. With `jpeg_quality` it is kept as JPEG,
    without as PNG, which loses nothing; layers are never JPEG. `exr` adds every layer in single precision
    (`docs/reference/ground_truth.md`).
    """

    sensor: bool = True
    exposure_ev: Annotated[Distribution, Drawn(-8, 8)] = Fixed(0.0)
    samples_per_pixel: Annotated[Whole, Field(ge=1, le=64)] = 1
    width_px: Pixels | None = None
    height_px: Pixels | None = None
    jpeg_quality: Annotated[Whole, Field(ge=1, le=100)] | None = None
    exr: bool = False


class ClipAxes(Section):
    """Frames that follow each other: each `frames` samples in a row are one clip, drawn once.

    With `flow` each sample has the optical flow to what is a frame later.
    """

    frames: Annotated[Whole, Field(ge=1, le=10_000)] = 1
    frame_rate_hz: Annotated[Positive, Field(le=1000)] = 10.0
    flow: bool = False


class DatasetSpecification(Section):
    """What a data set's file says.

    Sample i is known by `seed` and i alone, or by the number of its clip: with more `samples` those that are there stay
    as they are. `splits` says which share of samples each split has; which one a sample is in is drawn. `boxes` are the
    labels that COCO and YOLO files tell.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    description: str = ""
    licence: str = ""
    samples: Annotated[Whole, Field(ge=1, le=MOST_SAMPLES)]
    seed: Seed = 0
    splits: dict[str, NotNegative] = Field(default={"train": 0.8, "validation": 0.1, "test": 0.1})
    formats: tuple[Format, ...] = ("coco",)
    boxes: tuple[BoxLabel, ...] = ("target",)
    scene: SceneAxes
    joints: JointDraws = JointDraws()
    robot: RobotDraws = RobotDraws()
    target: TargetDraws = TargetDraws()
    decoys: tuple[DecoyDraws, ...] = ()
    image: ImageAxes = ImageAxes()
    clip: ClipAxes = ClipAxes()

    @model_validator(mode="after")
    def _splits_are_shares(self) -> DatasetSpecification:
        if not sum(self.splits.values()) > 0 or not all(name.isidentifier() for name in self.splits):
            raise ValueError(f"expected splits with names of letters and digits, not all 0, got {self.splits}")
        return self
