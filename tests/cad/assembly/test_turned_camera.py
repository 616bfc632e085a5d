"""A mount for a camera that looks elsewhere is that of one that looks ahead, turned with it: hull and all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform, Rotation

from cad.assembly.assembly import Assembly, Part, build_assembly
from cad.checks.sequence.bench import Bench
from cad.checks.sequence.steps import _directions
from cad.export.drawings.drawings import _to_draw
from cad.parts.bands import band_hardware
from cad.parts.bracket.bracket_placement import bracket_placement
from cad.parts.bracket.fold_bracket import fold_bracket_solid
from cad.parts.stow_hinge import stow_hinge
from cad.shapes import cylinder
from optics.layout import Layout
from optics.mesh import Group
from rigs import FileHull, Rig
from rigs.mounting import StowJoint

CORNER_MM = 1e-6
"""Double precision on lengths below a metre, with room for the kernel's own rounding (1e-7 mm)."""
TOUCHING_MM3 = 1e-6
"""Volume shared by solids that touch: rounding of the kernel on areas of some 1000 mm2."""
YAW_DEG, PITCH_DEG, ROLL_DEG = 25.0, -35.0, 10.0


def on_turned_box(rig: Rig, folder: Path) -> tuple[Rig, RigidTransform]:
    """A rig on a box between its anchors in place of its hull, turned about its camera; and that turn, metres."""
    mount, pinhole = rig.require_gaze().mount, np.array(rig.camera.position_mm)
    levels = (mount.base_anchor_mm[2], mount.fold_anchor_mm[2])
    trimesh.creation.box(bounds=[(-300, -200, levels[0]), (300, 200, levels[1])]).export(folder / "box.stl")
    turn = Rotation.from_euler("ZYX", [YAW_DEG, -PITCH_DEG, ROLL_DEG], degrees=True)
    angles = {"yaw_deg": YAW_DEG, "pitch_deg": PITCH_DEG, "roll_deg": ROLL_DEG}

    def moved(point_mm: tuple[float, float, float]) -> tuple[float, ...]:
        return tuple((pinhole + turn.apply(np.array(point_mm) - pinhole)).tolist())

    hull = FileHull(shape="file", file=folder / "box.stl", unit="mm", position_mm=moved((0.0, 0.0, 0.0)), **angles)
    anchors = {
        "fold_anchor_mm": moved(mount.fold_anchor_mm),
        "base_anchor_mm": moved(mount.base_anchor_mm),
        "fold_normal": tuple(turn.apply([0.0, 0.0, 1.0]).tolist()),
        "base_normal": tuple(turn.apply([0.0, 0.0, -1.0]).tolist()),
        "fold_plane": None,
        "base_plane": None,
    }
    camera = rig.camera.model_copy(update=angles)
    pose = RigidTransform.from_components((pinhole - turn.apply(pinhole)) / 1000, turn)
    return rig.with_gaze(hull=hull, mount=anchors).model_copy(update={"camera": camera}), pose


@pytest.fixture(scope="module")
def ahead(built_preset: Callable[[str], Assembly]) -> Assembly:
    return built_preset("bluerov2")


@pytest.fixture(scope="module")
def turned(ahead: Assembly, tmp_path_factory: pytest.TempPathFactory) -> tuple[Assembly, RigidTransform]:
    rig, pose = on_turned_box(ahead.rig, tmp_path_factory.mktemp("turned"))
    return build_assembly(rig), pose


def corners_mm(part: Part) -> np.ndarray:
    return np.array([tuple(vertex) for vertex in part.solid.vertices()])


def test_every_part_is_that_of_a_camera_that_looks_ahead_turned_with_it(ahead, turned):
    """The turn of camera, hull and anchors about the pinhole takes each corner of each solid to its place."""
    assembly, pose = turned
    assert [part.name for part in assembly.parts] == [part.name for part in ahead.parts]
    for straight, part in zip(ahead.parts[1:], assembly.parts[1:], strict=True):
        expected, found = corners_mm(straight), corners_mm(part)
        if part.group is Group.FIXED:
            expected = 1000 * pose.apply(expected / 1000)
        assert len(found) == len(expected) > 0
        assert cKDTree(expected).query(found)[0].max() < CORNER_MM, part.name
        assert cKDTree(found).query(expected)[0].max() < CORNER_MM, part.name
        assert part.solid.volume == pytest.approx(straight.solid.volume, rel=1e-7)


def test_its_drawings_and_its_ways_out_are_along_its_own_axes(ahead, turned):
    assembly, pose = turned
    drawn, _ = _to_draw(assembly, assembly.part("fold_bracket"))
    expected = ahead.part("fold_bracket").solid.bounding_box()
    np.testing.assert_allclose(tuple(drawn.bounding_box().min), tuple(expected.min), rtol=0, atol=1e-3)
    np.testing.assert_allclose(tuple(drawn.bounding_box().max), tuple(expected.max), rtol=0, atol=1e-3)
    parts = {part.name: part for part in assembly.parts}
    bench = Bench(assembly=assembly, parts=parts, surfaces={}, bodies={}, clusters=[], loose={})
    np.testing.assert_allclose(_directions(bench, "gimbal_base")[0], pose.rotation.apply([0, 0, 1]), atol=1e-12)


def test_its_hinge_swings_as_that_of_a_camera_that_looks_ahead(ahead, turned):
    assembly, pose = turned
    rigs = [rig.with_gaze(joints={"stow": StowJoint(max_deg=90.0)}) for rig in (ahead.rig, assembly.rig)]
    straight, found = (stow_hinge(rig, Layout.from_rig(rig)).body_from_stowing(0.7) for rig in rigs)
    expected = pose * straight * pose.inv()
    np.testing.assert_allclose(found.as_matrix(), expected.as_matrix(), rtol=0, atol=1e-12)


def shared_mm3(first, second) -> float:
    common = first & second
    return 0.0 if common is None else sum(solid.volume for solid in common.solids())


def test_under_bands_a_flange_lies_along_the_body_wherever_the_camera_looks():
    """Clear of the hull's cylinder and of the bands, which run across the body."""
    ahead = Rig.load("torpedo")
    rig = ahead.model_copy(update={"camera": ahead.camera.model_copy(update={"yaw_deg": 30.0})})
    placement = bracket_placement(rig, Layout.from_rig(rig))
    assert placement.flange_turn_deg == -30.0
    seat = placement.seat.moved(placement.body_from_fold)
    np.testing.assert_allclose(seat.body_from_seat.rotation.apply([1, 0, 0]), [1, 0, 0], atol=1e-12)
    bracket = fold_bracket_solid(placement)
    taken = [cylinder((500, 0, 0), (800, 0, 0), rig.require_gaze().hull.diameter_mm / 2)]
    taken += [piece.solid for piece in band_hardware([seat], trimesh.Trimesh())]
    assert sum(shared_mm3(bracket, body) for body in taken) < TOUCHING_MM3
