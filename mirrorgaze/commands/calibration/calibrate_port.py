"""Calibration of any camera behind a flat or dome port, without mirrors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_note, print_progress, print_step, print_table

if TYPE_CHECKING:
    from tracking.port_calibration.boards import Board
    from tracking.port_calibration.observations import BoardObservations


@dataclass(frozen=True, kw_only=True)
class ImageOptions:
    """Which images there are, and in which medium."""

    water_images: Annotated[
        list[str],
        typer.Option(metavar="[NAME=]IMAGES", help="Images in water: folder or pattern; once for each camera."),
    ] = ()  # type: ignore[assignment]
    air: Annotated[list[str], typer.Option(metavar="[NAME=]IMAGES", help="Images in air through the port.")] = ()  # type: ignore[assignment]
    bare: Annotated[list[str], typer.Option(metavar="[NAME=]IMAGES", help="Images in air without the port.")] = ()  # type: ignore[assignment]


@dataclass(frozen=True, kw_only=True)
class BoardOptions:
    """The board in the images."""

    board: Annotated[str, typer.Option(help="Board: chessboard, charuco or aprilgrid.")] = "chessboard"
    columns: Annotated[
        int, typer.Option(metavar="N", help="Inner corners of a chessboard, squares of a ChArUco board, or tags.")
    ] = 0
    rows: Annotated[int, typer.Option(metavar="N", help="The same downwards.")] = 0
    square_mm: Annotated[float, typer.Option(help="Side of a square, or of a tag, in millimetres.")] = 0.0
    marker_mm: Annotated[float, typer.Option(help="Side of a ChArUco marker, in millimetres.")] = 0.0
    dictionary: Annotated[str, typer.Option(help="ArUco dictionary of a ChArUco board.")] = "DICT_5X5_100"
    spacing: Annotated[float, typer.Option(help="Gap between AprilGrid tags, in parts of a tag.")] = 0.3
    target: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Kalibr's target file, instead of the board's options.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class PortOptions:
    """The port as it is known."""

    port: Annotated[str, typer.Option(help="Port: flat, dome or none.")] = "flat"
    distance_mm: Annotated[
        float, typer.Option(help="Pinhole to a flat port's inner face, in millimetres: a first guess.")
    ] = 20.0
    radius_mm: Annotated[float, typer.Option(help="Inner radius of a dome, in millimetres.")] = 0.0
    thickness_mm: Annotated[float, typer.Option(help="Thickness of the port, in millimetres.")] = 5.0
    port_index: Annotated[float, typer.Option(help="Refractive index of the port: 1.49 acrylic, 1.52 glass.")] = 1.49
    water_index: Annotated[float, typer.Option(help="Refractive index of the water.")] = 1.333


def calibrate_port(
    images: ImageOptions,
    board: BoardOptions,
    port: PortOptions,
    corners: Annotated[
        Path | None, typer.Argument(metavar="CORNERS", help="CSV of the board's points, instead of images.")
    ] = None,
    lens: Annotated[
        str, typer.Option(help="Lens: pinhole, brown4, brown, rational or fisheye (Kannala-Brandt).")
    ] = "brown",
    intrinsics: Annotated[
        list[Path],
        typer.Option(metavar="FILE", help="Intrinsics to start from: OpenCV, ROS, Kalibr or COLMAP; in order."),
    ] = (),  # type: ignore[assignment]
    keep_intrinsics: Annotated[bool, typer.Option("--keep-intrinsics", help="Keep these intrinsics.")] = False,
    estimate: Annotated[
        list[str],
        typer.Option(metavar="NAME", help="Estimate also: n_water, n_port, port_thickness or port_radius."),
    ] = (),  # type: ignore[assignment]
    keep: Annotated[
        list[str], typer.Option(metavar="NAME", help="Keep a parameter, such as port_distance or k3.")
    ] = (),  # type: ignore[assignment]
    size_px: Annotated[
        str | None, typer.Option(metavar="W,H", help="Size of the images, where CORNERS does not say it.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write calibration files to this folder.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Calibrate any camera behind a flat or dome port.

    Finds intrinsics, the port's pose and, if asked, the water's index, with their standard deviations, from images of a
    board in water, with or without images in air; for several cameras their poses, too. Says what the images do not
    determine, and whether a plain pinhole fits as well. CORNERS has the columns image, u_px, v_px, board_x_mm,
    board_y_mm, width_px, height_px and, where needed, camera and medium (bare, air, water).

    \b
    Example:
      mirrorgaze calibrate-port --bare air/ --water-images pool/ --columns 9 --rows 6 --square-mm 25 -o out/port
    """
    from tracking.port_calibration.camera_input import read_intrinsics
    from tracking.port_calibration.camera_output import write_port_files
    from tracking.port_calibration.estimate import calibrate_port as calibrate
    from tracking.port_calibration.summary import as_dict, findings, parameter_table

    guess = _port(port)
    lenses = [each for file in intrinsics for each in read_intrinsics(file)]
    seen = _observations(corners, images, board, size_px)
    print_step("calibration ...")
    found = calibrate(
        seen,
        ports=guess,
        lens=lens,
        intrinsics=lenses or None,
        keep_intrinsics=keep_intrinsics,
        also=estimate,
        keep=keep,
    )
    files = write_port_files(found, output) if output is not None else []
    if json:
        print_json({**as_dict(found), "files": [str(file) for file in files]})
        return
    print_table(parameter_table(found))
    for line in (*findings(found), *map(str, files)):
        typer.echo(line)


def _observations(
    corners: Path | None, images: ImageOptions, board: BoardOptions, size_px: str | None
) -> BoardObservations:
    from tracking.port_calibration.corner_files import read_corners
    from tracking.port_calibration.images import find_boards, image_files

    groups = {"water": images.water_images, "air": images.air, "bare": images.bare}
    if (corners is None) == (not any(groups.values())):
        raise ValueError("expected CORNERS or images (--water-images, --air, --bare), either or")
    if corners is not None:
        return read_corners(corners, size_px=_size(size_px))
    files, problems = {}, []
    for medium, places in groups.items():
        for place in places:
            name, _, pattern = place.rpartition("=")
            try:
                files[name or "camera", medium] = image_files(pattern)
            except ValueError as error:
                problems.append(str(error))
    try:
        pattern_board = _board(board)
    except ValueError as error:
        problems.append(str(error))
    if problems:
        raise ValueError("\n".join(problems))
    print_step("boards in images ...")
    found = find_boards(pattern_board, files, partial(print_progress, "calibrate-port: image"))
    for path in found.without_board:
        print_note(f"{path}: found no board, left out")
    return found.observations


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    try:
        width, height = (int(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"expected --size-px as two whole numbers with a comma, got {text!r}") from None
    if min(width, height) < 1:
        raise ValueError(f"expected --size-px of at least 1,1, got {text!r}")
    return width, height


def _board(options: BoardOptions) -> Board:
    from tracking.port_calibration.board_files import board_of, read_target

    if options.target is not None:
        return read_target(options.target)
    return board_of(
        options.board,
        columns=options.columns,
        rows=options.rows,
        square_m=options.square_mm / 1000,
        marker_m=options.marker_mm / 1000,
        dictionary=options.dictionary,
        spacing=options.spacing,
    )


def _port(options: PortOptions) -> Any:
    from optics import DomePort, FlatPort, NoPort

    if options.port == "none":
        return NoPort()
    shared = {
        "thickness_m": options.thickness_mm / 1000,
        "n_port": options.port_index,
        "n_water": options.water_index,
    }
    if options.port == "flat":
        return FlatPort(distance_m=options.distance_mm / 1000, **shared)
    if options.port == "dome":
        if not options.radius_mm > 0:
            raise ValueError(f"expected --radius-mm > 0, the inner radius of the dome, got {options.radius_mm:g}")
        return DomePort(radius_m=options.radius_mm / 1000, **shared)
    raise ValueError(f"expected --port flat, dome or none, got {options.port!r}")
