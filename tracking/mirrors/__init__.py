"""Drivers of the gaze mirror: simulated servos, recorded joints, a servo controller on a serial port."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from rigs import Rig
from tracking.mirrors.estimate import JointEstimate
from tracking.mirrors.recording import ReplayedMirrors
from tracking.protocols import MirrorDriver

NO_MIRRORS = "none"
MAESTRO = "maestro:"


def open_mirrors(name: str, rig: Rig, *, joints: Path | None, live: bool) -> AbstractContextManager[MirrorDriver]:
    """The driver that a name means, for a `with` statement.

    Parameters
    ----------
    name : str
        "none": nothing is turned; "maestro:" and a serial port.
    rig : Rig
        With mirrors.
    joints : Path, optional
        What the joints were, where nothing is turned; without it, they stand at q = 0 or the limits next to it.
    live : bool
        Whether the images show what the mirrors do now.

    Raises
    ------
    OSError, ValueError
        When there is no such driver, it does not open, or it does not go with the rest.
    """
    if name == NO_MIRRORS:
        if joints is not None:
            return nullcontext(ReplayedMirrors.from_file(joints))
        return nullcontext(ReplayedMirrors([0.0], [JointEstimate(rig).report(0.0).q]))
    if not name.startswith(MAESTRO) or name == MAESTRO:
        raise ValueError(f"mirrors {name!r}: expected {NO_MIRRORS} or {MAESTRO} and a serial port")
    if joints is not None:
        raise ValueError(f"mirrors {name!r}: expected no recorded joints beside a driver, got {joints}")
    if not live:
        raise ValueError(f"mirrors {name!r}: expected a live camera; a recording shows no mirror that is turned now")
    # Serial ports are a matter of Unix: what replays a recording runs elsewhere, too.
    from tracking.mirrors.maestro import maestro_mirrors  # noqa: PLC0415

    return maestro_mirrors(rig, Path(name.removeprefix(MAESTRO)))
