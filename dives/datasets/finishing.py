"""What is written when all samples of a data set are there: its table, formats, card and manifest."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dives.datasets.card import write_card
from dives.datasets.contact_sheet import write_contact_sheet
from dives.datasets.dataset import Dataset
from dives.datasets.files import (
    FAILURES,
    IDENTITY,
    MANIFEST,
    SPECIFICATION,
    TABLE,
    file_name,
)
from dives.datasets.formats.bop import write_bop
from dives.datasets.formats.coco import write_coco
from dives.datasets.formats.parquet import write_parquet
from dives.datasets.formats.trajectories import write_euroc, write_tum
from dives.datasets.formats.webdataset import write_webdataset
from dives.datasets.formats.yolo import write_yolo
from dives.datasets.rendering import FLOW, LAYERS
from dives.datasets.table import write_table
from rigs.atomic_files import digest_of, write_text
from scenes.baking.light_quality import light_marks


def _write_mcap(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    from dives.datasets.formats.clip_bags import write_mcap  # noqa: PLC0415  (the modelling kernel comes with it)

    return write_mcap(dataset, folder, indices)


FORMATS: dict[str, Callable[[Dataset, Path, Sequence[int]], list[str]]] = {
    "coco": write_coco,
    "yolo": write_yolo,
    "bop": write_bop,
    "webdataset": write_webdataset,
    "parquet": write_parquet,
    "tum": write_tum,
    "euroc": write_euroc,
    "mcap": _write_mcap,
}
"""Each writes the samples of a set, and returns the files that the manifest lists."""


def finish(
    dataset: Dataset, folder: Path, *, log: Callable[[str], None] = lambda line: None
) -> tuple[dict[int, str], tuple[str, ...]]:
    """Write table, formats, card and manifest of a set whose samples are all there.

    Returns
    -------
    failed : dict of int to str
        Sentences on samples that were set aside.
    files : tuple of str
        What was written, by its path in the set's folder.
    """
    failed = dict(_failures(dataset, folder))
    indices = [index for index in range(dataset.spec.samples) if index not in failed]
    log("table ...")
    write_table(dataset, folder, indices)
    files = [TABLE]
    for name in dataset.spec.formats:
        log(f"{name} ...")
        files += FORMATS[name](dataset, folder, indices)
    if indices:
        log("card ...")
        files += [write_contact_sheet(dataset, folder, indices), write_card(dataset, folder, failed)]
    _write_manifest(dataset, folder, failed, [SPECIFICATION, IDENTITY, *_rig_files(dataset), *files])
    return failed, (*files, MANIFEST)


def _failures(dataset: Dataset, folder: Path) -> Iterator[tuple[int, str]]:
    if not (folder / FAILURES).is_dir():
        return
    for path in sorted((folder / FAILURES).rglob("*.json")):
        failure = json.loads(path.read_text(encoding="utf-8"))
        if failure["index"] < dataset.spec.samples:
            yield failure["index"], failure["sentence"]


def _rig_files(dataset: Dataset) -> list[str]:
    return sorted(f"rigs/{rig.name}.toml" for rig in dataset.rigs.values())


def _write_manifest(dataset: Dataset, folder: Path, failed: dict[int, str], files: list[str]) -> None:
    """Write what the set holds: the table has the digest of each sample's record, which has those of its files."""
    contents: dict[str, Any] = {
        "name": dataset.spec.name,
        "version": version("mirrorgaze"),
        "samples": dataset.spec.samples - len(failed),
        "failed": {str(index): sentence for index, sentence in failed.items()},
        "layers": LAYERS | (FLOW if dataset.spec.clip.flow else {}),
        "record": file_name("samples", 0),
        **light_marks(dataset.quality),
        "files": {
            name: {"sha256": digest_of(folder / name), "bytes": (folder / name).stat().st_size} for name in files
        },
    }
    write_text(folder / MANIFEST, json.dumps(contents, indent=2, ensure_ascii=False) + "\n")
