"""The hull the mount is bolted to: a rounded box with flippers, an open frame, a torpedo, or the user's own file."""

from __future__ import annotations

import numpy as np
import trimesh
from build123d import Axis, Part, Solid

from cad.hulls.files.step import is_one_solid
from cad.hulls.hull_mesh import posed, read_hull_solid, read_hull_surface
from cad.hulls.mesh_repair import welded
from cad.hulls.open_frame import open_frame
from cad.hulls.port_boss import port_boss
from cad.hulls.step_file import step_solid
from cad.hulls.torpedo import torpedo
from cad.shapes import along_z, box, cylinder, one_solid
from optics.feasibility.envelope import body_width_mm
from optics.layout import Layout
from rigs import BoxHull, FileHull, Hull, Mount, Port, TorpedoHull

STEP_TOLERANCE_MM = 0.2
"""As for every hull that is rendered."""
FLIPPER_SPACING = 0.35
FLIPPER_CHORD_MM = (50.0, 72.0)
FLIPPER_THICKNESS_MM = 6.0
FLIPPER_SWEEP_MM = 18.0
HIP_RADIUS_MM = 16.0
HIP_LENGTH_MM = 14.0


def hull_shape(hull: Hull, mount: Mount, port: Port, layout: Layout) -> Solid | trimesh.Trimesh:
    """Hull in the body frame, millimetres; a triangle mesh when it comes from an STL file.

    The user's own hull is taken as it is; the others get a boss around the camera's port.

    Raises
    ------
    ValueError
        When it is not one solid.
    """
    if isinstance(hull, FileHull):
        return file_hull_solid(hull)
    boss = port_boss(port, layout)
    if isinstance(hull, BoxHull):
        shape = _box_with_flippers(hull)
    elif isinstance(hull, TorpedoHull):
        shape = torpedo(hull)
    else:
        pinhole = 1000 * layout.body_from_camera.translation
        shape = open_frame(hull, mount, port, (float(pinhole[0]), float(pinhole[1]), float(pinhole[2])))
    return one_solid(shape if boss is None else shape + boss, "hull", "look at hull and camera.position_mm")


def _box_with_flippers(hull: BoxHull) -> Part:
    body_width = body_width_mm(hull)
    length, width, height = hull.length_mm / 2, body_width / 2, hull.height_mm / 2
    radius = hull.edge_radius_mm
    if radius >= width:
        raise ValueError(f"hull.edge_radius_mm = {radius:g}: expected less than {width:g}, half the body's width")
    shape = box((-length, length), (-width, width), (-height, height))
    if radius > 0:
        shape = shape.fillet(radius, shape.edges())
    for x in _flipper_positions(hull):
        for side in (-1, 1):
            shape += _flipper(x, side, width, hull.width_mm / 2)
    return shape


def _flipper_positions(hull: BoxHull) -> list[float]:
    reach = FLIPPER_SPACING * hull.length_mm
    if hull.flippers_per_side == 1:
        return [0.0]
    return [float(x) for x in np.linspace(-reach, reach, hull.flippers_per_side)]


def _flipper(x: float, side: int, inner: float, outer: float) -> Part:
    """Paddle on the left (side = 1) or right (side = -1), swept back a little, on a round hip."""
    near, far = FLIPPER_CHORD_MM[0] / 2, FLIPPER_CHORD_MM[1] / 2
    half = FLIPPER_THICKNESS_MM / 2
    outline = [
        (x - near, side * (inner + 6)),
        (x + near, side * (inner + 6)),
        (x + far - FLIPPER_SWEEP_MM, side * outer),
        (x - far - FLIPPER_SWEEP_MM, side * outer),
    ]
    paddle = along_z(outline, (-half, half))
    tip = paddle.edges().filter_by(Axis.Z).sort_by(lambda edge: abs(edge.center().Y))[-2:]
    paddle = paddle.fillet(10, tip)
    return paddle + cylinder((x, side * (inner - 5), 0), (x, side * (inner + HIP_LENGTH_MM), 0), HIP_RADIUS_MM)


def file_hull_surface(hull: FileHull) -> trimesh.Trimesh:
    """What rays hit of the user's hull: its triangles as they are, open or closed, in the body frame, millimetres.

    `hull.unit` says what the numbers of a mesh mean where its format does not.

    Raises
    ------
    ValueError
        When the file cannot be used; the message names it and says what is wrong.
    """
    if is_one_solid(hull.file):
        return closed_surface(step_solid(hull))
    return posed(hull, read_hull_surface(hull).surface)


def file_hull_solid(hull: FileHull) -> Solid | trimesh.Trimesh:
    """User's hull as a solid in the body frame, millimetres; closed triangles unless a STEP file holds one solid.

    Raises
    ------
    ValueError
        When the file makes no solid; the message names it and says what is wrong.
    """
    if is_one_solid(hull.file):
        return step_solid(hull)
    return posed(hull, read_hull_solid(hull).surface)


def closed_surface(solid: Solid | trimesh.Trimesh) -> trimesh.Trimesh:
    """Triangles of a hull's solid, millimetres."""
    if isinstance(solid, trimesh.Trimesh):
        return solid
    points, corners = solid.tessellate(STEP_TOLERANCE_MM)
    # Along seams and at the poles of round faces corners come twice, and with them triangles without area.
    vertices = np.array([tuple(point) for point in points])
    return trimesh.Trimesh(*welded(vertices, np.array(corners, dtype=np.int64)), process=False)
