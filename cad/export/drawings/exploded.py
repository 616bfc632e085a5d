"""Images of the assembly's steps: what is there in grey lines, what is added tinted and drawn out of its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill

import matplotlib as mpl
import numpy as np
import trimesh
from build123d import Location, Solid
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline

from cad.assembly.assembly import Assembly
from cad.checks.sequence.findings import check_steps
from cad.checks.sequence.steps import Step
from cad.export.drawings.projection import ISOMETRIC, outline
from cad.export.drawings.sheet import STYLE, pen
from cad.shapes import location_mm
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh, Role

SIZE_INCHES = (11.0, 8.0)
DOTS_PER_INCH = 120
TINT = "#ffd9a0"
MARGIN = 0.06
"""Of the image, around what is shown."""


def write_steps(assembly: Assembly, steps: Sequence[Step], folder: Path) -> list[Path]:
    """Write `steps.md` and an image of each step; raises as `check_steps` for a mount that cannot be put together."""
    check_steps(steps)
    written = []
    text = [f"# How to put {assembly.rig.name} together", ""]
    for number, step in enumerate(steps, 1):
        path = folder / f"step_{number:02d}.png"
        _draw(step, number, assembly, path)
        written.append(path)
        text += [f"{number}. {step.title}.", "", f"   ![Step {number}]({path.name})", ""]
    guide = folder / "steps.md"
    guide.write_text("\n".join(text), encoding="utf-8")
    return [guide, *written]


def _draw(step: Step, number: int, assembly: Assembly, path: Path) -> None:
    meshes = {part.name: part.mesh for part in assembly.parts}
    shifts = {name: np.zeros(3) for name in step.present}
    shifts |= {name: move.shift_m for move in step.moves for name in move.names}
    mount = [name for name in shifts if assembly.part(name).role is not Role.HULL]
    hull = [name for name in shifts if name not in mount]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=SIZE_INCHES)
        axes = figure.add_axes((0.02, 0.02, 0.96, 0.84))
        axes.set_aspect("equal")
        axes.set_axis_off()
        figure.text(0.03, 0.96, fill(f"{number}. {step.title}", 105), va="top", fontsize=12)
        added = set(step.added)
        points = {name: _on_paper(assembly, meshes[name], shifts[name]) for name in shifts}
        # Far parts first; the tint is covered by what stands nearer.
        for name in sorted(mount, key=lambda name: _depth(assembly, meshes[name], shifts[name])):
            colour = TINT if name in added else "#ffffff"
            axes.add_artist(PathPatch(_front(points[name][meshes[name].faces]), color=colour, linewidth=0.3))
        solids = [_placed(assembly, name, shifts[name]) for name in mount]
        lines = outline(solids, ISOMETRIC)
        axes.add_artist(pen(lines.visible, edgecolor="black", linewidth=0.8))
        exact = [name for name in hull if isinstance(assembly.part(name).solid, Solid)]
        if exact:
            behind = outline([_placed(assembly, name, shifts[name]) for name in exact], ISOMETRIC)
            axes.add_artist(pen(behind.visible, edgecolor="#b0b0b0", linewidth=0.6, zorder=0))
        _paths(axes, assembly, meshes, step)
        shown = np.vstack([points[name] for name in mount])
        low, high = shown.min(axis=0), shown.max(axis=0)
        room = MARGIN * (high - low).max() * np.array([1, 1])
        axes.set_xlim(low[0] - room[0], high[0] + room[0])
        axes.set_ylim(low[1] - room[1], high[1] + room[1])
        figure.savefig(path, dpi=DOTS_PER_INCH, metadata={"Software": None})


def _paths(axes: mpl.axes.Axes, assembly: Assembly, meshes: Mapping[str, PartMesh], step: Step) -> None:
    """Chain lines along which the pieces come in."""
    tracks = []
    for move in step.moves:
        for name in move.names[:1]:
            start = _on_paper(assembly, meshes[name], np.zeros(3)).mean(axis=0)
            tracks.append(np.vstack([start, start + ISOMETRIC.project(1000 * move.path_m)]))
    if tracks:
        axes.add_artist(pen(tracks, edgecolor="#b3261e", linewidth=0.7, linestyle=(0, (8, 3, 1, 3))))


def _front(triangles: FloatArray) -> Outline:
    """Of triangles, shape (m, 3, 2), those that turn counter-clockwise and so face the observer, as one path."""
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    front = triangles[first[:, 0] * second[:, 1] > first[:, 1] * second[:, 0]]
    closed = np.concatenate([front, front[:, :1]], axis=1)
    codes = [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY]
    return Outline(closed.reshape(-1, 2), np.tile(codes, len(front)))


def _placed(assembly: Assembly, name: str, shift_m: FloatArray) -> Solid:
    part = assembly.part(name)
    return Location(tuple(1000 * shift_m)) * location_mm(assembly.pose(part, 0.0, 0.0)) * part.solid


def _on_paper(assembly: Assembly, mesh: PartMesh, shift_m: FloatArray) -> FloatArray:
    pose = assembly.pose(assembly.part(mesh.name), 0.0, 0.0)
    return ISOMETRIC.project(1000 * (pose.apply(mesh.vertices_m) + shift_m))


def _depth(assembly: Assembly, mesh: PartMesh, shift_m: FloatArray) -> float:
    pose = assembly.pose(assembly.part(mesh.name), 0.0, 0.0)
    surface = trimesh.Trimesh(pose.apply(mesh.vertices_m) + shift_m, mesh.faces, process=False)
    return float(surface.center_mass @ ISOMETRIC.towards_observer)
