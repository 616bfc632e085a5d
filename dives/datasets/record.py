"""The record of a sample: everything that is known of it beside its images, and how it is written."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

Matrix = list[list[float]]

SAMPLES_A_FOLDER = 1000
"""File systems and file managers are slow with more."""


@dataclass(frozen=True, kw_only=True)
class SampleFile:
    """An image or a layer of a sample: how its name ends, its SHA-256, and its number of bytes."""

    suffix: str
    sha256: str
    bytes: int


@dataclass(frozen=True, kw_only=True)
class SampleRecord:
    """A sample without its images, as its JSON file has it, key by key (`docs/reference/data_set_files.md`).

    Attributes
    ----------
    index, clip, frame : int
        Number of the sample, of its clip, and in its clip.
    split : str
    scene : dict of str to value
        What makes the scene, by dotted key, with its number.
    drawn : dict of str to value
        What was drawn for the sample, by dotted key.
    time_s : float
    width_px, height_px : int
    rig : str
    camera_matrix : 3 x 3
        In air.
    world_from_virtual_camera : dict of str to 4 x 4
        By path: direct, fold, gaze.
    world_from_body, world_from_target : 4 x 4
        The target's is None where there is none, as are its radius and, where it is not seen, its pixel.
    world_from_decoys : list of 4 x 4
        In the file's order; None for one that is not there.
    joints_deg, gaze_deg, exposure : dict of str to float
        Gaze of a rig with mirrors, exposure of a sensor.
    path_px : dict of str to int
        Pixels of each path.
    instances : dict of str to str
        Names by the numbers in the layer.
    annotations : list of dict
        As COCO has them, without masks.
    files : dict of str to SampleFile
        By folder.
    """

    index: int
    split: str
    clip: int
    frame: int
    scene: dict[str, Any]
    drawn: dict[str, Any]
    time_s: float
    width_px: int
    height_px: int
    rig: str
    camera_matrix: Matrix
    world_from_virtual_camera: dict[str, Matrix]
    world_from_body: Matrix
    world_from_target: Matrix | None
    world_from_decoys: list[Matrix | None]
    target_radius_m: float | None
    target_px: tuple[float, float] | None
    joints_deg: dict[str, float]
    gaze_deg: dict[str, float] | None
    exposure: dict[str, float] | None
    path_px: dict[str, int]
    instances: dict[str, str]
    annotations: list[dict[str, Any]]
    files: dict[str, SampleFile]

    @classmethod
    def of_json(cls, content: bytes) -> Self:
        """Read what `json` wrote; raises `ValueError` for keys of another version."""
        document = json.loads(content)
        if document.keys() != {field.name for field in fields(cls)}:
            raise ValueError("expected a sample's record as this version writes it, got other keys: make the set again")
        files = {kind: SampleFile(**facts) for kind, facts in document["files"].items()}
        return cls(**document | {"files": files})

    def json(self) -> bytes:
        """The record's file."""
        document = vars(self) | {"files": {kind: asdict(facts) for kind, facts in self.files.items()}}
        return (json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n").encode()

    def file(self, kind: str) -> str:
        """Image or layer in the set's folder, such as ``depth/00012/00012345.png``."""
        return numbered(kind, self.index, self.files[kind].suffix)


def file_facts(suffix: str, content: bytes) -> SampleFile:
    """What a record says of a file's content."""
    return SampleFile(suffix=suffix, sha256=hashlib.sha256(content).hexdigest(), bytes=len(content))


def numbered(kind: str, index: int, suffix: str) -> str:
    """File of a sample in the set's folder."""
    return f"{kind}/{index // SAMPLES_A_FOLDER:05d}/{index:08d}{suffix}"
