"""WebDataset: tar files of a thousand samples each, `webdataset/SPLIT-000000.tar`, with every layer and the record.

Owner, rights and times are the same in all of them: equal samples give equal bytes.
"""

from __future__ import annotations

import io
import tarfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from dives.datasets.dataset import Dataset
from dives.datasets.files import RECORDS, file_name, records
from rigs.atomic_files import atomic_file

SAMPLES_A_SHARD = 1000
"""Half a gigabyte at 640 x 480."""

KEYS = {"images": "image", "depth": "depth", "normals": "normal", "semantic": "semantic", "instances": "instance"}
KEYS |= {"paths": "path", "flow": "flow", "layers": "layers"}
"""What a file of a folder is called in a sample."""


def write_webdataset(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write the shards of each split; returns their names."""
    members: dict[str, list[tuple[int, dict[str, str]]]] = {split: [] for split in dataset.spec.splits}
    for record in records(folder, indices):
        names_of = {kind: record.file(kind) for kind in record.files}
        members[record.split].append((record.index, names_of))
    names = []
    (folder / "webdataset").mkdir(exist_ok=True)
    for split, samples in members.items():
        for shard, start in enumerate(range(0, len(samples), SAMPLES_A_SHARD)):
            names.append(f"webdataset/{split}-{shard:06d}.tar")
            with (
                atomic_file(folder / names[-1]) as partial,
                tarfile.open(partial, "w", format=tarfile.USTAR_FORMAT) as tar,
            ):
                for index, names_of in samples[start : start + SAMPLES_A_SHARD]:
                    for name, file in _files(folder, index, names_of):
                        content = file.read_bytes()
                        entry = tarfile.TarInfo(name)
                        entry.size = len(content)
                        tar.addfile(entry, io.BytesIO(content))
    return names


def _files(folder: Path, index: int, names_of: dict[str, str]) -> Iterator[tuple[str, Path]]:
    """Members of a sample, one after the other: its key is what is before the first dot."""
    for kind, name in names_of.items():
        file = folder / name
        yield f"{index:08d}.{KEYS[kind]}{file.suffix}", file
    yield f"{index:08d}.json", folder / file_name(RECORDS, index)
