"""Rig files, damaged as documents or as text; an accepted one is checked, and a few pixels are followed through it."""

from __future__ import annotations

import random
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.attack.mutations import damaged_bytes, damaged_document, toml_text
from benchmarks.attack.verdicts import LostError, RefusedError

NAME = "rigs"
GOAL = 100_000

AS_TEXT = 0.2
"""Share of the cases that damage text; the rest damages documents."""

HULLS_LOOKED_AT = 0.02
"""Share of the accepted rigs with hulls from files whose hull is looked at, which takes a second."""

PIXEL_PX = 1e-6
"""Promised of a pixel that is traced and projected again."""

DISTANCE_M = 2.0


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: the presets, with the files that they name, and loaded libraries."""
    from optics import OpticalTrain
    from rigs import Rig
    from rigs.files import PRESETS

    for file in PRESETS.iterdir():
        shutil.copy(file, folder / file.name)
    presets = sorted(folder.glob("*.toml"))
    documents = [tomllib.loads(preset.read_text(encoding="utf-8")) for preset in presets]
    for preset in presets:
        rig = Rig.load(preset)
        OpticalTrain.from_rig(rig).trace(_pixels(rig))
        check(rig, hull=True)

    def case(rng: random.Random) -> None:
        number = rng.randrange(len(presets))
        text = damaged_text(presets[number], documents[number], rng)
        rig = Rig.parse(text, source="attacked.toml", folder=folder)
        check(rig, hull=rng.random() < HULLS_LOOKED_AT)
        follow_pixels(rig)

    return case


def damaged_text(file: Path, document: dict[str, Any], rng: random.Random) -> str:
    """Text of a damaged file; `ValueError` where it is no text any more."""
    if rng.random() < AS_TEXT:
        return damaged_bytes(file.read_bytes(), rng).decode()
    return toml_text(damaged_document(document, rng))


def check(rig: Any, *, hull: bool) -> None:
    """What `mirrorgaze check` does."""
    from cad.checks.rig_problems import rig_problems
    from optics.feasibility.feasibility import feasibility_problems
    from scenes.light.rig_spectra import spectrum_problems

    problems = rig_problems(rig) if rig.file_hull is None or hull else feasibility_problems(rig)
    problems += spectrum_problems(rig)
    if problems:
        raise RefusedError("\n".join(map(str, problems)))


def follow_pixels(rig: Any) -> None:
    """Trace pixels and project them again: what says that it is good is a number, and the same pixel."""
    from optics import OpticalTrain

    train = OpticalTrain.from_rig(rig)
    pixels = _pixels(rig)
    rays = train.trace(pixels)
    good = np.asarray(rays.status) == 0
    numbers = np.hstack([rays.origin_m, rays.direction])[good]
    if not np.isfinite(numbers).all():
        raise LostError(f"a ray that is not a number and says that it is good: {numbers.tolist()}")
    if not good.any():
        return
    image = train.project(rays.origin_m[good] + DISTANCE_M * rays.direction[good])
    back = np.asarray(image.status) == 0
    off_px = np.abs(image.pixels - pixels[good])[back]
    if not (off_px <= PIXEL_PX * max(1.0, rig.camera.width_px / 1000)).all():
        raise LostError(f"pixels {pixels[good].tolist()} come back as {image.pixels.tolist()}")


def _pixels(rig: Any) -> Any:
    width, height = rig.camera.width_px, rig.camera.height_px
    return np.array([[0.5, 0.5], [0.3, 0.6], [0.9, 0.1]]) * [width - 1, height - 1]
