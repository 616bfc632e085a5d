"""Formats of a data set read by their own libraries, as far as these are installed."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import tarfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq

from dives.datasets.files import IMAGE_TOPIC, TABLE, records
from dives.datasets.formats.bop import mask_info
from rigs.atomic_files import digest_of


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


def _bop(folder: Path) -> Iterator[str]:
    """As programs for BOP read it: images by the numbers in `scene_camera.json`, a mask for each pose."""
    for scene in sorted((folder / "bop").glob("*/[0-9]*")):
        files = [scene / f"scene_{name}.json" for name in ("camera", "gt", "gt_info")]
        cameras, poses, infos = (json.loads(file.read_text(encoding="utf-8")) for file in files)
        if not cameras.keys() == poses.keys() == infos.keys():
            yield f"{scene}: expected the same images in its three JSON files"
            continue
        for name in cameras:
            yield from _bop_image(folder, scene, int(name), poses[name], infos[name])


def _bop_image(folder: Path, scene: Path, index: int, poses: list[Any], infos: list[Any]) -> Iterator[str]:
    (record,) = records(folder, [index])
    rgb = record.files["images"]
    image = scene / "rgb" / f"{index:06d}{rgb.suffix}"
    if not image.is_file() or digest_of(image) != rgb.sha256:
        yield f"{image}: expected the image of sample {index}"
    depth = cv2.imread(str(scene / "depth" / f"{index:06d}.png"), cv2.IMREAD_UNCHANGED)
    if depth is None or len(poses) != len(infos):
        yield f"{scene}: expected depth of sample {index}, and as many entries as poses"
        return
    for number, info in enumerate(infos):
        files = [scene / kind / f"{index:06d}_{number:06d}.png" for kind in ("mask", "mask_visib")]
        masks = [np.asarray(mask) > 0 for file in files if (mask := cv2.imread(str(file), 0)) is not None]
        if len(masks) != len(files) or not masks[0].any() or mask_info(masks[0], masks[1], depth) != info:
            yield f"{files[0]}: expected masks with the boxes and counts of scene_gt_info.json"


def _mcap(folder: Path) -> Iterator[str]:
    files = sorted((folder / "mcap").glob("*/*.mcap"))
    if not files:
        return
    from mcap.exceptions import McapError  # noqa: PLC0415
    from mcap.reader import make_reader  # noqa: PLC0415
    from mcap_ros2.decoder import DecoderFactory  # noqa: PLC0415

    images = pq.read_table(folder / TABLE, columns=["clip", "image"]).to_pylist()
    for file in files:
        digests: Counter[str] = Counter()
        clip = int(file.stem.removeprefix("clip-"))
        expected = Counter(digest_of(folder / row["image"]) for row in images if row["clip"] == clip)
        try:
            with file.open("rb") as stream:
                reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
                for _, channel, _, message in reader.iter_decoded_messages():
                    if channel.topic == IMAGE_TOPIC:
                        digests[hashlib.sha256(bytes(message.data)).hexdigest()] += 1
        except McapError as error:
            yield f"{file}: expected an MCAP file, got {error}"
            continue
        if digests != expected:
            yield f"{file}: expected the {expected.total()} images of clip {clip}"


def _different(place: Path, found: Counter[str], expected: Counter[str]) -> Iterator[str]:
    for split in sorted(found.keys() | expected.keys()):
        if found[split] != expected[split]:
            yield f"{place}: expected {expected[split]} samples of {split}, got {found[split]}"


def _splits(folder: Path) -> Counter[str]:
    """How many samples each split has."""
    return Counter(pq.read_table(folder / TABLE, columns=["split"])["split"].to_pylist())


READERS: dict[str, Callable[[Path], Any]] = {
    "coco": _coco,
    "bop": _bop,
    "webdataset": _webdataset,
    "parquet": _parquet,
    "mcap": _mcap,
}
