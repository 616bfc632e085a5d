"""Calibration: what a pinhole calibrated through a port turns out to be."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.options import JsonOption, RigArgument, SeedOption
from mirrorgaze.output import print_json, print_step, print_table

if TYPE_CHECKING:
    from reports.studies.calibration_in_water import Calibration, Disc

DISCS = (0.4, 0.55, 0.7, 0.85, 1.0)
"""Radii of the second table, in parts of the first one's."""

EXPLANATION = """\
Why 1.84 is not the index: on the axis a flat port lengthens the focal length by n exactly, further out by more (the
image is a pincushion). A pinhole without radial terms averages this over the image: distant points that fill a disc
evenly give the ratio 'even disc', which grows with the disc and is 1.84 at 875 px for the paper's camera. Without
radial terms and with unknown poses the ratio follows the board, not the water: try --board small. The rms of tens of
pixels says that the model does not fit. With radial terms the ratio is close to n, and more so on smaller discs.
The paper prints no distortion and no rms, and its change of cx, cy is not explained by an untilted port."""


def calibrate_study(
    rig: RigArgument,
    radius_px: Annotated[float, typer.Option(help="Use corners within this image radius, in pixels.")] = 870.0,
    noise_px: Annotated[float, typer.Option(help="Standard deviation of the corners, in pixels.")] = 0.0,
    seed: SeedOption = 0,
    board: Annotated[str, typer.Option(help="Board: large fills the image, small is moved around in it.")] = "large",
    json: JsonOption = False,
) -> None:
    """Calibrate a pinhole through the port (paper, table 1).

    A checkerboard is imaged exactly in air, distilled and salt water and calibrated with OpenCV, with and without
    radial terms.

    \b
    Example:
      mirrorgaze calibrate-study bench --radius-px 870
    """
    from mirrorgaze.loading import load_usable_rig
    from reports.studies.calibration_board import BOARDS
    from reports.studies.calibration_in_water import PAPER_TABLE_1, calibration_study, disc_study

    if board not in BOARDS:
        raise ValueError(f"expected --board to be one of {', '.join(BOARDS)}, got {board!r}")
    loaded = load_usable_rig(rig)
    chosen, radii_px = BOARDS[board], [share * radius_px for share in DISCS]
    print_step("boards in air and water ...")
    table = calibration_study(loaded, board=chosen, radius_px=radius_px, noise_px=noise_px, seed=seed)
    discs = disc_study(loaded, radii_px, board=chosen, noise_px=noise_px, seed=seed)
    if json:
        print_json(
            {
                "rig": loaded.name,
                "board": board,
                "calibrations": [asdict(calibration) for calibration in table],
                "discs": [asdict(disc) for disc in discs],
                "paper_table_1": {str(medium): numbers for medium, numbers in PAPER_TABLE_1.items()},
            }
        )
        return
    print_table(_table_1(table))
    typer.echo("")
    print_table(_ratios(discs))
    if loaded.port.shape == "flat":
        typer.echo(f"\n{EXPLANATION}")


def _table_1(table: list[Calibration]) -> list[list[str]]:
    from reports.studies.calibration_in_water import PAPER_TABLE_1, Medium

    rows = [["medium", "model", "fx", "fy", "cx", "cy", "fx/air", "rms px", "k1 k2 p1 p2 k3"]]
    in_air = PAPER_TABLE_1[Medium.AIR][0]
    for medium in Medium:
        paper = PAPER_TABLE_1[medium]
        for found in table:
            if found.medium == medium:
                numbers = (found.fx_px, found.fy_px, found.cx_px, found.cy_px)
                terms = " ".join(f"{value:.3f}" for value in found.distortion) if any(found.distortion) else "-"
                rows.append(
                    [medium, found.model, *_pixels(numbers), f"{found.ratio:.3f}", f"{found.rms_px:.2f}", terms]
                )
        rows.append([medium, "the paper", *_pixels(paper), f"{paper[0] / in_air:.3f}", "-", "-"])
    return rows


def _pixels(numbers: tuple[float, ...]) -> list[str]:
    return [f"{number:.2f}" for number in numbers]


def _ratios(discs: list[Disc]) -> list[list[Any]]:
    rows = [["fx/air in distilled water, by disc", "even disc", *(found.model for found in discs[0].calibrations)]]
    for disc in discs:
        even = "-" if disc.even_disc_ratio is None else f"{disc.even_disc_ratio:.3f}"
        ratios = [f"{found.ratio:.3f}" for found in disc.calibrations]
        rows.append([f"{disc.calibrations[0].radius_px:g} px", even, *ratios])
    return rows
