"""A ball and a box in MuJoCo, seen through the camera's table, beside our own image: `./run bench simulator`.

The robot hovers in open water; in MuJoCo stand a sphere, a box, and hull, mount and mirrors as meshes, all in the
body's frame. A pixel's ray has up to three legs: from the port, from M1 and from M2; the first thing on any of them is
what the pixel shows. Prints how many pixels show another thing than our image, and how far off the distances are; with
``-o`` it draws both side by side.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from cad.assembly.meshes import rig_meshes
from cad.poses import body_from_group
from optics.gaze import read_camera
from optics.gaze.camera_table import camera_table
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.image import display_image
from scenes.light.materials import Material
from scenes.renderer import FastRenderer
from scenes.stage.frame import Frame, Label
from scenes.stage.scene import Scene, Target, make_scene
from scenes.stage.state import State
from scenes.stage.targets import Ball, MeshShape
from scenes.surfaces.surface import surface

RIG = "aqua2"
Q1, Q2 = 0.3, -0.1
"""Pose of the mirrors, radians."""

DEPTH_M = 5.0
BALL_RADIUS_M = 0.15
BOX_HALF_M = np.array([0.12, 0.2, 0.16])
BOX_TURN = Rotation.from_euler("ZYX", [30.0, 20.0, 10.0], degrees=True)
BALL_M, BOX_M = 1.5, 2.2
"""How far they are from the gaze mirror, along its middle ray and along one near its edge."""

OFF_MIRROR_M = 1e-4
"""A leg begins and ends so far off a mirror's face, which is a mesh as well."""

NOTHING, ROBOT, BALL, BOX = range(4)
"""What a pixel shows."""

MOST_DIFFERENT = 2e-3
"""Share of pixels that may show another thing: edges, in single precision and with thin plates."""
MOST_OFF_M = 1e-4
"""Of nine in ten distances."""


@dataclass(frozen=True, kw_only=True)
class View:
    """What pixels show, shape (height, width), and how far along the ray from the port it is, metres."""

    thing: NDArray[np.uint8]
    distance_m: FloatArray


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare; 1 when more differs than edges explain."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks simulator", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, metavar="PNG", help="draw both images and where they differ")
    options = parser.parse_args(arguments)
    rig = Rig.load(RIG)
    parts = rig_meshes(rig)
    ball, box = _poses(rig)
    legs = camera_legs(camera_table(rig), Q1, Q2)
    started = time.perf_counter()
    theirs = cast(mujoco_model(rig, parts, ball, box), legs)
    seconds = time.perf_counter() - started
    frame, stage = our_frame(rig, parts, ball, box)
    ours = view_of(frame)
    differs = (theirs.thing != ours.thing) & (frame.region > 0)
    same = (theirs.thing == ours.thing) & (ours.thing >= BALL)
    off = np.abs(theirs.distance_m[same] - ours.distance_m[same])
    share, typical = differs.sum() / np.count_nonzero(frame.region), float(np.quantile(off, 0.9))
    print(f"{theirs.thing.shape[1]} x {theirs.thing.shape[0]} pixels, {seconds:.1f} s in MuJoCo")
    counts = np.bincount(ours.thing.ravel(), minlength=4)
    print(f"ball {counts[BALL]} px, box {counts[BOX]} px, robot {counts[ROBOT]} px")
    print(f"another thing: {differs.sum()} px, {100 * share:.3f} %")
    print(f"distance of ball and box: 90 % below {1000 * typical:.4f} mm, largest {1000 * off.max():.4f} mm")
    if options.output is not None:
        draw(display_image(frame, stage), theirs, options.output)
    return int(share > MOST_DIFFERENT or typical > MOST_OFF_M)


def camera_legs(
    table: dict[str, NDArray[Any]], q1: float, q2: float
) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Origin, direction and length of the legs of every pixel's ray, shape (height, width, ...); nan where none is."""
    last = read_camera.rays(table, q1, q2)
    fold = read_camera.rays(table | {"m2_outline": np.zeros(4)}, q1, q2)  # no gaze mirror: as far as M1
    port = (table["origin_m"].astype(float), table["direction"].astype(float))
    path = last[2]
    legs = []
    for number, (start, end) in enumerate(((port, fold), (fold, last), (last, None)), 1):
        length = np.full(path.shape, np.inf) if end is None else np.linalg.norm(end[0] - start[0], axis=-1)
        is_last = path == number
        length = np.where(is_last, np.where(last[3], 0.0, np.inf), length)
        legs.append((start[0], start[1], np.where(path >= number, length, np.nan)))
    return legs


def mujoco_model(rig: Rig, parts: Sequence[PartMesh], ball: RigidTransform, box: RigidTransform) -> mujoco.MjModel:
    """Ball, box and robot at the pose of the mirrors, in the body's frame."""
    spec = mujoco.MjSpec()
    layout = Layout.from_rig(rig)
    spec.worldbody.add_geom(
        name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[BALL_RADIUS_M, 0, 0], pos=ball.translation
    )
    turn = box.rotation.as_quat(scalar_first=True)
    spec.worldbody.add_geom(name="box", type=mujoco.mjtGeom.mjGEOM_BOX, size=BOX_HALF_M, pos=box.translation, quat=turn)
    for part in parts:
        placed = body_from_group(layout, part.group, Q1, Q2).apply(part.vertices_m)
        spec.add_mesh(
            name=part.name,
            uservert=placed.ravel(),
            userface=part.faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=part.name, contype=0, conaffinity=0)
    return spec.compile()


def cast(model: mujoco.MjModel, legs: list[tuple[FloatArray, FloatArray, FloatArray]]) -> View:
    """What MuJoCo's rays hit first. `mj_multiRay` would be faster, but its rays begin in one point: ours do not."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = {model.geom("ball").id: BALL, model.geom("box").id: BOX}
    shape = legs[0][2].shape
    thing, distance_m = np.full(shape, NOTHING, dtype=np.uint8), np.full(shape, np.inf)
    geom = np.zeros(1, dtype=np.int32)
    for row, column in np.argwhere(np.isfinite(legs[0][0][..., 0])):
        before = 0.0
        for number, (origin, direction, length) in enumerate(legs):
            most = length[row, column]
            if np.isnan(most):
                break
            off = OFF_MIRROR_M if number else 0.0
            start = origin[row, column] + off * direction[row, column]
            hit = mujoco.mj_ray(model, data, start, direction[row, column], None, 1, -1, geom, None)
            if 0 <= hit < most - off - OFF_MIRROR_M:
                thing[row, column] = names.get(int(geom[0]), ROBOT)
                distance_m[row, column] = before + off + hit
                break
            if most == 0.0:
                thing[row, column] = ROBOT  # the back of a mirror
            before += most
    return View(thing=thing, distance_m=distance_m)


def our_frame(rig: Rig, parts: Sequence[PartMesh], ball: RigidTransform, box: RigidTransform) -> tuple[Frame, Scene]:
    """Our image of the same, in open water."""
    world_from_body = RigidTransform.from_translation([0.0, 0.0, -DEPTH_M])
    stage = make_scene(rig, world="blue", depth_m=DEPTH_M, target=Ball(radius_m=BALL_RADIUS_M))
    stage = _with_box(stage)
    state = State(
        q1=Q1,
        q2=Q2,
        world_from_body=world_from_body,
        world_from_target=world_from_body * ball,
        world_from_decoys=(world_from_body * box,),
    )
    return FastRenderer(prepare(stage, rig, parts)).render_states([state])[0], stage


def _with_box(stage: Scene) -> Scene:
    corners = np.array(np.meshgrid(*[[-1, 1]] * 3, indexing="ij")).reshape(3, -1).T * BOX_HALF_M
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6)]
    faces += [(0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    shape = MeshShape(name="box", surface=surface(corners, faces, Material.TILE_WHITE))
    return replace(stage, decoys=(Target(shape=shape, world_from_target=RigidTransform.identity()),))


def view_of(frame: Frame) -> View:
    """What our image shows, in the words of the comparison."""
    thing = np.full(frame.label.shape, NOTHING, dtype=np.uint8)
    thing[np.isin(frame.label, (Label.HULL, Label.MOUNT, Label.SERVO, Label.MIRROR_BACK, Label.MIRROR))] = ROBOT
    thing[frame.label == Label.TARGET] = BALL
    thing[frame.label == Label.DECOY] = BOX
    return View(thing=thing, distance_m=frame.distance_m.astype(float))


def _poses(rig: Rig) -> tuple[RigidTransform, RigidTransform]:
    """Where ball and box are in the body: on two rays over both mirrors."""
    origin, direction, path, _ = read_camera.rays(camera_table(rig, width_px=64, height_px=48), Q1, Q2)
    over_both = np.argwhere(path == 3)
    (row, column), (edge_row, edge_column) = over_both[len(over_both) // 2], over_both[len(over_both) // 5]
    ball = origin[row, column] + BALL_M * direction[row, column]
    box = origin[edge_row, edge_column] + BOX_M * direction[edge_row, edge_column]
    return RigidTransform.from_translation(ball), RigidTransform.from_components(box, BOX_TURN)


def draw(image: NDArray[np.uint8], theirs: View, path: Path) -> None:
    """Our image, and MuJoCo's things darker with distance."""
    colours = np.array([(20, 40, 60), (150, 150, 150), (200, 40, 40), (240, 200, 120)])[theirs.thing]
    shade = np.where(np.isfinite(theirs.distance_m), np.exp(-theirs.distance_m / 4), 1.0)
    shown = (colours * shade[..., np.newaxis]).astype(np.uint8)
    panels = [cv2.resize(each, (480, 360), interpolation=cv2.INTER_AREA) for each in (image, shown)]
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.hstack(panels)[..., ::-1])
