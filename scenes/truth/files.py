"""Ground truth as files: layers, masks and boxes."""

from __future__ import annotations

import json
from pathlib import Path

import cv2

from rigs.atomic_files import atomic_files
from scenes.truth.coco import coco_document
from scenes.truth.ground_truth import GroundTruth
from scenes.truth.layers import write_layers
from scenes.truth.masks import mask_images

LAYERS_FILE = "layers.exr"


def write_truth(folder: Path, truth: GroundTruth, *, light: str = "full") -> list[Path]:
    """Write `layers.exr`, `boxes.json` (COCO) and `masks/NAME.png` into a folder, which is made.

    Everything is made beside the folder first, so that nothing is there when something fails; files of the same names
    are replaced.

    Returns
    -------
    list of Path
        What was written, sorted.
    """
    with atomic_files(folder) as partial:
        write_layers(truth, partial / LAYERS_FILE, light=light)
        document = coco_document(truth, file_name=LAYERS_FILE)
        (partial / "boxes.json").write_text(json.dumps(document) + "\n", encoding="utf-8")
        (partial / "masks").mkdir()
        for mask, image in mask_images(truth.frame).items():
            if not cv2.imwrite(str(partial / "masks" / f"{mask}.png"), image):
                raise OSError(f"{folder}: could not write the mask {mask!r}")
        names = sorted(path.relative_to(partial) for path in partial.rglob("*") if path.is_file())
    return [folder / name for name in names]
