"""One picture of a data set: some of its images with their boxes, beside each the paths of its pixels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from dives.datasets.dataset import Dataset
from dives.datasets.files import records
from dives.datasets.formats.coco import boxes_of
from dives.datasets.record import SampleRecord
from dives.datasets.rendering import FURTHER
from optics.status import Region
from rigs.atomic_files import write_bytes

CONTACT_SHEET = "contact_sheet.png"
COLUMNS, ROWS = 4, 5
WIDTH_PX = 240

PATH_COLOURS = {
    Region.HOUSING: (40, 40, 40),
    Region.DIRECT: (148, 163, 184),
    Region.FOLD: (42, 157, 143),
    Region.GAZE: (233, 196, 106),
}
"""Red, green, blue of each path; a further reflection is darker."""

THING_COLOUR = (200, 30, 40)


def write_contact_sheet(dataset: Dataset, folder: Path, indices: Sequence[int]) -> str:
    """Write some samples, evenly over the set, side by side with their paths; returns the file's name."""
    chosen = [indices[k] for k in np.unique(np.linspace(0, len(indices) - 1, COLUMNS * ROWS).astype(int))]
    tiles = [_tile(dataset, folder, record) for record in records(folder, chosen)]
    height = max(tile.shape[0] for tile in tiles)
    sheet = np.full((-(-len(tiles) // COLUMNS) * height, COLUMNS * 2 * WIDTH_PX, 3), 255, dtype=np.uint8)
    for place, tile in enumerate(tiles):
        row, column = divmod(place, COLUMNS)
        sheet[row * height : row * height + tile.shape[0], column * 2 * WIDTH_PX :][:, : 2 * WIDTH_PX] = tile
    write_bytes(folder / CONTACT_SHEET, cv2.imencode(".png", np.ascontiguousarray(sheet[..., ::-1]))[1].tobytes())
    return CONTACT_SHEET


def _tile(dataset: Dataset, folder: Path, record: SampleRecord) -> NDArray[np.uint8]:
    """Image with boxes, and beside it the paths, with what the boxes are about in red."""
    scale = WIDTH_PX / record.width_px
    size = (WIDTH_PX, round(record.height_px * scale))
    shown = [_read(folder / record.file(kind)) for kind in ("images", "paths", "semantic")]
    image = cv2.resize(shown[0], size, interpolation=cv2.INTER_AREA)[..., ::-1].copy()
    boxes = boxes_of(dataset, record)
    for box in boxes:
        left, top, width, height = (round(value * scale) for value in box["bbox"])
        cv2.rectangle(image, (left, top), (left + width, top + height), (255, 255, 255), 1)
    paths = np.array([PATH_COLOURS[region] for region in Region], dtype=np.uint8)[shown[1] % FURTHER]
    paths[shown[1] >= FURTHER] //= 2
    paths[np.isin(shown[2], [box["category_id"] for box in boxes])] = THING_COLOUR
    return np.hstack([image, cv2.resize(paths, size, interpolation=cv2.INTER_NEAREST)])


def _read(file: Path) -> NDArray[np.uint8]:
    return np.asarray(cv2.imread(str(file), cv2.IMREAD_UNCHANGED), dtype=np.uint8)
