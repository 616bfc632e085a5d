"""The card of a data set, README.md in its folder: what is in it, how it is spread, how it was made, who may use it."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cad.export.drawings.manifest import rig_hash
from dives.datasets.contact_sheet import CONTACT_SHEET
from dives.datasets.dataset import Dataset
from dives.datasets.files import TABLE
from dives.datasets.rendering import LAYERS
from optics.kernels.arrays import FloatArray
from optics.status import Region
from rigs.atomic_files import write_text
from scenes.baking.light_quality import light_marks

CARD = "README.md"

SHEET_WORDS = (
    "*Left: the image, boxes in white. Right: grey is seen directly, green over M1, yellow over M1 and M2, red is what "
    "the boxes are about.*"
)
RECORD_WORDS = (
    "`samples/` has the record of each sample (JSON), `samples.parquet` a row for each; `rigs/` every rig with all its "
    "numbers, which with a sample's joints is its exact camera."
)
ORIGIN_WORDS = (
    "The images are rendered, not photographed: light of sun and sky through waves, absorption and scattering of the "
    "water, refraction at the port, two mirrors, the camera's noise."
)

FORMAT_WORDS = {
    "coco": "`annotations/`: COCO, boxes and masks of each split",
    "yolo": "`labels/`, `data.yaml`: YOLO, boxes",
    "bop": "`bop/`: BOP, poses, masks and depth of what is seen over both mirrors; each image says how far its matrix, "
    "a pinhole's, is from the camera",
    "webdataset": "`webdataset/`: tar shards with every layer and the record",
    "parquet": "`parquet/`: images and boxes for Hugging Face's `datasets`",
    "tum": "`trajectories/`: TUM, poses of robot, camera and target in each clip",
    "euroc": "`euroc/`: EuRoC (ASL), images and the robot's poses of each clip",
    "mcap": "`mcap/`: ROS 2 bags of the clips, with images, joints, frames and poses",
}
"""Where the files of a format are, and what is in them."""

PATH_WORDS = {"housing": "housing", "direct": "direct", "fold": "over M1", "gaze": "over M1 and M2"}

SIZES = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
"""What hubs of data sets call sizes."""


def write_card(dataset: Dataset, folder: Path, failed: dict[int, str]) -> str:
    """Write the card of a set whose table is there; returns the file's name."""
    table = pq.read_table(folder / TABLE)
    spec = dataset.spec
    parts = [
        _front_matter(dataset, table["split"].to_pylist()),
        f"# {spec.name}",
        spec.description,
        f"{table.num_rows} samples, rendered by mirrorgaze {version('mirrorgaze')} from `dataset.toml`"
        + (f"; {len(failed)} more could not be made (`failed/`)." if failed else "."),
        f"![Some samples: image with boxes, and over which mirrors each pixel is seen]({CONTACT_SHEET})",
        SHEET_WORDS,
        "## Splits",
        _markdown(_split_rows(table)),
        "## How it is spread",
        _markdown(_spread_rows(table)),
        _markdown(_word_rows(table)),
        "## Files",
        _markdown([["folder", "holds"], *([f"`{name}/`", text] for name, text in LAYERS.items())]),
        _markdown([["format", "holds"], *([name, FORMAT_WORDS[name]] for name in spec.formats)]),
        RECORD_WORDS,
        "## How it was made",
        _markdown([["rig", "SHA-256"], *([rig.name, f"`{rig_hash(rig)}`"] for rig in dataset.rigs.values())]),
        f"Seed {spec.seed}: the same file, rigs and version give the same samples. {ORIGIN_WORDS}",
        *(f"The light between surfaces is {light}, not full." for light in light_marks(dataset.quality).values()),
        "## Licence",
        spec.licence or "None is stated: ask whoever made it.",
    ]
    write_text(folder / CARD, "\n\n".join(part for part in parts if part) + "\n")
    return CARD


def _front_matter(dataset: Dataset, splits: list[str]) -> str:
    """What hubs of data sets read; `splits` has that of each sample."""
    spec = dataset.spec
    size = next((name for most, name in SIZES if len(splits) < most), "n>1M")
    lines = ["---", f"pretty_name: {spec.name}"]
    lines += [f"license: {spec.licence.lower()}"] if spec.licence else []
    lines += ["task_categories:", "- object-detection", "- depth-estimation", "size_categories:", f"- {size}"]
    if "parquet" in spec.formats:
        lines += ["configs:", "- config_name: default", "  data_files:"]
        for split in sorted(set(splits)):
            lines += [f"  - split: {split}", f"    path: parquet/{split}-*.parquet"]
    return "\n".join([*lines, "---"])


def _split_rows(table: pa.Table) -> list[list[str]]:
    splits, pixels = np.array(table["split"].to_pylist()), _numbers(table, "target.pixels")
    sizes = _numbers(table, "bytes")
    rows = [["split", "samples", "with the target in view", "MB"]]
    for split in dict.fromkeys(splits.tolist()):
        chosen = splits == split
        seen = int((pixels[chosen] > 0).sum())
        rows.append([split, str(int(chosen.sum())), str(seen), f"{sizes[chosen].sum() / 1e6:.1f}"])
    return rows


def _spread_rows(table: pa.Table) -> list[list[str]]:
    """Number, least, median, largest of what varies; shares of pixels by path."""
    rows = [["number", "least", "5 %", "median", "95 %", "largest"]]
    for name in table.schema.names:
        if not (
            name.startswith(DRAWN) or name in ("gaze.azimuth_deg", "gaze.elevation_deg", "target.visible_fraction")
        ):
            continue
        values = _numbers(table, name)
        values = values[np.isfinite(values)]
        if len(values) and values.min() < values.max():
            rows.append([name, *(f"{value:.4g}" for value in np.percentile(values, (0, 5, 50, 95, 100)))])
    pixels = _numbers(table, "target.pixels")
    if (pixels > 0).any():
        rows.append(["target, pixels, where seen", *_percentiles(pixels[pixels > 0])])
    total = _numbers(table, "width_px") * _numbers(table, "height_px")
    for region in Region:
        share = 100 * _numbers(table, f"path_px.{region.name.lower()}") / total
        rows.append([f"pixels {PATH_WORDS[region.name.lower()]}, %", *_percentiles(share)])
    return rows


DRAWN = (
    "joints.",
    "robot.",
    "target.azimuth",
    "target.elevation",
    "target.distance",
    "target.diameter",
    "decoys",
    "image.",
)


def _word_rows(table: pa.Table) -> list[list[str]]:
    """How many samples each value of what makes a scene has; what is the same in all is stated once."""
    rows = [["of the scene", "samples"]]
    for name in table.schema.names:
        if not (name.startswith("scene.") or name in ("rig", "target.shape", "target.colour")) or name == "scene.rig":
            continue
        values = table[name].to_pylist()
        counts = {value: values.count(value) for value in sorted(set(values), key=str)}
        if counts.keys() != {None}:
            told = (
                ", ".join(f"{value}: {count}" for value, count in counts.items())
                if len(counts) > 1
                else f"all: {values[0]}"
            )
            rows.append([name, told])
    return rows


def _percentiles(values: FloatArray) -> list[str]:
    return [f"{value:.4g}" for value in np.percentile(values, (0, 5, 50, 95, 100))]


def _numbers(table: pa.Table, name: str) -> FloatArray:
    return np.array([np.nan if value is None else value for value in table[name].to_pylist()], dtype=np.float64)


def _markdown(rows: Sequence[Sequence[Any]]) -> str:
    """Table whose first row is the head; nothing for a head alone."""
    if len(rows) < 2:
        return ""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)
