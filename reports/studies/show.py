"""A rig beside its hull as picture, GLB and table: before any mount can be built, and whether or not one can."""

from __future__ import annotations

import io
import json
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

from cad.checks.standing import Standing, rig_standing
from cad.export.sketch import rig_sketch, write_sketch
from reports.figures.plotting import save_figure
from reports.figures.sketch import standing_figure
from rigs import Rig
from rigs.atomic_files import atomic_files


@dataclass(frozen=True)
class RigView:
    """A rig beside its hull; a notebook shows it as a picture.

    Attributes
    ----------
    standing : Standing
        Where its camera, mirrors and anchors are, and how far each is from the hull.
    """

    standing: Standing

    @property
    def numbers(self) -> dict[str, object]:
        """Places as plain data, and whether all are as they can be."""
        return {
            "rig": self.standing.rig.name,
            "good": not self.standing.wrong,
            "places": [asdict(place) for place in self.standing.places],
        }

    def write(self, folder: Path) -> list[Path]:
        """Write show.png, show.glb and show.json into a folder; the files in that order."""
        names = ("show.png", "show.glb", "show.json")
        with atomic_files(folder) as scratch:
            save_figure(standing_figure(self.standing), scratch / names[0])
            write_sketch(rig_sketch(self.standing), scratch / names[1])
            (scratch / names[2]).write_text(json.dumps(self.numbers, indent=2), encoding="utf-8")
        return [folder / name for name in names]

    @cached_property
    def _png(self) -> bytes:
        picture = io.BytesIO()
        standing_figure(self.standing).savefig(picture, format="png", metadata={"Software": None})
        return picture.getvalue()

    def _repr_png_(self) -> bytes:
        return self._png


def show_rig(rig: Rig) -> RigView:
    """Show a rig beside its hull: camera, view through the port, mirrors over their range, anchors, distances.

    Raises
    ------
    ValueError
        For a rig without mirrors, and for a hull that cannot be read or made.
    """
    return RigView(rig_standing(rig))
