"""Sections of the dive file about what moves: the target's path and the robot's motion."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rigs.section import NotNegative, Number, Positive, Section, Vector3

FEWEST_POINTS = 2

Triple = tuple[NotNegative, NotNegative, NotNegative]
PositiveTriple = tuple[Positive, Positive, Positive]


class Spiral(Section):
    """Open spiral about the robot's start: the paper's path begins level with the robot, rises and goes away.

    Bearings count from the robot's bow to the left.
    """

    shape: Literal["spiral"]
    start_radius_m: Positive
    start_bearing_deg: Number = 0.0
    start_height_m: Number = 0.0
    turning_deg_per_s: Number
    receding_m_per_s: Number = 0.0
    rising_m_per_s: Number = 0.0
    wait_s: NotNegative = 0.0


class Straight(Section):
    """Straight on at a constant velocity."""

    shape: Literal["straight"]
    start_m: Vector3
    velocity_m_per_s: Vector3
    wait_s: NotNegative = 0.0


class Circle(Section):
    """Level circle about a centre, from a bearing seen from that centre; positive turns to the left."""

    shape: Literal["circle"]
    centre_m: Vector3
    radius_m: Positive
    start_bearing_deg: Number = 0.0
    turning_deg_per_s: Number
    wait_s: NotNegative = 0.0


class Legs(Section):
    """From point to point at one speed; at the last it stays."""

    points_m: tuple[Vector3, ...]
    speed_m_per_s: Positive
    wait_s: NotNegative = 0.0

    @model_validator(mode="after")
    def _points_make_legs(self) -> Legs:
        if len(self.points_m) < FEWEST_POINTS:
            raise ValueError(f"expected points_m with at least {FEWEST_POINTS} points, got {len(self.points_m)}")
        if any(first == second for first, second in zip(self.points_m, self.points_m[1:], strict=False)):
            raise ValueError("expected points_m that differ from one to the next")
        return self


class Waypoints(Legs):
    """A target that goes from point to point."""

    shape: Literal["waypoints"]


class FromFile(Section):
    """A path from a CSV file (`dives.trajectories.timed_paths`), from a time of the file on or its first row's.

    Places are counted from the robot's start as all others, or, with ``frame = "map"``, in the frame of the robot's own
    file.
    """

    shape: Literal["file"]
    file: str
    start_s: Number | None = None
    frame: Literal["start", "map"] = "start"


TargetPath = Annotated[Spiral | Straight | Circle | Waypoints | FromFile, Field(discriminator="shape")]


class PathStart(Section):
    """Where a path begins, seen from the robot's start; what is left out is the path's own.

    The path is turned about the vertical through the start, then moved as a whole, until it begins there.
    """

    azimuth_deg: Number | None = None
    elevation_deg: Annotated[Number, Field(gt=-90, lt=90)] | None = None
    distance_m: Positive | None = None


class Sway(Section):
    """Sines about the robot's own axes: surge, sway and heave along x, y and z; roll, pitch and yaw about them.

    Their phases come from the dive's seed.
    """

    amplitude_m: Triple = (0.0, 0.0, 0.0)
    period_s: PositiveTriple = (8.0, 8.0, 8.0)
    turn_deg: Triple = (0.0, 0.0, 0.0)
    turn_period_s: PositiveTriple = (8.0, 8.0, 8.0)


class Hover(Section):
    """The robot keeps its place, but for its sway."""

    motion: Literal["hover"]
    sway: Sway = Sway()


class Travel(Legs):
    """The robot goes from point to point, its bow ahead, and turns at a limited rate; its sway comes on top."""

    motion: Literal["waypoints"]
    turn_rate_deg_per_s: Positive = 30.0
    sway: Sway = Sway()


class TravelFromFile(Section):
    """The robot goes along a path from a CSV file, in any level frame (z up); its sway comes on top.

    Where it is at the dive's beginning, and where its bow points there, is the start that all else is counted from. A
    file without attitudes leaves it level, its bow along the file's x.
    """

    motion: Literal["file"]
    file: str
    start_s: Number | None = None
    sway: Sway = Sway()


RobotMotion = Annotated[Hover | Travel | TravelFromFile, Field(discriminator="motion")]
