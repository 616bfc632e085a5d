"""Formats of a data set read by their own libraries, as far as these are installed."""

from __future__ import annotations

import contextlib
import io
import tarfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from dives.datasets.files import TABLE


def read_back(folder: Path) -> tuple[list[str], list[str]]:
    """Problems of the formats that are there, and notes on libraries that are not."""
    problems, notes = [], []
    for name, read in READERS.items():
        try:
            problems += list(read(folder))
        except ImportError:
            notes.append(f"{name}: not read by its own library, which is not installed")
    return problems, notes


def _coco(folder: Path) -> Iterator[str]:
    files = sorted((folder / "annotations").glob("instances_*.json"))
    if not files:
        return
    from pycocotools.coco import COCO  # noqa: PLC0415  (not installed with the toolkit)

    counts = _splits(folder)
    for file in files:
        with contextlib.redirect_stdout(io.StringIO()):
            read = COCO(str(file))
        expected = counts[file.stem.removeprefix("instances_")]
        if len(read.imgs) != expected:
            yield f"{file}: expected {expected} images, got {len(read.imgs)}"
        for annotation in read.anns.values():
            if annotation["image_id"] not in read.imgs:
                yield f"{file}: expected the image of annotation {annotation['id']}; it is not listed"
            elif int(read.annToMask(annotation).sum()) != annotation["area"]:
                yield f"{file}: expected a mask of {annotation['area']} px in annotation {annotation['id']}"


def _webdataset(folder: Path) -> Iterator[str]:
    shards = sorted((folder / "webdataset").glob("*.tar"))
    if not shards:
        return
    import webdataset  # noqa: PLC0415

    found: Counter[str] = Counter()
    for shard in shards:
        try:
            keys = [each["__key__"] for each in webdataset.WebDataset(str(shard), shardshuffle=False)]
        except (tarfile.TarError, OSError, ValueError) as error:
            yield f"{shard}: expected a tar file of samples, got {error}"
            continue
        found[shard.stem.rpartition("-")[0]] += len(set(keys))
    yield from _different(folder / "webdataset", found, _splits(folder))


def _parquet(folder: Path) -> Iterator[str]:
    files = sorted((folder / "parquet").glob("*.parquet"))
    if not files:
        return
    from datasets import Features, Image  # noqa: PLC0415

    found: Counter[str] = Counter()
    for file in files:
        read = pq.ParquetFile(file)
        found[file.stem.rpartition("-")[0]] += read.metadata.num_rows
        if not isinstance(Features.from_arrow_schema(read.schema_arrow)["image"], Image):
            yield f"{file}: expected a column of images"
    yield from _different(folder / "parquet", found, _splits(folder))


def _different(place: Path, found: Counter[str], expected: Counter[str]) -> Iterator[str]:
    for split in sorted(found.keys() | expected.keys()):
        if found[split] != expected[split]:
            yield f"{place}: expected {expected[split]} samples of {split}, got {found[split]}"


def _splits(folder: Path) -> Counter[str]:
    """How many samples each split has."""
    return Counter(pq.read_table(folder / TABLE, columns=["split"])["split"].to_pylist())


READERS: dict[str, Callable[[Path], Any]] = {"coco": _coco, "webdataset": _webdataset, "parquet": _parquet}
