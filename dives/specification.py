"""The dive file: which rig, in which water and light, does what beside which target, and how the loop is run."""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import tomlkit
from pydantic import Field

from dives.motions import RobotMotion, TargetPath
from rigs import ImageSensorSpec, JerlovType, Rig
from rigs.problems import Problem, SpecificationError
from rigs.section import NotNegative, Number, Section, Whole
from rigs.validation import validated
from scenes.light.waves import STRONGEST_WIND_M_S
from scenes.stage.stage import DEPTHS_M, WIND_M_S
from tracking.loop.variants import VARIANTS
from tracking.perception import RED_BALL, DetectorSettings

PRESETS = Path(__file__).parent / "presets"

LONGEST_DIVE_S = 3600.0

HARMLESS = {"name": "dive", "rig": "aqua2", "depth_m": 10.0, "duration_s": 60.0, "robot": {"motion": "hover"}}
"""Stand-ins for required values that are wrong."""


class DiveError(SpecificationError):
    """A dive that cannot be made."""


class DiveTarget(Section):
    """What is to be tracked (`scenes.stage.targets.target_named`), and where it goes."""

    shape: str = "red ball"
    path: TargetPath


class DiveSun(Section):
    """Where the sun stands; azimuth from the robot's bow at the start (the world's x) to the left."""

    elevation_deg: Annotated[Number, Field(gt=0, le=90)] = 60.0
    azimuth_deg: Number = 120.0


class DiveWind(Section):
    """Wind over the sea; azimuth of where it blows to, as the sun's."""

    speed_m_per_s: Annotated[Number, Field(ge=0, le=STRONGEST_WIND_M_S)] = WIND_M_S
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


class Dive(Section):
    """A rendered dive.

    Places are told from the robot's start (`dives.paths`). The camera's frame rate is the dive's; how long
    its exposures may be and how fast it is read out is the rig's (`[image_sensor]`). `control_latency_ms` counts from
    the end of a picture's last row to the command that it leads to. `seed` is that of noise, servos and sway,
    `world_seed` that of what stands and drifts around.
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
    robot: RobotMotion
    variant: str = "default"
    control_latency_ms: NotNegative = 10.0
    detector: DetectorOverrides = DetectorOverrides()
    offline_detector: DetectorOverrides | None = None
    frame_rate_hz: Annotated[Number, Field(gt=0, le=1000)] = 30.0
    duration_s: Annotated[Number, Field(gt=0, le=LONGEST_DIVE_S)]
    seed: Annotated[Whole, Field(ge=0)] = 0
    world_seed: Annotated[Whole, Field(ge=0)] = 0
    video: Literal["ffv1", "h264", "frames", "none"] = "ffv1"
    overlay: bool = True

    @classmethod
    def load(cls, name_or_path: str | Path) -> Dive:
        """Read a preset by name or a TOML file by path; a relative rig, world or target file is taken from its folder.

        Raises
        ------
        DiveError
            With every problem of the file, its rig and its paths at once.
        FileNotFoundError
            When there is neither such a preset nor such a file.
        """
        path = find_dive(name_or_path)
        return parse_dive(_text_of(path, str(name_or_path)), source=str(name_or_path), folder=path.parent)

    @property
    def frames(self) -> int:
        """Number of pictures: the last one is taken before the duration is over."""
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

    def detector_settings(self) -> DetectorSettings:
        """What counts as the target while the loop runs."""
        return overridden(RED_BALL, self.detector)

    def offline_settings(self) -> DetectorSettings | None:
        """What counts as the target when the recorded dive is detected again; None when it is not."""
        return None if self.offline_detector is None else overridden(RED_BALL, self.offline_detector)

    def as_toml(self) -> str:
        """The whole dive as a file, defaults included."""
        return tomlkit.dumps(self.model_dump(mode="json", exclude_none=True))


def varied(dive: Dive, *, variant: str | None = None, frames: int | None = None) -> Dive:
    """A dive with another variant of the loop, or cut after a number of frames; `ValueError` for an unknown variant."""
    if variant is not None and variant not in VARIANTS:
        raise ValueError(f"variant {variant!r}: expected one of {', '.join(sorted(VARIANTS))}")
    changes = {
        **({} if variant is None else {"variant": variant}),
        **({} if frames is None else {"duration_s": min(dive.duration_s, frames / dive.frame_rate_hz)}),
    }
    return dive.model_copy(update=changes)


def preset_names() -> list[str]:
    """Names of the dives that come with the package, in alphabetical order."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def find_dive(name_or_path: str | Path) -> Path:
    """File of a dive given by preset name or by path; raises `FileNotFoundError` when there is none."""
    path = Path(name_or_path)
    if path.is_file():
        return path
    name, names = str(name_or_path), preset_names()
    if name not in names:
        close = difflib.get_close_matches(name, names, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else ""
        raise FileNotFoundError(f"dive {name!r}: expected a preset ({', '.join(names)}) or a TOML file{hint}")
    return PRESETS / f"{name}.toml"


def parse_dive(text: str, *, source: str, folder: Path) -> Dive:
    """Validate the text of a dive file; see `Dive.load`."""
    from dives.checks import dive_problems  # noqa: PLC0415  (checks look at dives: circular otherwise)

    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, _, place = str(error).removesuffix(")").rpartition(" (at ")
        raise DiveError(source, [Problem(place=place, value=None, expected=f"valid TOML: {message}")]) from None
    dive, problems = validated(Dive, document)
    wrong = {_section(problem) for problem in problems}
    # Beside what is wrong with single values, a user is told what else is wrong: with harmless values in their place.
    whole = (
        dive
        or validated(
            Dive,
            {key: value for key, value in document.items() if key not in wrong}
            | {key: value for key, value in HARMLESS.items() if key in wrong},
        )[0]
    )
    if whole is not None:
        whole = _with_own_files(whole, folder)
        problems += [problem for problem in dive_problems(whole) if _section(problem) not in wrong]
    if whole is None or problems:
        raise DiveError(source, problems)
    return whole


def _section(problem: Problem) -> str:
    """Top-level key of a problem's place."""
    return problem.place.partition(".")[0].partition("[")[0]


def _with_own_files(dive: Dive, folder: Path) -> Dive:
    """The dive with files that lie beside it told by their whole path."""

    def located(name: str) -> str:
        file = folder / name
        return str(file.resolve()) if Path(name).suffix and file.is_file() else name

    target = dive.target.model_copy(update={"shape": located(dive.target.shape)})
    return dive.model_copy(update={"rig": located(dive.rig), "world": located(dive.world), "target": target})


def _text_of(path: Path, source: str) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        place = f"byte {error.start}"
        raise DiveError(source, [Problem(place=place, value=None, expected="text in UTF-8, as TOML is")]) from None


def overridden(settings: DetectorSettings, overrides: DetectorOverrides) -> DetectorSettings:
    """Settings with what the overrides say in their place; `ValueError` when they do not fit each other."""
    window = replace(settings.window, **overrides.window.model_dump(exclude_none=True))
    return replace(settings, window=window, **overrides.model_dump(exclude_none=True, exclude={"window"}))
