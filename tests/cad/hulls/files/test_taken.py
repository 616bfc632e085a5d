"""What a file is taken for: unit, forward and up, where it lies, and the reasons."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from cad.hulls.files.axes import AXES, HullAxes, axis_vector, choose_axes
from cad.hulls.files.found import FoundCamera, Piece, found_hull
from cad.hulls.files.openings import surface_openings
from cad.hulls.files.taken import sizes_text, take_hull, turn_deg, view_text
from cad.hulls.files.triangles import read_hull_file
from cad.hulls.hull_mesh import body_from_file
from optics.layout import camera_pose
from rigs import Rig

PAIRS = [(forward, up) for forward, up in product(AXES, AXES) if forward[1] != up[1]]


def torpedo() -> trimesh.Trimesh:
    """Nose at +x, tail drawn out to a point at -x, a fin on top of the tail; about 1.5 long."""
    profile = [(0, -0.75), (0.05, -0.5), (0.1, -0.2), (0.1, 0.7), (0.06, 0.74), (0, 0.75)]
    body = trimesh.creation.revolve(np.array(profile)).apply_transform(
        trimesh.geometry.align_vectors([0, 0, 1], [1, 0, 0])
    )
    fin = trimesh.creation.box(extents=(0.15, 0.01, 0.2))
    return trimesh.util.concatenate([body, fin.apply_translation((-0.5, 0, 0.15))])


def found(mesh: trimesh.Trimesh, file, **says):
    return found_hull(file, [Piece(name="", vertices=mesh.vertices, faces=mesh.faces)], **says)


def turned(mesh: trimesh.Trimesh, forward: str, up: str) -> trimesh.Trimesh:
    """The mesh in a file whose axes `forward` and `up` are its x and z."""
    turn = np.eye(4)
    turn[:3, :3] = np.column_stack(
        [axis_vector(forward), np.cross(axis_vector(up), axis_vector(forward)), axis_vector(up)]
    )
    return mesh.copy().apply_transform(turn)


@pytest.mark.parametrize(("forward", "up"), PAIRS)
def test_every_turn_of_axes_has_angles(tmp_path, forward, up):
    """The rig's angles turn the file's forward to x and its up to z, by the pose that the rig applies."""
    hull = take_hull(found(torpedo(), tmp_path / "a.stl"), forward=forward, up=up)
    pose = body_from_file(hull.section()).rotation
    assert pose.apply(axis_vector(forward)) == pytest.approx((1, 0, 0), abs=1e-12)
    assert pose.apply(axis_vector(up)) == pytest.approx((0, 0, 1), abs=1e-12)
    middle = pose.apply(1000 * hull.found.box.mean(axis=0)) + np.array(hull.position_mm)
    assert middle == pytest.approx((0, 0, 0), abs=1e-3)


def test_angles_are_of_axes_only():
    with pytest.raises(ValueError, match="expected a rotation that takes axes to axes"):
        turn_deg(Rotation.from_euler("z", 10, degrees=True).as_matrix())


@pytest.mark.parametrize(("forward", "up"), [pair for pair in PAIRS if pair[1][0] == "+"])
def test_length_nose_and_up_are_found_in_the_shape(tmp_path, forward, up):
    axes = choose_axes(found(turned(torpedo(), forward, up), tmp_path / "a.stl"))
    assert (axes.forward, axes.up) == (forward, up)
    assert axes.forward_because == f"{forward[1]} is the longest side; that end is the fuller one"
    assert axes.up_because.startswith("left and right are mirror images along ")


def test_without_a_difference_x_is_forward_and_z_up(tmp_path):
    axes = choose_axes(found(trimesh.creation.box(extents=(1, 1, 1)), tmp_path / "a.stl"))
    assert (axes.forward, axes.up) == ("+x", "+z")
    assert axes.forward_because.endswith("both ends are alike, --forward -x turns it")
    assert axes.up_because == "the shape does not say, z by default"


def test_what_the_file_says_counts_unless_it_would_stand_on_end(tmp_path):
    mesh = turned(torpedo(), "+z", "+y")
    said = choose_axes(found(mesh, tmp_path / "a.glb", up="+y"))
    assert (said.forward, said.up, said.up_because) == ("+z", "+y", "the file says so")
    wrong = choose_axes(found(turned(torpedo(), "+y", "+z"), tmp_path / "a.dae", up="+y"))
    assert (wrong.forward, wrong.up) == ("+y", "+z")
    assert wrong.up_because.startswith("the file says +y, but its longest side would stand on end; ")


def test_what_the_shape_says_against_the_file_is_said(tmp_path):
    """A z-up mesh in a format of y up, as most programs write it; a robot whose length is along y."""
    unturned = choose_axes(found(torpedo(), tmp_path / "a.glb", up="+y"))
    assert unturned.up == "+y"
    assert unturned.up_because.endswith("images along y: --up +z if the file was not turned for it")
    says = {"up": "+z", "forward": "+x", "has_frame": True}
    across = choose_axes(found(turned(torpedo(), "+y", "+z"), tmp_path / "a.sdf", **says))
    assert across.forward == "+x"
    assert across.forward_because.endswith("but y is the longest side: --forward +y or -y if that is the length")


@pytest.mark.parametrize("angles", [(0, 0, 0), (30, -20, 0), (-170, 60, 45), (0, -90, 0), (0, 90, 180), (90, 0, -135)])
def test_a_camera_of_a_robot_has_the_angles_of_the_rig(tmp_path, angles):
    """Its line of sight and what is up in its image, as the rig's layout turns them."""
    keys = dict(zip(("yaw_deg", "pitch_deg", "roll_deg"), map(float, angles), strict=True))
    turn = camera_pose(Rig.load("aqua2").camera.model_copy(update=keys)).rotation
    file_from_body = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    look, top = (file_from_body @ turn.apply(axis) for axis in ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
    eye = FoundCamera(name="eye", position_mm=file_from_body @ (300.0, 20.0, -5.0), look=look, top=top)
    robot = found(turned(torpedo(), "+y", "+z"), tmp_path / "a.sdf", unit_mm=1000.0, has_frame=True, cameras=(eye,))
    taken = take_hull(robot, forward="+y", up="+z")
    assert taken.view_deg(eye) == pytest.approx(angles, abs=0.05)
    assert taken.pinhole_mm(eye) == pytest.approx((300, 20, -5))
    assert f"camera eye at 300, 20, -5 mm, {view_text(tuple(map(float, angles)))}" in taken.describe()


def test_a_large_number_is_written_out(tmp_path):
    assert sizes_text(found(trimesh.creation.box(extents=(1234.5, 30, 30)), tmp_path / "a.stl")).startswith(
        "longest side 1234: 1.234 m with mm"
    )


def test_what_the_user_says_counts_first(tmp_path):
    robot = found(torpedo(), tmp_path / "a.urdf", up="+z", forward="+x", has_frame=True, unit_mm=1000.0)
    assert choose_axes(robot).forward_because == "by the convention of the format (REP 103)"
    backward = found(turned(torpedo(), "-x", "+z"), tmp_path / "a.urdf", up="+z", forward="+x", has_frame=True)
    assert choose_axes(backward).forward_because.endswith("(REP 103); the fuller end is -x")
    axes = choose_axes(robot, forward="-y")
    assert axes == HullAxes(forward="-y", up="+z", forward_because="as given", up_because=choose_axes(robot).up_because)
    assert choose_axes(robot, up="+x").forward[1] != "x"
    with pytest.raises(ValueError, match=r"a\.urdf: --forward \+x and --up -x: expected two different axes"):
        take_hull(robot, forward="+x", up="-x")
    with pytest.raises(ValueError, match=r"--unit mm: expected none; .*; --forward ahead: expected \+x, -x, "):
        take_hull(robot, unit="mm", forward="ahead")


@pytest.mark.parametrize(
    ("longest", "unit"), [(0.457, "m"), (12.0, None), (30.0, None), (450.0, "mm"), (380.0, None), (15_000.0, "mm")]
)
def test_a_unit_is_taken_when_the_size_leaves_no_doubt(tmp_path, longest, unit):
    """12 may be metres or inches, 30 inches or centimetres, 380 millimetres or centimetres."""
    mesh = found(trimesh.creation.box(extents=(longest, longest / 3, longest / 4)), tmp_path / "a.stl")
    if unit is not None:
        assert take_hull(mesh).unit == unit
        return
    with pytest.raises(ValueError, match=rf"a\.stl: expected --unit .* and its longest side {longest:.3g} would be "):
        take_hull(mesh)
    assert take_hull(mesh, unit="cm").size_mm[0] == pytest.approx(10 * longest)


def test_a_unit_that_makes_no_vehicle_is_refused(tmp_path):
    box = trimesh.creation.box(extents=(1.0, 0.3, 0.3))
    with pytest.raises(ValueError, match=r'got one of 1 mm with unit = "mm"; unit = "m" would make it 1 m'):
        take_hull(found(box, tmp_path / "a.stl"), unit="mm")
    with pytest.raises(ValueError, match=r"1 mm in the file's own unit; if that is wrong, say --unit m: 1 m with m"):
        take_hull(found(box, tmp_path / "a.dae", unit_mm=1.0))
    with pytest.raises(ValueError, match=r"expected mm, cm, m, inch"):
        take_hull(found(box, tmp_path / "a.stl"), unit="ft")
    with pytest.raises(ValueError, match=r"--unit mm: expected none; a \.step file says"):
        take_hull(found(box, tmp_path / "a.step", unit_mm=1000.0), unit="mm")
    with pytest.raises(ValueError, match=r"expected a vehicle of 100 mm to 20 m, got longest side 1e\+07"):
        take_hull(found(box.apply_scale(1e7), tmp_path / "a.stl"))


def test_triangles_on_a_line_are_no_hull(tmp_path):
    line = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], process=False)
    with pytest.raises(ValueError, match=r"a\.stl: expected a surface, got triangles on a line"):
        take_hull(found(line, tmp_path / "a.stl"))


def test_a_robots_base_link_stays_the_bodys_origin(tmp_path):
    robot = found(torpedo().apply_translation((3, 0, 0)), tmp_path / "a.urdf", has_frame=True, unit_mm=1000.0, up="+z")
    section = take_hull(robot).section()
    assert (section.position_mm, section.unit) == ((0, 0, 0), None)


def test_openings_of_a_box_without_lid_and_a_wall_through_it():
    """The rim of the lid is 2 (6 + 2) long; the inner wall has four edges, and each is one more on two triangles."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 2) for x in (0, 6)]
    quads = [(0, 2, 3, 1), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
    faces = np.array([triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))])
    box = surface_openings(np.array(corners, dtype=float), faces)
    assert (box.pieces, box.holes, box.open_length, box.crowded_edges, box.closed) == (
        1,
        1,
        pytest.approx(16),
        0,
        False,
    )
    wall = np.vstack([faces, [(0, 3, 7), (0, 7, 4)]])
    crowded = surface_openings(np.array(corners, dtype=float), wall)
    # The diagonal of the floor, and the two uprights; the wall's own diagonal has two, its top joins the rim.
    assert crowded.crowded_edges == 3
    assert surface_openings(*_two_boxes()).pieces == 2


def _two_boxes():
    mesh = trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box().apply_translation((3, 0, 0))])
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_what_is_found_and_taken_is_said_in_lines(write):
    lines = take_hull(read_hull_file(write("glider.stl", torpedo()))).describe().splitlines()
    assert lines[0].startswith("glider.stl: 1 body, ")
    assert "m, the only one that makes it a vehicle; longest side 1.5: 1.5 mm with mm, 15 mm with cm, " in lines[1]
    assert [line.split(":")[0].strip() for line in lines[1:4]] == ["unit", "forward is +x", "up is +z"]
    assert "2 pieces, closed" in lines[5]
