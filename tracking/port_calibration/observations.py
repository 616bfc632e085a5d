"""What a calibration through a port is made from: points of boards, where cameras saw them, and in which medium."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

Medium = Literal["bare", "air", "water"]
"""What an image was taken in: without the port, in air through it, in water through it."""

MEDIA: tuple[str, ...] = get_args(Medium)

FEWEST_POINTS = 6
"""Of a board in one image: 12 numbers for the 6 of its pose."""

FEWEST_IMAGES = 3
"""Of a camera whose intrinsics are to be found (Zhang, IEEE TPAMI 22, 1330, 2000)."""

FLATTEST = 1e-2
"""Points of a board are on a line when they are this much wider one way than the other."""


SMALLEST_M, LARGEST_M = 1e-3, 100.0
"""Of a board: what is outside was given in another unit."""

LARGEST_SIDE_PX = 20_000
"""Of an image, as a rig file's."""


@dataclass(frozen=True, kw_only=True)
class BoardObservations:
    """Points of boards in images; several cameras that took images of one name saw the board in one place.

    Attributes
    ----------
    cameras : tuple of str
    sizes_px : tuple of (int, int)
        Width and height of each camera's images.
    images : tuple of str
        Names of the moments; one camera has one image of each at most.
    camera, image, medium : array of int, shape (n,)
        Which of `cameras`, `images` and `MEDIA` each point belongs to.
    board_m : array, shape (n, 2) or (n, 3)
        Along the board's x and y; and along z, where the target is not flat.
    pixels : array, shape (n, 2)
        (u, v); the centre of the top-left pixel is (0, 0).
    """

    cameras: tuple[str, ...]
    sizes_px: tuple[tuple[int, int], ...]
    images: tuple[str, ...]
    camera: NDArray[np.intp]
    image: NDArray[np.intp]
    medium: NDArray[np.intp]
    board_m: FloatArray
    pixels: FloatArray

    @property
    def places_m(self) -> FloatArray:
        """Places on the board, shape (n, 3)."""
        missing = 3 - self.board_m.shape[1]
        return np.pad(self.board_m, ((0, 0), (0, missing)))

    @property
    def is_flat(self) -> bool:
        """Whether all points are in one plane, z = 0."""
        return not self.places_m[:, 2].any()

    def rows(self, chosen: NDArray[np.bool_]) -> BoardObservations:
        """Some of the points, of the same cameras; images that none is left of are dropped."""
        kept, image = np.unique(self.image[chosen], return_inverse=True)
        return BoardObservations(
            cameras=self.cameras,
            sizes_px=self.sizes_px,
            images=tuple(self.images[index] for index in kept),
            camera=self.camera[chosen],
            image=image.astype(np.intp),
            medium=self.medium[chosen],
            board_m=self.board_m[chosen],
            pixels=self.pixels[chosen],
        )

    def of_camera(self, index: int) -> BoardObservations:
        """Those of one camera alone."""
        chosen = self.rows(self.camera == index)
        return BoardObservations(
            cameras=(self.cameras[index],),
            sizes_px=(self.sizes_px[index],),
            images=chosen.images,
            camera=np.zeros_like(chosen.camera),
            image=chosen.image,
            medium=chosen.medium,
            board_m=chosen.board_m,
            pixels=chosen.pixels,
        )

    def views(self) -> Iterable[tuple[int, int, NDArray[np.bool_]]]:
        """Camera, image and points of every image file."""
        for camera, image in np.unique(np.stack([self.camera, self.image], axis=1), axis=0).tolist():
            yield camera, image, (self.camera == camera) & (self.image == image)


def observation_problems(seen: BoardObservations, *, known_intrinsics: bool = False) -> list[str]:
    """What keeps observations from being used: a sentence each, with its place."""
    problems = _number_problems(seen)
    for name, size in zip(seen.cameras, seen.sizes_px, strict=True):
        if max(size) > LARGEST_SIDE_PX:
            told = f"{size[0]} x {size[1]}"
            problems.append(f"camera {name}: expected images of at most {LARGEST_SIDE_PX} pixels a side, got {told}")
    for camera, image, chosen in seen.views():
        problems += _view_problems(f"camera {seen.cameras[camera]}, image {seen.images[image]}", seen, chosen)
    for index, name in enumerate(seen.cameras):
        problems += _camera_problems(name, seen.of_camera(index), known_intrinsics=known_intrinsics)
    return [*problems, *_mirrored_problems(seen), *_connection_problems(seen)]


def _number_problems(seen: BoardObservations) -> list[str]:
    finite = np.isfinite(seen.board_m).all(axis=1) & np.isfinite(seen.pixels).all(axis=1)
    sizes = np.array(seen.sizes_px, dtype=np.float64)[seen.camera] - 0.5
    outside = finite & ~((seen.pixels >= -0.5) & (seen.pixels <= sizes)).all(axis=1)
    problems = [f"{count} points: expected finite numbers"] if (count := int((~finite).sum())) else []
    for camera, image, chosen in seen.views():
        if (wrong := chosen & outside).any():
            width, height = seen.sizes_px[camera]
            first = seen.pixels[np.flatnonzero(wrong)[0]].tolist()
            problems.append(
                f"camera {seen.cameras[camera]}, image {seen.images[image]}: expected pixels inside the "
                f"{width} x {height} image, got {wrong.sum()} outside, such as {first}"
            )
    return problems


def _view_problems(place: str, seen: BoardObservations, chosen: NDArray[np.bool_]) -> list[str]:
    points = seen.board_m[chosen]
    if len(np.unique(seen.medium[chosen])) > 1:
        return [f"{place}: expected one medium in an image, got several"]
    if len(points) < FEWEST_POINTS:
        return [f"{place}: expected at least {FEWEST_POINTS} points of the board, got {len(points)}"]
    if len(np.unique(points, axis=0)) < len(points):
        return [f"{place}: expected each point of the board once, got one again"]
    problems = [] if _spreads(points) else [f"{place}: expected points that are not on a line"]
    if not _spreads(seen.pixels[chosen]):
        problems.append(f"{place}: expected pixels that are not on a line: the board is seen from its edge")
    extent = float(np.ptp(points, axis=0).max())
    if not SMALLEST_M < extent < LARGEST_M:
        problems.append(f"{place}: expected a board of {SMALLEST_M} to {LARGEST_M:g} m, got {extent:g} m; check units")
    return problems


def _spreads(points: FloatArray) -> bool:
    """Whether points spread two ways."""
    if not np.isfinite(points).all():
        return True  # told elsewhere
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > FLATTEST * spread[0])


def _camera_problems(name: str, seen: BoardObservations, *, known_intrinsics: bool) -> list[str]:
    fewest = 1 if known_intrinsics else FEWEST_IMAGES
    if len(seen.images) >= fewest:
        return []
    return [
        f"camera {name}: expected at least {fewest} image{'s' if fewest > 1 else ''} of the board, got "
        f"{len(seen.images)}; take more, tilted by 20 degrees and more in different ways"
        + ("" if known_intrinsics else ", or give intrinsics from a calibration in air and keep them")
    ]


def board_handedness(board_m: FloatArray, pixels: FloatArray) -> int:
    """1 where the image turns as the board does (x right, y down, seen from the front), -1 where it is mirrored.

    0 where points are on a line in the image, or in one place.
    """
    centred = np.column_stack([board_m - board_m.mean(axis=0), np.ones(len(board_m))])
    affine = np.linalg.lstsq(centred, pixels)[0][:2]
    turn = float(np.linalg.det(affine))
    return int(np.sign(turn)) if abs(turn) > FLATTEST**2 * (affine**2).sum() else 0


def _mirrored_problems(seen: BoardObservations) -> list[str]:
    """Images that turn the other way than most do: a board is seen from one side."""
    if not seen.is_flat:
        return []
    turns = [(view, board_handedness(seen.board_m[view[2]], seen.pixels[view[2]])) for view in seen.views()]
    usual = 1 if sum(turn for _, turn in turns) >= 0 else -1
    odd = [f"{seen.cameras[camera]}/{seen.images[image]}" for (camera, image, _), turn in turns if turn == -usual]
    if not odd:
        return []
    return [
        f"expected the same side of the board in all images, but {len(odd)} of {len(turns)} show it mirrored "
        f"({', '.join(odd[:5])}{', ...' if len(odd) > 5 else ''}); flip these images, or number their points from the "
        "same corner of the board"
    ]


def _connection_problems(seen: BoardObservations) -> list[str]:
    """Cameras that share no image with the others: nothing tells where they are."""
    shown = [set(seen.image[seen.camera == index].tolist()) for index in range(len(seen.cameras))]
    linked, open_ = {0}, set(range(1, len(seen.cameras)))
    while reached := {index for index in open_ if any(shown[index] & shown[other] for other in linked)}:
        linked, open_ = linked | reached, open_ - reached
    return [
        f"camera {seen.cameras[index]}: expected images that another camera took at the same moment (of the same "
        "name), got none; nothing tells where this camera is"
        for index in sorted(open_)
    ]
