"""The rig file's contents: frozen, typed sections whose field names carry their units.

Frames are those of `docs/reference/conventions.md`: the body frame is x forward, y left, z up; the camera frame is
x right, y down, z forward. Lengths are millimetres here and metres everywhere behind `optics`.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigs.image_sensor import ImageSensorSpec
from rigs.lamps import Lamp
from rigs.mounting import Hull, Joints, Mount, Servos, Vehicle
from rigs.section import Number, Positive, Section, Vector3, Whole
from rigs.water import Water

PortMaterial = Literal["pmma", "polycarbonate", "n-bk7", "borofloat33", "sapphire", "fused-silica"]


class CameraPose(Section):
    """Where the camera's pinhole is in the body frame, and how it is turned.

    With all angles zero the optical axis is the body's +x and image-up is the body's +z. Yaw turns to the left,
    pitch up, roll clockwise as seen from behind the camera; they apply in the order roll, pitch, yaw.
    """

    position_mm: Vector3
    yaw_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0


class ImageSize(CameraPose):
    """Pixels and intrinsics shared by both camera models; pixel (0, 0) is the centre of the top-left pixel.

    `response_file` is a CSV of the sensor's spectral response: wavelength_nm, red, green, blue.
    """

    width_px: Annotated[Whole, Field(gt=0, le=20000)]
    height_px: Annotated[Whole, Field(gt=0, le=20000)]
    fx_px: Positive
    fy_px: Positive
    cx_px: Number
    cy_px: Number
    response_file: Path | None = None

    @model_validator(mode="after")
    def _principal_point_is_in_the_image(self) -> Self:
        if not (-0.5 <= self.cx_px <= self.width_px - 0.5 and -0.5 <= self.cy_px <= self.height_px - 0.5):
            raise ValueError(
                f"expected a principal point inside the {self.width_px} x {self.height_px} image, "
                f"got cx_px = {self.cx_px}, cy_px = {self.cy_px}"
            )
        return self


class PinholeSpec(ImageSize):
    """Pinhole with OpenCV's distortion (k1, k2, p1, p2, k3[, k4, k5, k6]); calibrated in air."""

    model: Literal["pinhole"]
    distortion: tuple[Number, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _distortion_has_five_or_eight(self) -> Self:
        if len(self.distortion) not in (5, 8):
            raise ValueError(f"expected 5 or 8 distortion coefficients, got {len(self.distortion)}")
        return self


class FisheyeSpec(ImageSize):
    """Kannala-Brandt fisheye, as OpenCV's fisheye module: r = f (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9)."""

    model: Literal["fisheye"]
    distortion: tuple[Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0)


Camera = Annotated[PinholeSpec | FisheyeSpec, Field(discriminator="model")]


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


class FlatMirror(Section):
    """Rectangular front-surface mirror plate."""

    width_mm: Positive
    height_mm: Positive
    thickness_mm: Positive = 3.0


class FoldMirror(FlatMirror):
    """M1: at 45 degrees on the camera's axis, `distance_mm` (d1) from the pinhole.

    It folds the view down (image-down), as the paper's does, or up. `width_mm` runs along the camera's x, `height_mm`
    along the slope.
    """

    distance_mm: Positive
    direction: Literal["down", "up"] = "down"


class GazeMirror(FlatMirror):
    """M2: on the folded axis, `distance_mm` (d2) from the centre of M1; turned by the two joints.

    `width_mm` runs along the tilt axis. Both joint axes cross at the centre of the reflecting face.
    """

    distance_mm: Positive


MIRROR_SECTIONS = ("fold_mirror", "gaze_mirror", "joints", "servos", "hull", "mount")


def missing_mirror_sections(present: Collection[str]) -> str | None:
    """What is expected of a rig that has only some of the mirror sections; None when it has all of them or none."""
    missing = [name for name in MIRROR_SECTIONS if name not in present]
    if not missing or len(missing) == len(MIRROR_SECTIONS):
        return None
    return f"all of {', '.join(MIRROR_SECTIONS)} or none; missing: {', '.join(missing)}"


class Rig(Section):
    """A whole mirror gaze, or (without any of the mirror sections) a camera behind a port on a bench."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    description: str = ""
    camera: Camera
    port: Port
    water: Water = Water()
    image_sensor: ImageSensorSpec | None = None
    fold_mirror: FoldMirror | None = None
    gaze_mirror: GazeMirror | None = None
    joints: Joints | None = None
    servos: Servos | None = None
    hull: Hull | None = None
    mount: Mount | None = None
    vehicle: Vehicle | None = None
    lamps: tuple[Lamp, ...] = ()

    @model_validator(mode="after")
    def _mirrors_come_whole(self) -> Self:
        missing = missing_mirror_sections([name for name in MIRROR_SECTIONS if getattr(self, name) is not None])
        if missing:
            raise ValueError(f"expected {missing}")
        return self

    @property
    def has_mirrors(self) -> bool:
        """Whether this is a mirror gaze, not a bare camera behind a port."""
        return self.fold_mirror is not None

    def without_mirrors(self) -> Rig:
        """The camera behind its port alone."""
        return self.model_copy(update=dict.fromkeys(MIRROR_SECTIONS))

    @classmethod
    def load(cls, name_or_path: str | Path) -> Rig:
        """Read a preset by name or a TOML file by path.

        Raises
        ------
        RigError
            With every problem of the file at once.
        FileNotFoundError
            When there is neither such a preset nor such a file.
        """
        from rigs.files import load_rig  # noqa: PLC0415  (files builds rigs: the import would be circular)

        return load_rig(name_or_path)
