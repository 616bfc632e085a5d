"""The rig: everything that one rig file says, frozen, typed, with the units in the names.

Frames are those of `docs/reference/conventions.md`: the body frame is x forward, y left, z up; the camera frame is
x right, y down, z forward. Lengths are millimetres here and metres everywhere behind `optics`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    Field,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import ErrorDetails
from pydantic_core.core_schema import CoreSchema

from rigs.atomic_files import write_text
from rigs.camera import Camera
from rigs.display import Facts, facts_table
from rigs.documents.changes import ARGUMENT, bring_up_to_date, with_values
from rigs.documents.problems import RigError
from rigs.documents.toml import parse_toml, read_toml
from rigs.documents.validation import validated
from rigs.files import find_rig, load_document, missing_files, with_absolute_files
from rigs.gaze import Gaze
from rigs.image_sensor import ImageSensorSpec
from rigs.lamps import Lamp
from rigs.mounting import FileHull, Vehicle
from rigs.port import Port
from rigs.requirements import Requirements
from rigs.section import Section
from rigs.water import Water

GAZE_TABLES = tuple(Gaze.model_fields)
"""The file has no table `gaze`: these six stand at its top, and come together or not at all."""


def _spread(document: Mapping[str, Any], tables: Mapping[str, Any]) -> dict[str, Any]:
    """A document with tables in the place of `gaze`, where it has that key."""
    parts = (tables if key == "gaze" else {key: value} for key, value in document.items())
    return {key: value for part in parts for key, value in part.items()}


class Rig(Section):
    """A whole mirror gaze, or (without `gaze`) a camera behind a port on a bench.

    `revision` is what its owner calls this state of the design, such as B; reports carry it.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    description: str = ""
    revision: Annotated[str, Field(min_length=1, max_length=20)] | None = None
    camera: Camera
    port: Port
    water: Water = Water()
    image_sensor: ImageSensorSpec | None = None
    gaze: Gaze | None = None
    vehicle: Vehicle | None = None
    lamps: tuple[Lamp, ...] = ()
    requirements: Requirements | None = None

    def require_gaze(self) -> Gaze:
        """Mirrors and what goes with them; raises `ValueError` for a bare camera behind a port."""
        if self.gaze is None:
            raise ValueError(
                f"expected a rig with mirrors, got {self.name!r}, which has none: "
                f"its file would need the tables {', '.join(GAZE_TABLES[:-1])} and {GAZE_TABLES[-1]}"
            )
        return self.gaze

    @property
    def facts(self) -> Facts:
        """Rows of the table that describes the rig."""
        camera, port, water = self.camera, self.port, self.water
        facts = [
            ("Camera", f"{camera.model}, {camera.width_px} × {camera.height_px} px, f = {camera.fx_px:g} px"),
            (
                "Port",
                "none" if port.shape == "none" else f"{port.shape}, {port.material}, {port.thickness_mm:g} mm thick",
            ),
            (
                "Water",
                f"{water.label}, {water.salinity_ppt:g} ppt, {water.temperature_celsius:g} °C",
            ),
        ]
        if self.gaze is None:
            return facts
        for name, mirror in (("Fold mirror M1", self.gaze.fold_mirror), ("Gaze mirror M2", self.gaze.gaze_mirror)):
            facts.append((name, f"{mirror.size.replace(' x ', ' × ')}, {mirror.distance_mm:g} mm along the axis"))
        for name, joint in (("Pan q1", self.gaze.joints.pan), ("Tilt q2", self.gaze.joints.tilt)):
            facts.append((name, f"{joint.min_deg:g} to {joint.max_deg:g}°"))
        servos = self.gaze.servos
        return [*facts, ("Servos", f"pan {servos.pan.name}, tilt {servos.tilt.name}")]

    def _repr_html_(self) -> str:
        return facts_table(self.name, self.facts)

    @property
    def file_hull(self) -> FileHull | None:
        """The hull, where a file of the user's says what it looks like."""
        return self.gaze.hull if self.gaze is not None and isinstance(self.gaze.hull, FileHull) else None

    def with_gaze(self, **tables: Section | Mapping[str, Any]) -> Rig:
        """The same rig with other tables of its gaze (`hull=hull`), or values in them (`mount={"wall_mm": 5.0}`)."""
        gaze = self.require_gaze()
        changed = {
            name: table if isinstance(table, Section) else getattr(gaze, name).model_copy(update=table)
            for name, table in tables.items()
        }
        return self.model_copy(update={"gaze": Gaze(**(dict(gaze) | changed))})

    def with_(self, **changes: object) -> Rig:
        """The same rig with other values by their places in the file: ``with_(gaze_mirror__width_mm=90)``.

        A table is given whole as a mapping, and None takes an optional key or table away.

        Raises
        ------
        RigError
            With every problem of the rig that this would be.
        """
        document = with_values(self._values(), changes, ARGUMENT)
        rig, problems = validated(type(self), document)
        if rig is None or problems:
            raise RigError(f"{self.name} with {', '.join(changes)}", problems)
        return rig

    def save(self, path: str | Path) -> Path:
        """Write the rig as a rig file; of one that is there only what differs changes, and its comments stay.

        Raises
        ------
        RigError
            For a file that is there and holds no rig.
        """
        import tomlkit  # noqa: PLC0415  (only what writes rig files needs it)

        path, now = Path(path), self._values()
        if path.is_file():
            document = load_document(path)
            bring_up_to_date(document, Rig.load(path)._values(), now)
        else:
            document = tomlkit.parse(tomlkit.dumps(now))
        write_text(path, tomlkit.dumps(document))
        return path

    def _values(self) -> dict[str, Any]:
        """Every value of the file, as TOML has it."""
        return self.model_dump(mode="json", exclude_none=True)

    def without_mirrors(self) -> Rig:
        """The camera behind its port alone."""
        return self.model_copy(update={"gaze": None})

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
        path, source = find_rig(name_or_path), str(name_or_path)
        return cls.parse(read_toml(path, source=source, error=RigError), source=source, folder=path.parent)

    @classmethod
    def parse(cls, text: str, *, source: str, folder: Path) -> Rig:
        """Validate the text of a rig file; relative file names in it are taken from `folder`.

        Raises
        ------
        RigError
            With every problem at once.
        """
        document = parse_toml(text, source=source, error=RigError)
        rig, problems = validated(cls, document)
        places = {problem.place for problem in problems}
        problems += [problem for problem in missing_files(document, folder) if problem.place not in places]
        if rig is None or problems:
            raise RigError(source, problems)
        return cls.model_validate(with_absolute_files(document, folder))

    @model_validator(mode="before")
    @classmethod
    def _gather_gaze(cls, document: Any) -> Any:
        """Put the six tables of the file into one; an unknown table named `gaze` is found there, as an unknown key."""
        if not isinstance(document, Mapping):
            return document
        tables = {key: document[key] for key in GAZE_TABLES if document.get(key) is not None}
        rest = {key: value for key, value in document.items() if key not in GAZE_TABLES}
        if not isinstance(rest.get("gaze"), Gaze | None):
            tables["gaze"] = rest.pop("gaze")
        return rest | ({"gaze": tables} if tables else {})

    @model_serializer(mode="wrap")
    def _as_in_the_file(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        document: dict[str, Any] = handler(self)
        return _spread(document, document.get("gaze") or dict.fromkeys(GAZE_TABLES))

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        reference = handler(core_schema)
        schema = handler.resolve_ref_schema(reference)
        gaze = handler.resolve_ref_schema(schema["properties"]["gaze"]["anyOf"][0])
        schema["properties"] = _spread(schema["properties"], gaze["properties"])
        schema["dependentRequired"] = {key: [other for other in GAZE_TABLES if other != key] for key in GAZE_TABLES}
        return reference

    @classmethod
    def errors_in_file(cls, error: ValidationError) -> list[ErrorDetails]:
        """What is wrong, at its place in the file; tables missing beside others are one problem, of the whole file."""
        details, missing = [], []
        for detail in super().errors_in_file(error):
            keys = detail["loc"]
            if keys[0:1] == ("gaze",):
                keys = keys[1:]
            if keys != detail["loc"] and detail["type"] == "missing" and len(keys) == 1:
                missing.append(str(keys[0]))
            else:
                details.append(ErrorDetails(**{**detail, "loc": keys}))
        if missing and len(missing) < len(GAZE_TABLES):
            expected = f"all of {', '.join(GAZE_TABLES)} or none; missing: {', '.join(missing)}"
            details.append(ErrorDetails(type="value_error", loc=(), msg=f"expected {expected}", input=None))
        return details
