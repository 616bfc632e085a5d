"""Things in a frame: each as often as it is seen, directly and over the mirrors, with its tight box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from optics.status import Region
from scenes.stage.frame import Label
from scenes.truth.carriers import world_from_camera
from scenes.truth.ground_truth import GroundTruth
from scenes.truth.silhouette import ball_silhouette, train_regions

NOT_THINGS = (Label.HOUSING, Label.OPEN_WATER, Label.SURFACE, Label.MIRROR)


@dataclass(frozen=True, kw_only=True)
class Thing:
    """One thing as it is seen in one region.

    Attributes
    ----------
    label : Label
    instance : int
        Position in the instance names, -1 for none.
    name : str
        The instance's, else the label's.
    region : Region
        Over which mirrors it is seen.
    further_reflection : bool
        Seen over one more reflection: in the sea surface from below, or over the mirrors in another order.
    box_px : (u_min, v_min, u_max, v_max)
        First and last columns and rows that it fills: pixels counted from 0, both ends included. Between pixel
        *centres*; the area reaches half a pixel farther on all sides.
    pixel_count : int
    visible_fraction : float, optional
        Its pixels, of those that would show it if nothing but mirrors and port were in the water. Known for a ball.
    inside_fraction : float, optional
        Share of its silhouette in the image that its region's mirrors hold. Known for a ball.
    """

    label: Label
    instance: int
    name: str
    region: Region
    further_reflection: bool
    box_px: tuple[int, int, int, int]
    pixel_count: int
    visible_fraction: float | None = None
    inside_fraction: float | None = None


def things(truth: GroundTruth) -> tuple[list[Thing], NDArray[np.int32]]:
    """What is seen, and which pixels show it.

    Returns
    -------
    found : list of Thing
        Sorted by instance, label, region. The world without an instance is background, not a thing.
    number : array, shape (height, width)
        Position in `found` of what each pixel shows, -1 for none of them.
    """
    frame, further = truth.frame, truth.view.further_reflection
    is_thing = ~np.isin(frame.label, NOT_THINGS) & ~((frame.label == Label.WORLD) & (frame.instance < 0))
    place = np.stack([frame.instance, frame.label, frame.region, further], axis=-1).astype(np.int64)
    keys, number_of = np.unique(_joined(place[is_thing]), return_inverse=True)
    number = np.full(frame.label.shape, -1, dtype=np.int32)
    number[is_thing] = number_of
    counts = np.bincount(number_of, minlength=len(keys))
    found: list[Thing] = []
    for key, count, where in zip(keys, counts, find_objects(number + 1), strict=True):
        instance, label, region, reflected = _parted(int(key))
        rows, columns = where
        shares = (
            _ball_shares(truth, np.equal(number, len(found)), Region(region)) if label == Label.TARGET else (None, None)
        )
        found.append(
            Thing(
                label=Label(label),
                instance=instance,
                name=_name(truth.instance_names, instance, Label(label)),
                region=Region(region),
                further_reflection=bool(reflected),
                box_px=(columns.start, rows.start, columns.stop - 1, rows.stop - 1),
                pixel_count=int(count),
                visible_fraction=None if reflected else shares[0],
                inside_fraction=None if reflected else shares[1],
            )
        )
    return found, number


def _joined(place: NDArray[np.int64]) -> NDArray[np.int64]:
    """One number for (instance, label, region, further reflection); instances first, so that they sort together."""
    instance, label, region, further = place.T
    return np.asarray((((instance + 1) * 16 + label) * 4 + region) * 2 + further)


def _parted(key: int) -> tuple[int, int, int, int]:
    key, further = divmod(key, 2)
    key, region = divmod(key, 4)
    instance, label = divmod(key, 16)
    return instance - 1, label, region, further


def _name(instance_names: Sequence[str], instance: int, label: Label) -> str:
    return instance_names[instance] if 0 <= instance < len(instance_names) else label.name.lower()


def _ball_shares(truth: GroundTruth, visible: NDArray[np.bool_], region: Region) -> tuple[float | None, float | None]:
    """Visible and inside fraction of the ball in a region."""
    if truth.target_radius_m is None or truth.state.world_from_target is None:
        return None, None
    rig, train = truth.rig, truth.train
    rows, columns = truth.frame.region.shape
    centre = world_from_camera(rig, truth.state).inv().apply(truth.state.world_from_target.translation)
    # A pixel on an edge may be the ball's in single precision and not in double precision: it is both's then.
    silhouette = visible | ball_silhouette(
        rig, train, centre_m=centre, radius_m=truth.target_radius_m, region=region, shape=(rows, columns)
    )
    unhidden = visible | (silhouette & (train_regions(rig, train, (rows, columns)) == region))
    return float(visible.sum() / unhidden.sum()), float(unhidden.sum() / silhouette.sum())
