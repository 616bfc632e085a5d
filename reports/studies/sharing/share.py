"""The explorer of a rig: what its file holds is computed here, and written as one HTML file."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np

from cad.assembly.assembly import build_assembly
from cad.assembly.meshes import rig_meshes
from cad.export.drawings.bill_of_materials import bill_of_materials
from cad.export.drawings.manifest import HASH_DIGITS, rig_hash
from cad.export.printing.prints import prints
from optics.coverage.coverage import compute_coverage, covered_cells
from optics.coverage.sphere import cell_directions
from optics.coverage.summary import coverage_summary
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh
from optics.occlusion import Occluder
from optics.srgb import srgb_encode
from reports.pages import content
from reports.pages.explorer import ExplorerResults, JointGridView, WhoSees, explorer_page
from reports.pages.mount import bill_of_materials_tables
from reports.progress import Log, counter, today
from reports.studies.design import MapGrid
from rigs import Rig
from rigs.atomic_files import write_text
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.image import display_image
from scenes.light.materials import albedo_table, material_of
from scenes.light.spectrum import camera_bands
from scenes.renderer import FastRenderer
from scenes.stage.scene import make_scene
from scenes.stage.state import State

VIEW_WIDTH_PX = 480
VIEW_QUALITY = 80
VIEW_SAMPLES = 2


@dataclass(frozen=True, kw_only=True)
class Fineness:
    """How finely the file is divided.

    Attributes
    ----------
    views : int
        Images along each joint.
    poses : tuple of int
        Along pan and tilt, of which it says who sees a direction: steps that a view reaches over.
    nside : int
        Of the sphere's cells; 16 makes 3072 of 3.7 degrees.
    coverage : MapGrid
        Of the key numbers, as the design report has them.
    light : LightQuality
        Of the light in the images.
    """

    views: int = 9
    poses: tuple[int, int] = (32, 64)
    nside: int = 16
    coverage: MapGrid = field(default_factory=MapGrid)
    light: LightQuality = field(default_factory=LightQuality.full)


def share(rig: Rig, path: Path, *, log: Log, fineness: Fineness | None = None) -> Path:
    """Write the explorer of a rig: one HTML file that needs neither network nor Python.

    Parameters
    ----------
    rig : Rig
        With mirrors, physically possible.
    path : Path
        The file.
    log : callable
        Takes lines of progress.
    fineness : Fineness, optional

    Raises
    ------
    ValueError
        For a rig without mirrors or one whose mount cannot be built.
    """
    rig.require_gaze()
    fineness, layout = fineness or Fineness(), Layout.from_rig(rig)
    log("mount ...")
    assembly = build_assembly(rig)
    items = bill_of_materials(assembly, prints(rig, assembly.printed))
    parts = rig_meshes(rig)
    log("coverage ...")
    head = _head(rig, parts, fineness)
    who_sees = _who_sees(rig, parts, fineness)
    views = _views(rig, fineness, log)
    results = ExplorerResults(
        parts=parts,
        colours=[_colour(part) for part in parts],
        views=views,
        who_sees=who_sees,
        head=head,
        tail=[
            content.section("Bill of materials", *bill_of_materials_tables(items)),
            content.section("Rig", content.table(["", ""], rig.facts)),
            content.footer(f"Made by mirrorgaze from the rig file {rig.name}."),
        ],
    )
    write_text(path, explorer_page(f"{rig.name}: explorer", layout, results))
    return path


def _head(rig: Rig, parts: list[PartMesh], fineness: Fineness) -> list[content.Block]:
    q1, q2 = _joints(rig, fineness.coverage.poses)
    columns, rows = fineness.coverage.columns, fineness.coverage.rows
    found = coverage_summary(
        compute_coverage(rig, parts, q1=q1, q2=q2, columns=columns, rows=rows), image_cells=(columns, rows)
    )
    marks = f"Rig {rig_hash(rig)[:HASH_DIGITS]}, mirrorgaze {version('mirrorgaze')}, {today()}."
    tiles = [
        (f"{found.covered_fraction:.1%}", "of all directions seen through both mirrors"),
        (f"{found.upper_fraction:.1%} / {found.lower_fraction:.1%}", "of the upper / lower hemisphere"),
        (f"{1000 * found.usable_solid_angle_sr.largest:.0f} msr", "largest usable field of view of a pose"),
        (f"{found.pixels_per_degree.median:.1f} px/°", "best resolution of a direction in the water (median)"),
    ]
    return [content.Title(name=rig.name, lead=rig.description), content.paragraph(marks), content.tiles(tiles)]


def _who_sees(rig: Rig, parts: list[PartMesh], fineness: Fineness) -> WhoSees:
    layout, (pan, tilt) = Layout.from_rig(rig), fineness.poses
    q1, q2 = layout.pan.values(pan), layout.tilt.values(tilt)
    poses = np.stack(np.meshgrid(q1, q2), axis=-1).reshape(-1, 2)
    occluders = {group: Occluder.of_group(parts, group) for group in Group}
    seen = [covered_cells(rig, occluders, q1=[a], q2=[b], nside=fineness.nside) for a, b in poses.tolist()]
    return WhoSees(q_deg=np.degrees(poses), directions=cell_directions(fineness.nside), seen=np.array(seen))


def _views(rig: Rig, fineness: Fineness, log: Log) -> list[JointGridView]:
    log("light ...")
    scene = make_scene(rig)
    renderer = FastRenderer(prepare(scene, rig, quality=fineness.light), samples=VIEW_SAMPLES)
    q1, q2 = _joints(rig, fineness.views)

    def state(a: float, b: float) -> State:
        target = None if scene.target is None else scene.target.world_from_target
        return State(q1=a, q2=b, world_from_body=scene.world_from_body, world_from_target=target)

    count, views = counter(log, "views"), []
    for b in q2.tolist():
        for a in q1.tolist():
            image = display_image(renderer.render_states([state(a, b)])[0], scene)
            height = round(VIEW_WIDTH_PX * image.shape[0] / image.shape[1])
            small = cv2.resize(image[..., ::-1], (VIEW_WIDTH_PX, height), interpolation=cv2.INTER_AREA)
            jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, VIEW_QUALITY])[1].tobytes()
            views.append(JointGridView(q1_deg=float(np.degrees(a)), q2_deg=float(np.degrees(b)), jpeg=jpeg))
            count(len(views), fineness.views**2)
    return views


def _joints(rig: Rig, steps: int) -> tuple[FloatArray, FloatArray]:
    layout = Layout.from_rig(rig)
    return layout.pan.values(steps), layout.tilt.values(steps)


def _colour(part: PartMesh) -> tuple[int, int, int]:
    """Colour of a part's material as a screen shows it, 0 to 255."""
    linear = np.clip(camera_bands().weight @ albedo_table()[material_of(part)], 0, 1)
    red, green, blue = np.round(255 * srgb_encode(linear)).astype(int).tolist()
    return red, green, blue
