"""Images of boards: which files they are, what is found in them, and which belong together."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.port_calibration.boards import Board, GrayImage
from tracking.port_calibration.observations import FEWEST_POINTS, MEDIA, BoardObservations

ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm")

READ_AS = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
"""As the sensor had it: a camera's model knows nothing of how the image was turned for a viewer."""


@dataclass(frozen=True, kw_only=True)
class Detection:
    """One image's board; `board_m` is empty where it was not found."""

    path: Path
    size_px: tuple[int, int]
    board_m: FloatArray
    pixels: FloatArray


@dataclass(frozen=True, kw_only=True)
class FoundBoards:
    """What was found in all images, and the images without a board, which were left out."""

    observations: BoardObservations
    without_board: tuple[Path, ...]


def image_files(place: str) -> list[Path]:
    """Images of a folder, of a pattern such as `left/*.png`, or one file; a `ValueError` when there are none."""
    path = Path(place)
    if path.is_dir():
        files = [each for each in path.iterdir() if each.suffix.lower() in ENDINGS]
    elif path.is_file():
        files = [path]
    else:
        start = Path(path.anchor) if path.is_absolute() else Path()
        files = list(start.glob(str(path.relative_to(path.anchor)))) if any(sign in place for sign in "*?[") else []
    if not files:
        raise ValueError(
            f"{place}: expected a folder with images, an image, or a pattern such as 'left/*.png', got none"
        )
    return sorted(files)


def find_boards(
    board: Board,
    files: Mapping[tuple[str, str], Sequence[Path]],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> FoundBoards:
    """Find a board in images of cameras and media.

    Parameters
    ----------
    board : Board
    files : mapping of (camera, medium) to sequence of Path
        Images of several cameras belong together that have one name, or one number at its end, or, where neither
        occurs twice, one place in the sequence.
    progress : callable
        Called with how many images are done, and how many there are.

    Raises
    ------
    ValueError
        With everything that is wrong, one problem a line.
    """
    total, done = sum(map(len, files.values())), 0
    problems: list[str] = []
    found: dict[tuple[str, str], list[Detection]] = {}
    for key, paths in files.items():
        found[key] = []
        for path in paths:
            detection = _detected(board, path, problems)
            found[key] += [detection] if detection is not None else []
            done += 1
            progress(done, total)
    problems += _problems(board, found)
    if problems:
        raise ValueError("\n".join(problems))
    missed = [each.path for group in found.values() for each in group if not len(each.board_m)]
    return FoundBoards(observations=_observations(found), without_board=tuple(missed))


def _detected(board: Board, path: Path, problems: list[str]) -> Detection | None:
    image = _read(path)
    if image is None:
        problems.append(f"{path}: expected an image, got something that cannot be read as one")
        return None
    board_m, pixels = board.found_in(image)
    if len(board_m) < FEWEST_POINTS:
        board_m, pixels = np.empty((0, 2)), np.empty((0, 2))
    height, width = image.shape
    return Detection(path=path, size_px=(width, height), board_m=board_m, pixels=pixels)


def _read(path: Path) -> GrayImage | None:
    content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    image = cv2.imdecode(content, READ_AS) if len(content) else None
    return None if image is None else np.asarray(image, dtype=np.uint8)


def _problems(board: Board, found: Mapping[tuple[str, str], Sequence[Detection]]) -> list[str]:
    problems = []
    for camera in dict.fromkeys(camera for camera, _ in found):
        own = [each for (name, _), group in found.items() if name == camera for each in group]
        sizes = {size: [each for each in own if each.size_px == size] for size in dict.fromkeys(e.size_px for e in own)}
        if len(sizes) > 1:
            told = ", ".join(
                f"{w} x {h} ({len(group)}, such as {group[0].path.name})" for (w, h), group in sizes.items()
            )
            problems.append(f"camera {camera}: expected images of one size, got {told}; calibrate each size on its own")
        if own and not any(len(each.board_m) for each in own):
            problems.append(
                f"camera {camera}: found the board in none of {len(own)} images{_reason(board, own[0].path)}"
            )
    return problems


def _reason(board: Board, path: Path) -> str:
    """Why a board may not be found."""
    image = _read(path)
    if board.coded and image is not None and len(board.found_in(np.ascontiguousarray(image[:, ::-1]))[0]):
        return "; it is there in their mirror images: the images were flipped, flip them back"
    return "; check the kind of board and its columns and rows, which are those of inner corners for a chessboard"


def _observations(found: Mapping[tuple[str, str], Sequence[Detection]]) -> BoardObservations:
    cameras = tuple(dict.fromkeys(camera for camera, _ in found))
    moments = {medium: _moments({c: g for (c, m), g in found.items() if m == medium}) for medium in MEDIA}
    rows: list[tuple[int, str, int, Detection]] = []
    for (camera, medium), group in found.items():
        named = zip(group, moments[medium][camera], strict=True)
        rows += [(cameras.index(camera), f"{medium}/{name}", MEDIA.index(medium), each) for each, name in named]
    rows = [row for row in rows if len(row[3].board_m)]
    images = tuple(dict.fromkeys(row[1] for row in rows))
    counts = [len(row[3].board_m) for row in rows]
    columns = [[row[0] for row in rows], [images.index(row[1]) for row in rows], [row[2] for row in rows]]
    camera_of, image_of, medium_of = (np.repeat(np.array(column, dtype=np.intp), counts) for column in columns)
    sizes = [
        next(e.size_px for (name, _), group in found.items() if name == camera for e in group) for camera in cameras
    ]
    return BoardObservations(
        cameras=cameras,
        sizes_px=tuple(sizes),
        images=images,
        camera=camera_of,
        image=image_of,
        medium=medium_of,
        board_m=np.concatenate([row[3].board_m for row in rows]),
        pixels=np.concatenate([row[3].pixels for row in rows]),
    )


def _moments(groups: Mapping[str, Sequence[Detection]]) -> dict[str, list[str]]:
    """Name of the moment of each image: its own, the number at its end, or its place, what cameras share first."""
    ways: list[Callable[[int, Path], str]] = [
        lambda _, path: path.stem,
        lambda index, path: (re.findall(r"\d+", path.stem) or [f"{path.stem}"])[-1],
        lambda index, _: f"{index + 1:04d}",
    ]
    named: dict[str, list[str]] = {}
    for way in ways:
        named = {camera: [way(i, e.path) for i, e in enumerate(group)] for camera, group in groups.items()}
        once = all(len(set(names)) == len(names) for names in named.values())
        first, *others = (set(names) for names in named.values()) if named else [set()]
        if once and all(first & other for other in others):
            break
    return named
