"""Where the files of a data set are, by the number of the sample."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from dives.datasets.record import SampleRecord, numbered
from dives.datasets.rendering import Rendered
from rigs.atomic_files import write_bytes

RECORDS = "samples"
"""Folder of the records; a sample whose record is there is whole."""

FAILURES = "failed"
"""Folder of sentences on samples that cannot be made."""

SUFFIXES = {RECORDS: ".json", FAILURES: ".json", "labels": ".txt"}
"""Of the folders whose files no record names."""

SPECIFICATION = "dataset.toml"
IDENTITY = "identity.json"
MANIFEST = "manifest.json"
TABLE = "samples.parquet"

IMAGE_TOPIC = "/camera/image_raw/compressed"
"""Of the images in a clip's bag."""


def file_name(kind: str, index: int) -> str:
    """Record, failure or labels of a sample in the set's folder, such as ``samples/00012/00012345.json``."""
    return numbered(kind, index, SUFFIXES[kind])


def write_sample(folder: Path, index: int, sample: Rendered) -> None:
    """Write the files of a sample, each whole or not at all, and its record last."""
    for kind, content in sample.files.items():
        _write(folder / sample.record.file(kind), content)
    _write(folder / file_name(RECORDS, index), sample.record.json())


def write_failure(folder: Path, index: int, sentence: str) -> None:
    """Set a sample aside that cannot be made."""
    _write(folder / file_name(FAILURES, index), (json.dumps({"index": index, "sentence": sentence}) + "\n").encode())


def is_done(folder: Path, index: int) -> bool:
    """Whether a sample is there, or is known to be impossible."""
    return (folder / file_name(RECORDS, index)).is_file() or (folder / file_name(FAILURES, index)).is_file()


def records(folder: Path, indices: Iterable[int]) -> Iterator[SampleRecord]:
    """Records of samples that are there."""
    for index in indices:
        yield SampleRecord.of_json((folder / file_name(RECORDS, index)).read_bytes())


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, content)
