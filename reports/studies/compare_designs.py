"""Two rigs side by side: the keys that differ, their numbers, what each sees, and images of both."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cad.assembly.meshes import rig_meshes
from cad.checks.rig_problems import rig_problems
from cad.loads.study import LoadStudy, load_study
from optics.coverage.coverage import Coverage, compute_coverage
from optics.coverage.field import pixels_per_degree
from optics.layout import Layout
from optics.mesh import PartMesh, Role
from optics.sizing.trade_off import swept_sphere_m3
from optics.train import OpticalTrain
from reports.figures.plotting import save_figure
from reports.figures.sketch import standing_figure
from reports.figures.sphere import draw_coverage, draw_coverage_of_two
from reports.pages.design_comparison import comparison_page
from reports.progress import Log
from reports.studies.show import show_rig
from rigs import Rig
from rigs.atomic_files import atomic_files

POSES = 91
"""Values of each joint at which coverage is counted, as in a design report: what lies between two is seen by both."""

MIDDLE = 31
"""Cells along each side of the image: odd, so that one is in the middle."""

UNCOMPARED = {"name", "description"}
"""Keys in which any two rigs differ."""


@dataclass(frozen=True, kw_only=True)
class KeyDifference:
    """A key of the rig file that differs: its dotted name, and both values; None where it is not there."""

    key: str
    first: Any
    second: Any


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A number of both rigs; None where a rig has none, as nothing is known of a mount that cannot be made."""

    name: str
    unit: str
    first: float | None
    second: float | None

    @property
    def change(self) -> float | None:
        """Second less first."""
        return None if self.first is None or self.second is None else self.second - self.first


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A rig with what was found of it.

    Attributes
    ----------
    rig : Rig
    problems : tuple of str
        What `mirrorgaze check` would say, and why no mount can be made; empty for a good rig.
    figures : dict of str to (float, str)
        Numbers with their units.
    coverage : Coverage or None
        None where no mount can be made.
    """

    rig: Rig
    problems: tuple[str, ...]
    figures: Mapping[str, tuple[float, str]]
    coverage: Coverage | None


@dataclass(frozen=True, kw_only=True)
class DesignComparison:
    """Two rigs side by side."""

    first: Judged
    second: Judged

    @property
    def names(self) -> tuple[str, str]:
        """Names of the rigs, told apart where they are the same."""
        first, second = self.first.rig.name, self.second.rig.name
        return (first, second) if first != second else (f"{first} (A)", f"{second} (B)")

    @property
    def keys(self) -> tuple[KeyDifference, ...]:
        """Keys that differ, in the order of the rig file."""
        values = [dict(_flat(each.rig.model_dump(mode="json"))) for each in (self.first, self.second)]
        names = dict.fromkeys([*values[0], *values[1]])
        pairs = (
            (name, values[0].get(name), values[1].get(name)) for name in names if name not in {"name", "description"}
        )
        return tuple(KeyDifference(key=name, first=a, second=b) for name, a, b in pairs if a != b)

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Numbers of both."""
        names = dict.fromkeys([*self.first.figures, *self.second.figures])
        found = []
        for name in names:
            a, b = (each.figures.get(name) for each in (self.first, self.second))
            unit = next(pair[1] for pair in (a, b) if pair is not None)
            found.append(Figure(name=name, unit=unit, first=a and a[0], second=b and b[0]))
        return tuple(found)

    @property
    def numbers(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "rigs": list(self.names),
            "problems": [list(each.problems) for each in (self.first, self.second)],
            "keys": [{"key": each.key, "first": each.first, "second": each.second} for each in self.keys],
            "figures": [
                {
                    "name": each.name,
                    "unit": each.unit,
                    "first": each.first,
                    "second": each.second,
                    "change": each.change,
                }
                for each in self.figures
            ],
        }

    def write(self, folder: Path) -> list[Path]:
        """Write compare.html with images and maps of both, the PNGs, and compare.json; whole or not at all."""
        images = []
        with atomic_files(folder) as scratch:
            for label, each in (("a", self.first), ("b", self.second)):
                images.append(f"{label}_rig.png")
                save_figure(standing_figure(show_rig(each.rig).standing), scratch / images[-1])
                if each.coverage is not None:
                    images.append(f"{label}_coverage.png")
                    draw_coverage(each.coverage, each.rig, scratch / images[-1])
            if self.first.coverage is not None and self.second.coverage is not None:
                images.append("coverage_of_both.png")
                draw_coverage_of_two(self.first.coverage, self.second.coverage, self.names, scratch / images[-1])
            (scratch / "compare.json").write_text(json.dumps(self.numbers, indent=2), encoding="utf-8")
            (scratch / "compare.html").write_text(comparison_page(self.numbers, images, scratch), encoding="utf-8")
        return [folder / name for name in ("compare.html", "compare.json", *images)]


def compare_designs(first: Rig, second: Rig, *, log: Log = lambda line: None) -> DesignComparison:
    """Judge two rigs and put them side by side.

    Parameters
    ----------
    first, second : Rig
        With mirrors; whether a mount can be made or not.
    log : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        For a rig without mirrors, or a hull that cannot be used.
    """
    for rig in (first, second):
        rig.require_gaze()
    return DesignComparison(first=_judged(first, log), second=_judged(second, log))


def _judged(rig: Rig, log: Log) -> Judged:
    log(f"{rig.name}: rig and mount ...")
    problems = [str(problem) for problem in rig_problems(rig)]
    figures = _figures_of_rig(rig)
    try:
        parts = rig_meshes(rig)
    except ValueError as error:
        problems.append(f"no mount can be made: {error}")
        return Judged(rig=rig, problems=tuple(problems), figures=figures, coverage=None)
    log(f"{rig.name}: coverage ...")
    layout = Layout.from_rig(rig)
    coverage = compute_coverage(rig, parts, q1=layout.pan.values(POSES), q2=layout.tilt.values(POSES))
    study = load_study(rig, parts)
    problems += [str(problem) for problem in study.problems]
    figures = {**_figures_of_coverage(coverage), **figures, **_figures_of_mount(parts, study)}
    return Judged(rig=rig, problems=tuple(problems), figures=figures, coverage=coverage)


def _figures_of_rig(rig: Rig) -> dict[str, tuple[float, str]]:
    gaze, train = rig.require_gaze(), OpticalTrain.bare(rig)
    plates = {"M1": gaze.fold_mirror, "M2": gaze.gaze_mirror}
    middle = pixels_per_degree(train.camera, train.port, MIDDLE, MIDDLE)[MIDDLE**2 // 2]
    return {
        "resolution in the middle of the image": (float(middle), "px/deg"),
        **{f"{name} width": (plate.width_mm, "mm") for name, plate in plates.items()},
        **{f"{name} height": (plate.height_mm, "mm") for name, plate in plates.items()},
        "sphere that M2 sweeps": (1000 * swept_sphere_m3(gaze.gaze_mirror), "l"),
    }


def _figures_of_coverage(coverage: Coverage) -> dict[str, tuple[float, str]]:
    median = float(np.median(coverage.pixels_per_degree[coverage.covered])) if coverage.covered.any() else 0.0
    return {
        "coverage of the sphere": (100 * coverage.covered_fraction, "%"),
        "coverage of the upper half": (100 * coverage.upper_fraction, "%"),
        "coverage of the lower half": (100 * coverage.lower_fraction, "%"),
        "resolution of what is seen, median": (median, "px/deg"),
        "usable field of view, mean": (1000 * coverage.mean_solid_angle_sr, "msr"),
        "usable field of view, largest": (1000 * float(coverage.solid_angle_sr.max()), "msr"),
    }


def _figures_of_mount(parts: list[PartMesh], study: LoadStudy) -> dict[str, tuple[float, str]]:
    printed = {part.name for part in parts if part.role is Role.MOUNT}
    water = study.hydrostatics
    figures = {
        "mass of the mount": (1000 * water.whole.mass_kg, "g"),
        "weight of the mount in water": (water.weight_in_water_n, "N"),
        "printed plastic": (1e6 * sum(body.volume_m3 for body in water.parts if body.name in printed), "cm3"),
    }
    if water.trim is not None:
        figures["trim, bow up"] = (float(np.degrees(water.trim.pitch_rad)), "deg")
        figures["trim, left side up"] = (float(np.degrees(water.trim.roll_rad)), "deg")
    return figures | {f"servo margin, {load.joint}": (load.margin, "times") for load in study.servos}


def _flat(document: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys of a document and their values; lists are values."""
    for key, value in document.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif value is not None:
            yield f"{prefix}{key}", value
