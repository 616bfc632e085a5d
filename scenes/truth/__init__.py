"""Ground truth of a frame, through port and mirrors: depth, normals, motion, masks, boxes, and the files they go to."""

from scenes.truth.files import write_truth
from scenes.truth.ground_truth import GroundTruth, ground_truth

__all__ = ["GroundTruth", "ground_truth", "write_truth"]
