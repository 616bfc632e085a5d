"""Images of a dive that was made without video: it is dived again, and drawn whole where somebody wants to look."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path

from cad.assembly.meshes import rig_meshes
from dives.arena.distribution import arena_dive, arena_rig
from dives.arena.run import with_loop
from dives.known_target import with_known_target
from dives.recorder import OVERLAY, png
from dives.runner import ClosedLoop
from rigs.atomic_files import atomic_file, scratch_folder, write_bytes
from scenes.baking.light_quality import LightQuality
from tracking.overlay import overlay
from tracking.video import VideoWriter, concatenate


def write_frames(
    seed: int, variant: str, images: Mapping[int, str], video: str | None = None, *, quality: LightQuality | None = None
) -> None:
    """Write what the loop saw in some frames of a seed's dive, or in all of them, as overlays.

    What a pixel shows does not depend on which others are drawn, so that this is the same dive.

    Parameters
    ----------
    seed : int
    variant : str
        The loop.
    images : mapping of int to str
        Path of the PNG by the frame's number.
    video : str, optional
        Path of an MP4 of all frames, H.264.
    quality : LightQuality, optional
        The dive's: full by default.
    """
    dive = with_loop(arena_dive(seed), variant)
    rig = dive.at_frame_rate(arena_rig(dive.rig))
    closed = ClosedLoop(with_known_target(dive, rig), rig, rig_meshes(rig), quality)
    frames = dive.frames if video else max(images) + 1
    with _video_writer(Path(video), dive.frame_rate_hz) if video else nullcontext() as writer:
        for frame in range(frames):
            closed.whole_images = frame in images or writer is not None
            record = closed.next()
            assert record is not None  # the dive was made
            if not closed.whole_images:
                continue
            image = overlay(record.camera_frame, record.step)
            if frame in images:
                path = Path(images[frame])
                path.parent.mkdir(parents=True, exist_ok=True)
                write_bytes(path, png(image))
            if writer is not None:
                writer.write(image)


@contextmanager
def _video_writer(path: Path, frame_rate_hz: float) -> Iterator[VideoWriter]:
    """Writer of a video as `dive` makes its overlay; the file is there when the last image is in it."""
    with scratch_folder(path.parent, path.name) as scratch:
        segment = scratch / OVERLAY
        writer = VideoWriter(segment, "h264", frame_rate_hz)
        try:
            yield writer
        finally:
            writer.close()
        with atomic_file(path) as partial:
            concatenate([segment], partial, container="mp4", frame_rate_hz=frame_rate_hz)
