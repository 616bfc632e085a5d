"""Images of a dive that was made without video: it is dived again, and drawn whole where somebody wants to look."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cad.assembly.meshes import rig_meshes
from dives.arena.distribution import arena_dive, arena_rig
from dives.arena.run import with_loop
from dives.recorder import png
from dives.runner import ClosedLoop
from dives.target_size import sized
from rigs.atomic_files import write_bytes
from scenes.baking.light_quality import LightQuality
from tracking.overlay import overlay


def write_frames(seed: int, variant: str, images: Mapping[int, str], *, quality: LightQuality | None = None) -> None:
    """Write what the loop saw in some frames of a seed's dive, as overlays.

    What a pixel shows does not depend on which others are drawn, so that this is the same dive.

    Parameters
    ----------
    seed : int
    variant : str
        The loop.
    images : mapping of int to str
        Path of the PNG by the frame's number.
    quality : LightQuality, optional
        The dive's: full by default.
    """
    dive = with_loop(arena_dive(seed), variant)
    rig = dive.at_frame_rate(arena_rig(dive.rig))
    closed = ClosedLoop(sized(dive, rig), rig, rig_meshes(rig), quality)
    for frame in range(max(images) + 1):
        closed.whole_images = frame in images
        record = closed.next()
        assert record is not None  # the dive was made
        if frame in images:
            path = Path(images[frame])
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, png(overlay(record.camera_frame, record.step)))
