"""The fold bracket in both directions and on its hinge: one solid each, M1 in its place, clear when it swings."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold

from cad.assembly.assembly import Assembly, build_assembly
from cad.assembly.meshes import rig_meshes
from cad.assembly.print_pose import print_pose
from cad.assembly.tessellation import LINEAR_TOLERANCE_MM, tessellated
from cad.overlaps import manifold_mm
from cad.parts.bracket.bracket_placement import bracket_placement
from cad.parts.bracket.fold_bracket import fold_bracket_solid
from cad.parts.flange import bolt_places, flange_hardware, hull_side
from cad.parts.mirrors import mirror_plate
from cad.parts.stow_bracket import arm_solid, deck_solid
from cad.parts.stow_hinge import stow_hinge
from cad.shapes import box, cylinder, location_mm
from optics.gaze.stowed_view import direct_view_loss
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.train import OpticalTrain
from rigs import Rig, Servo
from rigs.mounting import StowJoint

TOUCHING_MM3 = 1e-6
"""Volume shared by solids that touch: rounding of the kernel on areas of some 1000 mm2."""
MESHED_MM3 = 1.0
"""The same for their triangles, which only approach curved faces."""


def loaded(name: str) -> Rig:
    """A preset; aqua2 with screws, its anchors half way between the flippers and the bow."""
    screwed = {
        "fold_attachment": "screws",
        "base_attachment": "screws",
        "fold_anchor_mm": (270.0, 60.0, 65.0),
        "base_anchor_mm": (270.0, 60.0, -65.0),
    }
    return Rig.load(name).with_gaze(mount=screwed if name == "aqua2" else {})


def changed(rig: Rig, **sections: dict) -> Rig:
    return rig.with_gaze(**sections)


def folding_up(rig: Rig) -> Rig:
    """The same robot, its mount turned about the camera's axis: anchors too, on a hull that is as high as low."""
    _, y, z = rig.camera.position_mm
    turned = {
        key: (point[0], 2 * y - point[1], 2 * z - point[2])
        for key in ("fold_anchor_mm", "base_anchor_mm")
        for point in [getattr(rig.gaze.mount, key)]
    }
    joints = {
        name: joint.model_copy(update={"min_deg": -joint.max_deg, "max_deg": -joint.min_deg})
        for name, joint in (("pan", rig.gaze.joints.pan), ("tilt", rig.gaze.joints.tilt))
    }
    return changed(rig, fold_mirror={"direction": "up"}, mount=turned, joints=joints)


def stowable(name: str, *, max_deg: float = 90.0, servo: bool = False, fixing: str = "glue") -> Rig:
    rig = loaded(name)
    return changed(
        rig,
        joints={"stow": StowJoint(max_deg=max_deg)},
        servos={"stow": rig.gaze.servos.pan if servo else None},
        mount={"mirror_fixing": fixing},
    )


def meshed(solid) -> PartMesh:
    surface = tessellated(solid, LINEAR_TOLERANCE_MM)
    vertices, faces = np.asarray(surface.vertices) / 1000, np.asarray(surface.faces, dtype=np.int32)
    return PartMesh(name="solid", group=Group.FIXED, role=Role.MOUNT, vertices_m=vertices, faces=faces)


@cache
def built(name: str, *, servo: bool) -> tuple[Rig, Assembly]:
    rig = stowable(name, servo=servo, fixing="screws" if servo else "glue")
    return rig, build_assembly(rig)


@pytest.fixture(scope="module", params=[("aqua2", False), ("bluerov2", True)], ids=["by hand", "by servo"])
def hinged(request: pytest.FixtureRequest) -> tuple[Rig, Assembly]:
    name, servo = request.param
    return built(name, servo=servo)


@cache
def meshes_in_use(name: str) -> dict[str, PartMesh]:
    """Triangles of a rig of `hinged`, by part, with M1 in use."""
    _, assembly = built(name, servo=name == "bluerov2")
    return {mesh.name: mesh for mesh in assembly.meshes}


def shared_mm3(first, second) -> float:
    common = first & second
    return 0.0 if common is None else sum(solid.volume for solid in common.solids())


def test_a_fold_up_has_the_same_bracket_turned_about_the_cameras_axis():
    down = loaded("aqua2")
    up = folding_up(down)
    first, second = (fold_bracket_solid(bracket_placement(rig, Layout.from_rig(rig))) for rig in (down, up))
    assert second.is_valid
    assert second.volume == pytest.approx(first.volume, rel=1e-9)
    expected = np.array(tuple(first.center())) * [1, -1, -1] + [0, 120, 0]
    np.testing.assert_allclose(tuple(second.center()), expected, rtol=0, atol=1e-6)


def test_a_fold_up_holds_its_mirror_where_the_layout_says():
    rig = folding_up(loaded("aqua2"))
    layout = Layout.from_rig(rig)
    bracket = fold_bracket_solid(bracket_placement(rig, layout))
    plate = location_mm(layout.body_from_m1) * mirror_plate(rig.gaze.fold_mirror)
    assert shared_mm3(bracket, plate) < TOUCHING_MM3
    # Pressed into its bed or against its lips, it hits the cell at once.
    for direction in (-1, 1):
        shift = 1000 * layout.body_from_m1.rotation.apply([0, 0, direction * 0.6e-3])
        assert shared_mm3(bracket, plate.translate(tuple(shift))) > 10


def test_messages_of_a_fold_up_speak_of_the_rig_files_numbers():
    rig = folding_up(loaded("aqua2"))
    low = changed(rig, mount={"fold_anchor_mm": (270.0, 60.0, 120.0), "fold_normal": (0.0, 0.0, -1.0)})
    with pytest.raises(
        ValueError, match=r"mount\.fold_anchor_mm = \(270.*such as \(270\.0, 60\.0, 93\.\d\), so that the roof"
    ):
        bracket_placement(low, Layout.from_rig(low))
    beside = changed(rig, mount={"fold_anchor_mm": (270.0, -60.0, -65.0)})
    with pytest.raises(
        ValueError, match=r"at most 109\.\d mm beside.*such as \(270\.0, -49\.\d, -65\.0\).*not 120\.0 mm"
    ):
        bracket_placement(beside, Layout.from_rig(beside))
    ahead = changed(rig, mount={"fold_anchor_mm": (440.0, 60.0, -65.0)})
    with pytest.raises(ValueError, match=r"such as \(408\.\d, 60\.0, -65\.0\).*the front of M1's cell, not 31\.\d mm"):
        bracket_placement(ahead, Layout.from_rig(ahead))


def test_an_anchor_on_a_flank_is_refused():
    rig = changed(loaded("aqua2"), mount={"fold_normal": (0.0, 0.9, 0.4)})
    with pytest.raises(ValueError, match=r"mount\.fold_anchor_mm.*within 60 degrees of up, got 66 degrees"):
        bracket_placement(rig, Layout.from_rig(rig))


@pytest.mark.parametrize(
    ("point", "normal"),
    [
        ((270.0, 110.0, 65.0), (0.0, 0.0, 1.0)),
        ((270.0, 10.0, 30.0), (0.0, -0.5, 1.0)),
        ((300.0, 60.0, 50.0), (1.5, 0.0, 1.0)),
        ((270.0, 90.0, -20.0), (0.6, 0.6, 1.0)),
        ((385.0, 60.0, 65.0), (0.0, 0.0, 1.0)),
    ],
    ids=["beside", "beside and sloping", "nose", "low and aslant", "over M1"],
)
def test_a_bracket_reaches_m1_from_many_places(point, normal):
    """One valid solid with a closed surface that has room for M1, stays out of its light and on the hull's plane."""
    rig = changed(loaded("aqua2"), mount={"fold_anchor_mm": point, "fold_normal": normal})
    layout = Layout.from_rig(rig)
    placement = bracket_placement(rig, layout)
    bracket = fold_bracket_solid(placement)
    assert bracket.is_valid
    assert manifold_mm(meshed(bracket)).volume() == pytest.approx(bracket.volume, rel=0.01)
    mirror = rig.gaze.fold_mirror
    place = location_mm(layout.body_from_m1)
    assert shared_mm3(bracket, place * mirror_plate(mirror)) < TOUCHING_MM3
    half_width, half_height = mirror.width_mm / 2 - 2, mirror.height_mm / 2 - 2
    light = place * box((-half_width, half_width), (-half_height, half_height), (0.0, 60.0))
    assert shared_mm3(bracket, light) < TOUCHING_MM3
    unit = np.array(normal) / np.linalg.norm(normal)
    under = hull_side(placement.seat)
    assert shared_mm3(bracket, under) < TOUCHING_MM3
    assert shared_mm3(bracket, under.translate(tuple(unit))) > 300


def test_girders_are_as_deep_as_flow_on_m1_asks():
    """A cantilever of two webs, h^3 = 6 F l^2 / (E t theta): with numbers of aqua2, and of a mirror twice as high."""
    rig = loaded("aqua2")
    high = changed(rig, fold_mirror={"height_mm": 180.0})
    lever = np.linalg.norm(np.array([397.0, 60.0, 0.0]) - [270.0, 60.0, 65.0]) / 1000
    depth = np.cbrt(6 * 1000 * 0.08 * 0.09 * lever**2 / (2e9 * 2.5e-3 * np.radians(1.2)))
    found = [bracket_placement(each, Layout.from_rig(each)).girder_mm for each in (rig, high)]
    np.testing.assert_allclose(found, 1000 * depth * np.cbrt([1.0, 2.0]), rtol=0.01)


def test_webs_are_six_lines_of_the_nozzle_unless_the_wall_is_less():
    for nozzle, wall, expected in ((0.4, 4.0, 2.5), (0.6, 4.0, 3.75), (0.4, 1.2, 1.2)):
        rig = changed(loaded("aqua2"), mount={"nozzle_mm": nozzle, "wall_mm": wall})
        assert bracket_placement(rig, Layout.from_rig(rig)).web_mm == pytest.approx(expected)


def test_the_bracket_prints_on_its_roof_without_support():
    """Less than a square centimetre leans out by more than 45 degrees: vents, bonding holes and rounded corners."""
    for name in ("aqua2", "bluerov2"):
        rig = loaded(name)
        mesh = next(mesh for mesh in rig_meshes(rig) if mesh.name == "fold_bracket")
        pose = print_pose(mesh, rig.gaze.mount)
        np.testing.assert_allclose(pose.bed_from_part.apply([0, 0, 1]), [0, 0, -1], atol=1e-9)
        assert pose.overhang_mm2 < 100
        assert pose.support_mm3 < 1000


def test_a_sloping_flange_is_one_solid_that_leaves_the_hull_alone():
    rig = changed(loaded("aqua2"), mount={"fold_normal": (0.2, 0.0, 1.0)})
    placement = bracket_placement(rig, Layout.from_rig(rig))
    bracket = fold_bracket_solid(placement)
    assert bracket.is_valid
    normal = np.array([0.2, 0.0, 1.0]) / np.hypot(0.2, 1.0)
    heights = [(np.array(tuple(v)) - [270.0, 60.0, 65.0]) @ normal for v in bracket.vertices() if v.X < 294]
    assert min(heights) == pytest.approx(0, abs=1e-6)


def test_parts_of_the_hinge_are_one_solid_each_and_clear_of_each_other(hinged):
    rig, assembly = hinged
    for part in assembly.parts:
        if part.printed:
            assert part.solid.is_valid, part.name
            assert len(part.solid.solids()) == 1, part.name
            assert manifold_mm(meshes_in_use(rig.name)[part.name]).volume() > 0, part.name
    swinging = {part.name for part in assembly.parts if part.stows}
    assert {"fold_arm", "fold_mirror"} < swinging
    assert "fold_bracket" not in swinging


def test_nothing_is_in_the_arms_way_from_use_to_stowed(hinged):
    """What swings against all that is fixed, every 7.5 degrees; pieces of the hinge itself turn in each other."""
    rig, assembly = hinged
    everything = meshes_in_use(rig.name).values()
    meshes = [mesh for mesh in everything if mesh.group is Group.FIXED and mesh.role is not Role.HARDWARE]
    swinging = {part.name for part in assembly.parts if part.stows}
    moved = [mesh for mesh in meshes if mesh.name in swinging]
    fixed = Manifold.compose([manifold_mm(mesh) for mesh in meshes if mesh.name not in swinging])
    for angle in np.radians(np.linspace(0, rig.gaze.joints.stow.max_deg, 13)):
        pose = assembly.stow.body_from_stowing(angle).as_matrix()[:3]
        pose[:, 3] *= 1000
        for mesh in moved:
            assert (manifold_mm(mesh).transform(pose) ^ fixed).volume() < MESHED_MM3, (mesh.name, np.degrees(angle))


def test_a_bar_stops_the_arm_in_use(hinged):
    """A degree further down and it is in the deck: that stop is what defines M1's 45 degrees."""
    rig, assembly = hinged
    deck, arm = (manifold_mm(meshes_in_use(rig.name)[name]) for name in ("fold_bracket", "fold_arm"))
    pose = assembly.stow.body_from_stowing(np.radians(-1.0)).as_matrix()[:3]
    pose[:, 3] *= 1000
    assert (arm.transform(pose) ^ deck).volume() > 20


def test_thick_rails_of_a_deck_leave_its_bolts_heads_room():
    """Walls of 11.5 mm bring the rails over the bolts, whose heads are at the roof's level."""
    rig = changed(stowable("aqua2"), mount={"wall_mm": 11.5}, fold_mirror={"width_mm": 77.4})
    hinge = stow_hinge(rig, Layout.from_rig(rig))
    deck = deck_solid(hinge)
    bolts = flange_hardware(hinge.placement.seat, "fold")
    assert len(bolts) == 4
    for bolt in bolts:
        shared = deck & (location_mm(hinge.placement.body_from_fold) * (bolt.pose * bolt.piece.shape))
        assert shared is None or shared.volume < TOUCHING_MM3


def test_stowing_turns_about_the_axis_that_it_names(hinged):
    _, assembly = hinged
    point, axis = assembly.stow.axis_in_body()
    pose = assembly.stow.body_from_stowing(0.7)
    np.testing.assert_allclose(pose.apply(point + 0.03 * axis), point + 0.03 * axis, rtol=0, atol=1e-15)
    np.testing.assert_allclose(pose.rotation.as_rotvec(), 0.7 * axis, rtol=0, atol=1e-15)


def test_the_whole_view_is_free_with_m1_stowed(hinged):
    """The paper's wish: the full camera back.

    Rationale: 320 x 240 rays of the view through the port against mount, servos and mirrors. Expectation: with the gaze
    mirror laid flat (q2 = 45 degrees) none is stopped; whatever its pose, none by what stands still; in use M1 takes
    more than a third of the view.
    """
    rig, assembly = hinged
    meshes = assembly.stowed_meshes
    assert direct_view_loss(rig, meshes, q2=np.radians(45.0)) == 0
    assert direct_view_loss(rig, [mesh for mesh in meshes if mesh.group is Group.FIXED]) == 0
    assert direct_view_loss(rig, list(meshes_in_use(rig.name).values()), q2=np.radians(45.0)) > 1 / 3


def test_what_a_small_angle_leaves_in_the_view_is_reported():
    rig = stowable("bluerov2", max_deg=45.0)
    layout = Layout.from_rig(rig)
    hinge = stow_hinge(rig, layout)
    mesh = meshes_in_use("bluerov2")["fold_arm"]
    moved = hinge.body_from_stowing(np.radians(45.0)).apply(mesh.vertices_m)
    arm = PartMesh(name="arm", group=Group.FIXED, role=Role.MOUNT, vertices_m=moved, faces=mesh.faces)
    assert 0.05 < direct_view_loss(rig, [arm]) < 0.2


def test_the_train_with_m1_stowed_is_the_camera_alone():
    rig = stowable("aqua2")
    pixels = [[0.0, 0.0], [320.0, 240.0]]
    found = OpticalTrain.from_rig(rig, stowed=True).trace(pixels)
    expected = OpticalTrain.from_rig(rig.without_mirrors()).trace(pixels)
    np.testing.assert_array_equal(found.direction, expected.direction)
    for stow in (
        lambda: OpticalTrain.from_rig(loaded("aqua2"), stowed=True),
        lambda: rig_meshes(loaded("aqua2"), stowed=True),
    ):
        with pytest.raises(ValueError, match=r"joints\.stow: expected a hinge.*'aqua2', got none"):
            stow()


def test_a_hinge_without_room_is_named():
    near = changed(stowable("aqua2"), mount={"fold_anchor_mm": (340.0, 60.0, 65.0)})
    with pytest.raises(
        ValueError, match=r"mount\.fold_anchor_mm.*such as \(321\.\d, 60\.0, 65\.0\).*hinge.*18\.\d mm too far"
    ):
        stow_hinge(near, Layout.from_rig(near))
    narrow = changed(stowable("aqua2", servo=True), fold_mirror={"width_mm": 40.0})
    with pytest.raises(ValueError, match=r"fold_mirror\.width_mm = 40: expected at least \d+, so that.*its servo fit"):
        stow_hinge(narrow, Layout.from_rig(narrow))


def test_chords_that_all_but_meet_the_pedestal_in_a_line_are_one_solid():
    """Cell and flange all but equally wide: the kernel loses all shapes when it unites them in one go."""
    mirror = {"width_mm": 41.453125, "height_mm": 40.0, "thickness_mm": 2.0, "distance_mm": 85.0}
    rig = changed(loaded("aqua2"), fold_mirror=mirror, mount={"wall_mm": 1.25})
    bracket = fold_bracket_solid(bracket_placement(rig, Layout.from_rig(rig)))
    assert manifold_mm(meshed(bracket)).volume() == pytest.approx(bracket.volume, rel=0.01)


def test_keys_come_through_the_roof_over_a_slope():
    """A round nose's flange leans forward: the pedestal is as long as the holes over its bolts' heads need."""
    rig = changed(loaded("aqua2"), mount={"fold_anchor_mm": (250.0, 60.0, 40.0), "fold_normal": (0.5, 0.0, 1.0)})
    placement = bracket_placement(rig, Layout.from_rig(rig))
    assert placement.keys_through_roof
    bracket = fold_bracket_solid(placement)
    for hole in bolt_places():
        way = location_mm(placement.seat.body_from_seat) * cylinder(
            (*hole, placement.seat.height_mm), (*hole, 120.0), 4.9
        )
        assert shared_mm3(bracket, way) < TOUCHING_MM3


@settings(max_examples=10)
@given(
    mirror=st.fixed_dictionaries(
        {
            "width_mm": st.floats(30, 140),
            "height_mm": st.floats(40, 110),
            "thickness_mm": st.floats(1.5, 6),
            "distance_mm": st.floats(85, 160),
        }
    ),
    wall=st.floats(1.2, 10),
    fixing=st.sampled_from(["glue", "screws"]),
    kind=st.sampled_from(["fixed", "hinge", "servo"]),
    servo=st.sampled_from(["hs5086wp", "hs646wp"]),
)
def test_any_bracket_is_one_solid_each_or_a_sentence_with_its_key(mirror, wall, fixing, kind, servo):
    rig = stowable("aqua2", fixing=fixing)
    rig = changed(
        rig,
        fold_mirror=mirror,
        mount={"wall_mm": wall},
        joints={} if kind != "fixed" else {"stow": None},
        servos={"stow": catalogue(servo) if kind == "servo" else None},
    )
    layout = Layout.from_rig(rig)
    try:
        hinge = stow_hinge(rig, layout)
        solids = (
            [fold_bracket_solid(bracket_placement(rig, layout))]
            if hinge is None
            else [deck_solid(hinge), arm_solid(hinge)]
        )
    except ValueError as error:
        assert str(error).startswith(("mount.", "fold_mirror.")), error
        return
    for solid in solids:
        assert solid.is_valid
        assert len(solid.solids()) == 1
    if len(solids) == 2:
        assert shared_mm3(*solids) < TOUCHING_MM3


def catalogue(name: str) -> Servo:
    return loaded("aqua2").gaze.servos.model_validate({"pan": name, "tilt": name}).pan
