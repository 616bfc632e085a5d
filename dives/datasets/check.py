"""Whether a data set is what its manifest says: counts, digests, and whether every file can be read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq

from dives.datasets.files import FAILURES, MANIFEST, RECORDS, TABLE, file_name
from dives.datasets.formats.readback import read_back
from dives.datasets.record import SampleRecord
from rigs.atomic_files import digest_of

MOST_PROBLEMS = 100
"""Nobody reads more."""


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """What a check found.

    Attributes
    ----------
    samples : int
        That the manifest counts.
    files : int
        That were read.
    problems : tuple of str
        Sentences; none for a set in order.
    notes : tuple of str
        Libraries that were not there to read their formats.
    """

    samples: int
    files: int
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()


def check_dataset(folder: Path, *, progress: Callable[[int, int], None] = lambda done, of: None) -> CheckResult:
    """Read every file of a finished data set, compare it with the manifest, and read formats by their own libraries.

    `progress` is called with the number of samples checked and that of all.

    Raises
    ------
    ValueError
        For a folder without a manifest that can be read.
    """
    manifest = _manifest(folder)
    problems = [problem for name, facts in manifest["files"].items() if (problem := _problem(folder / name, facts))]
    read, notes = len(manifest["files"]), list[str]()
    if not problems:
        digests = _record_digests(folder)
        counted = len(digests)
        if counted != manifest["samples"]:
            problems.append(f"{TABLE}: expected {manifest['samples']} samples, got {counted}")
        problems += _strays(folder, set(digests), {int(index) for index in manifest["failed"]})
        for done, (index, digest) in enumerate(digests.items(), 1):
            found, files = _sample_problems(folder, index, digest)
            problems += found
            read += files
            progress(done, counted)
            if len(problems) >= MOST_PROBLEMS:
                problems.append(f"fewer problems: these are the first {MOST_PROBLEMS}")
                break
    if not problems:
        problems, notes = read_back(folder)
    return CheckResult(samples=manifest["samples"], files=read, problems=tuple(problems), notes=tuple(notes))


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    if not path.is_file():
        raise ValueError(f"{folder}: expected a finished data set; there is no {MANIFEST} in it")
    try:
        manifest: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        manifest["files"].items(), manifest["failed"].items(), int(manifest["samples"])
    except (ValueError, KeyError, AttributeError, TypeError):
        raise ValueError(f"{path}: expected the manifest of a data set; make the set again to write it") from None
    return manifest


def _problem(path: Path, facts: dict[str, Any]) -> str | None:
    """Sentence on a file that is not what was written, or None."""
    if not path.is_file():
        return f"{path}: expected a file; it is gone"
    if path.stat().st_size != facts["bytes"] or digest_of(path) != facts["sha256"]:
        return f"{path}: expected the content that was written; it has changed"
    return None


def _record_digests(folder: Path) -> dict[int, str]:
    """Digests of the records by the number of the sample."""
    table = pq.read_table(folder / TABLE, columns=["index", "record_sha256"])
    return dict(zip(*(column.to_pylist() for column in table.columns), strict=True))


def _strays(folder: Path, known: set[int], failed: set[int]) -> Iterator[str]:
    """Sentences on samples that are there and that the table does not know."""
    for kind, expected in ((RECORDS, known), (FAILURES, failed)):
        there = {int(path.stem) for path in (folder / kind).glob("*/[0-9]*.json")}
        for index in sorted(there - expected)[:MOST_PROBLEMS]:
            yield f"{folder / file_name(kind, index)}: expected no sample {index}; make the set again to count it"


def _sample_problems(folder: Path, index: int, digest: str) -> tuple[list[str], int]:
    """Sentences on the files of a sample, and how many files were read."""
    path = folder / file_name(RECORDS, index)
    if not path.is_file():
        return [f"{path}: expected the record of sample {index}; it is gone: make the set again"], 0
    content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != digest:
        return [f"{path}: expected the record that was written; it has changed: remove it and make the set again"], 1
    record = SampleRecord.of_json(content)
    problems = []
    for kind, facts in record.files.items():
        file = folder / record.file(kind)
        problem = _problem(file, asdict(facts)) or (_unreadable(file, record) if file.suffix != ".exr" else None)
        if problem is not None:
            problems.append(f"{problem}: remove {path.name} in {path.parent} and make the set again")
    return problems, 1 + len(record.files)


def _unreadable(path: Path, record: SampleRecord) -> str | None:
    image = cv2.imdecode(np.frombuffer(path.read_bytes(), dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None or image.shape[:2] != (record.height_px, record.width_px):
        return f"{path}: expected an image of {record.width_px} x {record.height_px} px"
    return None
