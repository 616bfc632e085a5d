"""Things of a frame in the format of the COCO data set, which detection and segmentation toolkits load.

Masks are run-length encoded as COCO's uncompressed RLE: column by column, runs of zeros and ones in turn, zeros first.
That is ten lines, so pycocotools is not needed to write it; its `annToMask` reads it.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.status import Region
from scenes.stage.frame import Label
from scenes.truth.boxes import NOT_THINGS, Thing, things
from scenes.truth.ground_truth import GroundTruth


def coco_document(truth: GroundTruth, *, file_name: str) -> dict[str, Any]:
    """Plain values of a COCO file with one image.

    `bbox` is COCO's: left, top, width and height, measured from the outer corner of the top-left pixel. Keys that COCO
    does not know say the rest; `box_px` is `Thing.box_px`.
    """
    found, number = things(truth)
    rows, columns = truth.frame.label.shape
    return {
        "info": {
            "description": f"{truth.rig.name} seen by mirrorgaze",
            "q1_deg": float(np.degrees(truth.state.q1)),
            "q2_deg": float(np.degrees(truth.state.q2)),
            "time_s": truth.state.time_s,
            "camera_matrix": truth.camera_matrix.tolist(),
            "world_from_virtual_camera": {
                region.name.lower(): pose.tolist() for region, pose in truth.world_from_virtual().items()
            },
        },
        "images": [{"id": 1, "file_name": file_name, "width": columns, "height": rows}],
        "categories": [{"id": int(label), "name": label.name.lower()} for label in Label if label not in NOT_THINGS],
        "annotations": [_annotation(position, thing, number == position) for position, thing in enumerate(found)],
    }


def _annotation(position: int, thing: Thing, mask: NDArray[np.bool_]) -> dict[str, Any]:
    left, top, right, bottom = thing.box_px
    own = asdict(thing) | {"label": thing.label.name.lower(), "region": Region(thing.region).name.lower()}
    return {
        "id": position + 1,
        "image_id": 1,
        "category_id": int(thing.label),
        "bbox": [left, top, right - left + 1, bottom - top + 1],
        "area": thing.pixel_count,
        "iscrowd": 0,
        "segmentation": {"size": list(mask.shape), "counts": run_lengths(mask)},
        **own,
    }


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """COCO's uncompressed run lengths of a mask: down the columns, the first run counts zeros (and may be 0 long)."""
    flat = mask.ravel(order="F")
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    runs = np.diff(np.concatenate([[0], changes, [flat.size]])).tolist()
    return [0, *runs] if flat[0] else runs


def mask_of_runs(runs: list[int], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Inverse of `run_lengths`."""
    values = np.arange(len(runs)) % 2 == 1
    return np.asarray(np.repeat(values, runs).reshape(shape, order="F"))
