"""A new rig on the hull of a file: the file is read, what it is taken for is said, and the rig is written on it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import tomlkit

from cad.hulls.files.found import FoundCamera
from cad.hulls.files.openings import openings
from cad.hulls.files.taken import TakenHull, openings_text, option_problems, take_hull
from cad.hulls.files.triangles import read_hull_file
from cad.hulls.hull import closed_surface, file_hull_solid
from cad.placement.fold_frame import CAMERA
from cad.placement.placement import Placement
from reports.progress import Log
from reports.studies.placement import place_document, put_vehicle
from rigs import Rig
from rigs.files import load_document
from rigs.mounting import KeptBodies
from rigs.new_rig import PLAIN_RIG, check_new_file, put_hull_file, rig_document, save_new_rig

LARGE_HOLES = 2.0
"""Open edges as long as this many times the longest side are those of skin that is missing, not of a tube's ends."""
LARGE_BYTES = 50_000_000
"""Reading a larger file takes long enough to be announced."""


def new_rig_on_hull(
    name: str,
    file: Path,
    hull: Path,
    *,
    preset: str | None = None,
    unit: str | None = None,
    forward: str | None = None,
    up: str | None = None,
    keep: str = "all",
    camera_mm: tuple[float, float, float] | None = None,
    camera_from: str | None = None,
    look_deg: tuple[float, float] | None = None,
    log: Log,
    found: Callable[[TakenHull], None] = lambda taken: None,
) -> tuple[TakenHull, Placement]:
    """Write a rig whose hull is a file, with camera, mirrors and anchors placed on it.

    Parameters
    ----------
    name : str
        Of the rig.
    file : Path
        A new file in an existing folder.
    hull : Path
        The hull's file, in a format of `cad.read_hull_file`.
    preset : str, optional
        Where camera, port, joints, servos and water come from; by default a plain set of them.
    unit : str, optional
        What the numbers in the hull's file mean: mm, cm, m or inch.
    forward, up : str, optional
        Axes of the hull's file, such as ``+x``.
    keep : str
        Which of several bodies that do not touch make the hull's solid: ``all``, all ``joined``, or the ``largest``.
    camera_mm : tuple of three floats, optional
        Where the camera's pinhole is, body frame; found at the nose by default.
    camera_from : str, optional
        Name of a camera of the hull's file (a link of a URDF, a sensor of an SDF) that says where the pinhole is, and
        where it looks unless that is given.
    look_deg : tuple of two floats, optional
        Where the camera looks: yaw to the left and pitch up, degrees; as the preset's by default.
    log : callable
        Takes lines of progress.
    found : callable, optional
        Takes what was found in the file, before a mount is looked for.

    Returns
    -------
    TakenHull
        What was found in the file.
    Placement
        What was decided, and why.

    Raises
    ------
    ValueError
        When the hull's file cannot be used, what is given does not go with it, or no mount fits; nothing is written
        then.
    FileExistsError, FileNotFoundError
        When there is such a rig already, no such folder, hull or preset.
    """
    check_new_file(file)
    _check_options(hull, unit=unit, forward=forward, up=up, keep=keep, cameras=(camera_mm, camera_from))
    document = template(name, preset)
    taken = take(hull, unit=unit, forward=forward, up=up, log=log)
    found(taken)
    section = taken.section().model_copy(update={"keep": keep})
    put_hull_file(document, section, folder=file.parent)
    if camera_from is not None:
        camera = _camera_of(taken, camera_from)
        camera_mm = taken.pinhole_mm(camera)
        if look_deg is None:
            _put_view(document, taken.view_deg(camera), f"of {camera_from}")
    if camera_mm is not None:
        position = tomlkit.item(list(camera_mm))
        # Whatever mark the template has here: this place is the user's.
        position.comment("as given" if camera_from is None else f"of {camera_from} in {hull.name}")
        document["camera"]["position_mm"] = position
    if look_deg is not None:
        _put_view(document, look_deg, "as given")
    # What is wrong with the rig is said before minutes go by on its hull.
    Rig.parse(tomlkit.dumps(document), source=f"rig {name!r}", folder=file.parent)
    log("hull: making a solid of it ...")
    solid = closed_surface(file_hull_solid(section))
    document["hull"]["window"] = "cut"
    document["hull"]["window"].comment("the skin in the camera's light; clear would keep a pane there")
    put_vehicle(document, solid, taken.found)
    pinned = frozenset() if camera_mm is None else frozenset({CAMERA})
    try:
        placement = place_document(document, file.parent, solid, pinned=pinned, log=log)
    except ValueError as error:
        raise ValueError(f"{error}{_missing_skin(taken)}") from None
    save_new_rig(document, file)
    return taken, placement


def _missing_skin(taken: TakenHull) -> str:
    """What to do about a surface with large holes, as of a scan; empty for others."""
    found = openings(taken.found)
    if found.open_length < LARGE_HOLES * taken.found.size.max():
        return ""
    holes = openings_text(found, taken.unit_mm)
    return (
        f"; no flange stands where skin is missing ({holes}): fill the holes, or take a mesh of the robot that has none"
    )


def _put_view(document: tomlkit.TOMLDocument, angles_deg: tuple[float, ...], source: str) -> None:
    """Write where the camera looks: yaw, pitch, and roll where there is one."""
    meanings = {"yaw_deg": "to the left", "pitch_deg": "up", "roll_deg": "clockwise, seen from behind"}
    for (key, meaning), angle in zip(meanings.items(), angles_deg, strict=False):
        if angle or key in document["camera"]:
            document["camera"][key] = angle
            document["camera"][key].comment(f"{source}: {meaning}")


def _check_options(
    hull: Path,
    *,
    unit: str | None,
    forward: str | None,
    up: str | None,
    keep: str,
    cameras: tuple[tuple[float, float, float] | None, str | None],
) -> None:
    """Refuse what cannot be meant, all of it at once and before the file is opened."""
    problems = option_problems(hull, unit=unit, forward=forward, up=up)
    if keep not in get_args(KeptBodies):
        problems.append(f"--keep {keep}: expected {', '.join(get_args(KeptBodies))}")
    if None not in cameras:
        problems.append(f"--camera-from {cameras[1]}: expected that or --camera-mm, got both")
    if problems:
        raise ValueError(f"{hull}: {'; '.join(problems)}")


def template(name: str, preset: str | None) -> tomlkit.TOMLDocument:
    """A rig to place on a hull: a preset under another name, or plain numbers for a robot of one's own."""
    if preset is not None:
        return rig_document(name, preset)
    document = load_document(PLAIN_RIG)
    document["name"] = name
    return document


def _camera_of(taken: TakenHull, name: str) -> FoundCamera:
    """A camera of the hull's file by its name."""
    cameras = {camera.name: camera for camera in taken.found.cameras}
    if name not in cameras:
        has = f"{', '.join(sorted(cameras))}; name one of them, or" if cameras else "none;"
        raise ValueError(
            f"--camera-from {name}: expected a camera of {taken.found.file.name}, which has {has} say where the "
            "pinhole is: --camera-mm X Y Z"
        )
    return cameras[name]


def take(
    hull: Path, *, unit: str | None = None, forward: str | None = None, up: str | None = None, log: Log
) -> TakenHull:
    """Read a hull's file and decide what it is taken for; raises as `new_rig_on_hull`."""
    if hull.is_file() and hull.stat().st_size > LARGE_BYTES:
        log(f"{hull.name}: reading {hull.stat().st_size / 1e6:.0f} MB")
    return take_hull(read_hull_file(hull), unit=unit, forward=forward, up=up)
