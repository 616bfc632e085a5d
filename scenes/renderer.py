"""The fast renderer: what the camera sees through port and mirrors, deterministic, one frozen kernel per frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.arrays import FloatArray
from optics.backend import UInt32, dr
from optics.layout import Layout, camera_pose, pan_from_m2
from optics.mesh import Group, PartMesh
from rigs import Rig
from rigs.specification import FlatMirror
from scenes.ambient_volume import ambient_volume
from scenes.clearance import Clearance
from scenes.frame import FARTHEST_M, Frame, frames_of
from scenes.geometry import geometry_of
from scenes.group_mesh import (
    SNOW,
    TARGET,
    WORLD,
    mirror_plates,
    rig_meshes_by_group,
    snow_mesh,
    target_mesh,
    world_mesh,
)
from scenes.kernel import Shape, compiled_frame, compiled_prefix
from scenes.lamps import lamp_numbers
from scenes.materials import Material
from scenes.packing import Packing, vectors
from scenes.port_rays import port_rays
from scenes.shade import at_rest, with_shade
from scenes.source_volume import lit_world
from scenes.stage import Stage
from scenes.state import State
from scenes.targets import MeshShape
from scenes.tracing import Thing
from scenes.veil import AZIMUTHS, ELEVATIONS
from scenes.water_shade import folded_begins, water_shade
from scenes.world_shade import world_shade
from scenes.worlds.snow import snow_offset_m


class FastRenderer:
    """Renders a rig in a world; made once, called for every state.

    Parameters
    ----------
    rig : Rig
    parts : sequence of PartMesh
        Hull and mount as triangles (`cad.meshes.rig_meshes`); may be empty.
    stage : Stage
        World, light, and where robot and target are unless a state says otherwise.
    width_px, height_px : int, optional
        Size of the frame; the camera's own by default. Another size looks at the same field of view.
    samples : int
        Samples per pixel, spread evenly over it.

    Attributes
    ----------
    instance_names : tuple of str
        Names of the parts, of what is in the world, and of the target, by their number in `Frame.instance`.
    """

    def __init__(
        self,
        rig: Rig,
        parts: Sequence[PartMesh],
        stage: Stage,
        *,
        width_px: int | None = None,
        height_px: int | None = None,
        samples: int = 1,
    ):
        self.rig = rig
        self.shape = (height_px or rig.camera.height_px, width_px or rig.camera.width_px)
        self.samples = samples
        if min(*self.shape, samples) < 1:
            raise ValueError(f"expected a positive size and sample count, got {self.shape[::-1]} and {samples}")
        self.stage = stage
        self._layout = Layout.from_rig(rig) if rig.has_mirrors else None
        if self._layout is not None:
            self._m1 = _packed_mirror(self._layout.body_from_m1.as_matrix(), rig.fold_mirror)
        meshes, names = rig_meshes_by_group(parts)
        water = shade = None
        body_from = self._body_from(State())
        if meshes:
            hung = at_rest(stage.world_from_body)
            poses = {group: RigidTransform.from_matrix(matrix) for group, matrix in body_from.items()}
            mirrors = mirror_plates(parts, poses, self._mirrors(body_from))
            meshes, robot = with_shade(meshes, poses, mirrors, stage.light, hung=hung)
            water = water_shade(robot, hung, self._line_begins(), stage.light)
            shade = world_shade(robot, hung, stage.light)
        self.instance_names = (*names, *stage.world.instance_names, TARGET)
        volume = source = None
        if len(stage.world.faces):
            meshes[WORLD], source = lit_world(world_mesh(stage.world, len(names)), stage.light)
            volume = ambient_volume(meshes[WORLD], stage.light, source)
        if stage.target is not None and isinstance(stage.target.shape, MeshShape):
            meshes[TARGET] = target_mesh(stage.target.shape, len(self.instance_names) - 1)
        if stage.snow is not None:
            meshes[SNOW] = snow_mesh(stage.snow)
        self._geometry = replace(
            geometry_of(meshes, stage.light.towards_sun),
            volume=volume,
            source=source,
            water=water,
            shade=shade,
            eyes=vectors(self._eyes()),
        )
        self._clearance = Clearance(stage.world)
        self._tables = stage.light.tables() | stage.sea.tables()
        lamps = rig.lamps
        self._lamp_numbers = lamp_numbers(lamps, stage.light.bands.wavelength_nm) if lamps else {}
        self._rays = port_rays(rig, *self.shape, samples)
        self._packing = Packing.of(self._numbers(State()))
        self._rays["prefix"] = compiled_prefix(self._packing)(self._rays, self._geometry.groups, self._rows([State()]))
        self._light: tuple[float, Any] | None = None

    def render(
        self,
        *,
        q1: float = 0.0,
        q2: float = 0.0,
        world_from_body: RigidTransform | None = None,
        world_from_target: RigidTransform | None = None,
        time_s: float = 0.0,
    ) -> Frame:
        """Render one frame at joint values in radians; `ValueError` outside the joint limits.

        Poses of robot and target are the stage's unless given.
        """
        return self.render_states(
            [
                State(
                    q1=q1,
                    q2=q2,
                    world_from_body=world_from_body,
                    world_from_target=world_from_target,
                    time_s=time_s,
                )
            ]
        )[0]

    def render_states(self, states: Sequence[State]) -> list[Frame]:
        """Render a frame for each state, all in one kernel; `ValueError` for joints outside their limits.

        Light is computed for the mean depth of the robot, and falls off from there with depth: states of one call
        should lie within a metre or so of depth.
        """
        return frames_of(self.arrays(states), len(states), self.shape, self.samples)

    def render_sweep(self, states: Sequence[State]) -> Frame:
        """Render one frame whose rows are exposed one after the other, as a rolling shutter does.

        `states` are two or more, at even times from the first row's to the last row's. Between them joints, robot and
        target move evenly; waves and flakes are those of the middle one.
        """
        return frames_of(self.sweep_arrays(states), 1, self.shape, self.samples)[0]

    def arrays(self, states: Sequence[State], *, truth: bool = True) -> dict[str, Any]:
        """Same as `render_states`, left on the device as flat arrays.

        State by state, pixel by pixel (row by row), sample by sample. Without `truth` there is only the radiance `rgb`
        and the `label`.
        """
        if not states:
            raise ValueError("expected at least one state, got none")
        count = len(states)
        rays = self._rays if count == 1 else self._repeated_rays(count)
        return self._computed(rays, self._rows(states), self._depth(states), frames=count, truth=truth)

    def sweep_arrays(self, states: Sequence[State], *, truth: bool = True) -> dict[str, Any]:
        """Same as `render_sweep`, left on the device as `arrays` does."""
        if len(states) < 2:
            raise ValueError(f"expected the states of the first and the last row at least, got {len(states)}")
        numbers = [self._numbers(state) for state in states]
        middle = numbers[len(numbers) // 2]
        # Phases wrap, and the flakes' frame steps: there is nothing between them.
        still = {name: middle[name] for name in (*self.stage.sea.moving_numbers(0.0), SNOW) if name in middle}
        still["clearance_m"] = min(each["clearance_m"] for each in numbers)
        knots = self._packing.upload(*(each | still for each in numbers))
        sweep = {"rows": self.shape[0], "knots": len(states)}
        return self._computed(self._swept_rays, knots, self._depth(states), frames=1, truth=truth, **sweep)

    def _computed(
        self,
        rays: dict[str, Any],
        state_rows: Any,
        depth_m: float,
        *,
        frames: int,
        truth: bool,
        rows: int = 0,
        knots: int = 0,
    ) -> dict[str, Any]:
        """What the kernel of `scenes.kernel.Shape` returns."""
        light_packing, light_row = self._light_row(depth_m)
        shape = Shape(
            light=light_packing,
            state=self._packing,
            wavelengths=len(self.stage.light.bands.wavelength_nm),
            states=frames,
            eyes=len(self._eyes()),
            truth=truth,
            rows=rows,
            knots=knots,
        )
        result: dict[str, Any] = compiled_frame(shape)(rays, self._geometry.arrays, self._tables, light_row, state_rows)
        return result

    def _depth(self, states: Sequence[State]) -> float:
        """Mean depth of the robot, metres."""
        return float(np.mean([-self._body_pose(state).translation[2] for state in states]))

    @cached_property
    def _swept_rays(self) -> dict[str, Any]:
        """Rays of the port, and which row of the frame each lane belongs to."""
        row = self._rays["place"] // (self.shape[1] * self.samples)
        dr.eval(row)
        return self._rays | {"row": row}

    def _rows(self, states: Sequence[State]) -> Any:
        """Packed numbers of the states."""
        return self._packing.upload(*(self._numbers(state) for state in states))

    def _light_row(self, depth_m: float) -> tuple[Packing, Any]:
        """Packed numbers of the light at a depth; the last is kept, since robots hover."""
        if self._light is None or self._light[0] != depth_m:
            numbers = self.stage.light.numbers(depth_m) | self.stage.sea.numbers() | self._lamp_numbers
            packing = Packing.of(numbers)
            self._light = (depth_m, (packing, packing.upload(numbers)))
        row: tuple[Packing, Any] = self._light[1]
        return row

    def _body_pose(self, state: State) -> RigidTransform:
        return self.stage.world_from_body if state.world_from_body is None else state.world_from_body

    def _body_from(self, state: State) -> dict[str, FloatArray]:
        """Pose of every group of the rig in the body frame, shape (4, 4)."""
        fixed = {str(Group.FIXED): np.eye(4)}
        if self._layout is None:
            return fixed
        self._layout.check_joints(state.q1, state.q2)
        pan = self._layout.body_from_pan(state.q1).as_matrix()
        return fixed | {
            str(Group.PAN): pan,
            str(Group.TILT): pan @ pan_from_m2(self._layout.tilt_angle(state.q2)).as_matrix(),
        }

    def _eyes(self) -> NDArray[np.float64]:
        """Where lines of sight begin, body frame: the camera, and the mirrors' centres; shape (1 or 3, 3)."""
        eyes = [camera_pose(self.rig.camera).translation]
        if self._layout is not None:
            eyes += [self._layout.body_from_m1.translation, self._layout.body_from_gimbal.translation]
        return np.array(eyes)

    def _line_begins(self) -> NDArray[np.float64]:
        """Where the lines of sight of each eye begin, by direction (`scenes.water_shade`), body frame."""
        eyes = self._eyes()
        begins = np.repeat(eyes[:, np.newaxis], ELEVATIONS * AZIMUTHS, axis=1)
        if self._layout is not None:
            begins[1] = folded_begins(eyes[0], self._m1)
        return begins

    def _numbers(self, state: State) -> dict[str, Any]:
        """Numbers of one state: poses of the groups seen from the body, mirrors, ball and sun in the body frame.

        Poses are multiplied as matrices: SciPy's own products check what they are given, and take as long as a small
        frame.
        """
        pose = self._body_pose(state)
        world_from_body, body_from_world = pose.as_matrix(), pose.inv().as_matrix()
        position = world_from_body[:3, 3]
        numbers: dict[str, Any] = {
            WORLD: _packed_pose(world_from_body),
            "towards_sun": body_from_world[:3, :3] @ self.stage.light.towards_sun,
            "clearance_m": min(self._clearance.metres(position), FARTHEST_M),
            "ball": np.zeros(4),
            "ball_material": float(Material.TARGET),
            "ball_instance": float(len(self.instance_names)),
        }
        target = self.stage.target
        if target is not None:
            moved = state.world_from_target
            world_from_target = target.world_from_target if moved is None else moved
            # Carried into the body frame here, in double precision.
            if isinstance(target.shape, MeshShape):
                numbers[TARGET] = _packed_pose(world_from_target.inv().as_matrix() @ world_from_body)
            else:
                centre = body_from_world @ world_from_target.as_matrix()[:, 3]
                numbers["ball"] = np.append(centre[:3], target.shape.radius_m)
        numbers |= self.stage.sea.moving_numbers(state.time_s)
        if self.stage.snow is not None:
            numbers[SNOW] = _packed_pose(world_from_body)
            numbers[SNOW][-3:] -= snow_offset_m(self.stage.snow, position, state.time_s)
        if self._layout is not None:
            body_from = self._body_from(state)
            for group in (Group.PAN, Group.TILT):
                numbers[str(group)] = _packed_pose(np.asarray(np.linalg.inv(body_from[str(group)])))
            numbers |= self._mirrors(body_from)
        return numbers

    def _mirrors(self, body_from: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """Packed mirrors, body frame."""
        if self._layout is None:
            return {}
        tilt = body_from[str(Group.TILT)]
        return {Thing.M1.name: self._m1, Thing.M2.name: _packed_mirror(tilt, self.rig.gaze_mirror)}

    def _repeated_rays(self, count: int) -> dict[str, Any]:
        """Rays of the port once for each state, and which state each lane belongs to."""
        lanes = self.samples * self.shape[0] * self.shape[1]
        lane = dr.arange(UInt32, count * lanes)
        repeated: dict[str, Any] = {"state": lane // lanes}
        ray = lane % lanes
        repeated["place"] = dr.gather(UInt32, self._rays["place"], ray) + repeated["state"] * lanes
        for name in ("origin", "direction", "gain"):
            repeated[name] = dr.gather(type(self._rays[name]), self._rays[name], ray)
        repeated["prefix"] = [
            {name: dr.gather(type(values), values, ray) for name, values in hit.items()} for hit in self._rays["prefix"]
        ]
        dr.eval(repeated)
        return repeated


def _packed_pose(pose: FloatArray) -> FloatArray:
    """Rows of the rotation, then the translation."""
    return np.concatenate([pose[:3, :3].ravel(), pose[:3, 3]])


def _packed_mirror(pose: FloatArray, plate: FlatMirror | None) -> FloatArray:
    """Centre, x, y, half width, half height."""
    assert plate is not None  # a rig has both mirrors or none
    half = [plate.width_mm / 2000, plate.height_mm / 2000]
    return np.concatenate([pose[:3, 3], pose[:3, 0], pose[:3, 1], half])
