"""The fast renderer: what the camera sees through port and mirrors, deterministic, one frozen kernel per frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.backend import UInt32, dr
from optics.kernels.packing import Packing, vectors
from optics.layout import Layout, camera_pose
from optics.mesh import PartMesh
from rigs import Rig
from scenes.baking.irradiance_volume import ambient_volume
from scenes.baking.robot_shadow_in_water import folded_begins, water_shade
from scenes.baking.robot_shadow_on_world import world_shade
from scenes.baking.source_volume import lit_world
from scenes.baking.sun_shadow import at_rest, with_shade
from scenes.kernels.geometry import geometry_of
from scenes.kernels.kernel import Shape, compiled_frame, compiled_prefix
from scenes.kernels.port_rays import port_rays
from scenes.kernels.state_records import StateRecords
from scenes.kernels.tracing import FixedHit, Primitive, Rays
from scenes.kernels.veiling_light import AZIMUTHS, ELEVATIONS
from scenes.light.lamps import LampUniforms
from scenes.stage.frame import Frame, FrameArrays, frames_of
from scenes.stage.group_mesh import mirror_plates, rig_meshes_by_group, snow_mesh, target_mesh, world_mesh
from scenes.stage.records import SNOW, TARGET, WORLD, MirrorPlate
from scenes.stage.stage import Stage
from scenes.stage.state import State
from scenes.stage.targets import MeshShape


class FastRenderer:
    """Renders a rig in a world; made once, called for every state.

    Parameters
    ----------
    rig : Rig
    parts : sequence of PartMesh
        Hull and mount as triangles (`cad.assembly.meshes.rig_meshes`); may be empty.
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
        meshes, names = rig_meshes_by_group(parts)
        self.instance_names = (*names, *stage.world.instance_names, TARGET)
        self._records = StateRecords(rig, stage, target_instance=len(self.instance_names))
        in_water = on_world = None
        if meshes:
            hung = at_rest(stage.world_from_body)
            body_from = self._records.body_from([State()])
            poses = {group: RigidTransform.from_matrix(matrix) for group, (matrix,) in body_from.items()}
            mirrors = {name: batch[0] for name, batch in self._records.mirrors(body_from).items()}
            plates = mirror_plates(parts, poses, mirrors)
            meshes, robot = with_shade(meshes, poses, plates, stage.light, hung=hung)
            in_water = water_shade(robot, hung, self._line_begins(mirrors), stage.light)
            on_world = world_shade(robot, hung, stage.light)
        irradiance = source = None
        if len(stage.world.faces):
            meshes[WORLD], source = lit_world(world_mesh(stage.world, len(names)), stage.light)
            irradiance = ambient_volume(meshes[WORLD], stage.light, source)
        if stage.target is not None and isinstance(stage.target.shape, MeshShape):
            meshes[TARGET] = target_mesh(stage.target.shape, len(self.instance_names) - 1)
        if stage.snow is not None:
            meshes[SNOW] = snow_mesh(stage.snow)
        self._geometry = replace(
            geometry_of(meshes, stage.light.towards_sun),
            irradiance=irradiance,
            source=source,
            shadow_in_water=in_water,
            shadow_on_world=on_world,
            eyes=vectors(self._eyes()),
        )
        self._tables = stage.sea.tables()
        self._lamps = LampUniforms.of(rig.lamps, stage.light.bands.wavelength_nm) if rig.lamps else None
        rays = port_rays(rig, *self.shape, samples)
        self._packing = Packing.of(self._records.of([State()]), batched=True)
        prefix = compiled_prefix(self._packing)(rays, self._geometry.groups, self._uploaded([State()]))
        self._rays = replace(rays, prefix=tuple(prefix))
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

    def arrays(self, states: Sequence[State], *, truth: bool = True) -> FrameArrays:
        """Same as `render_states`, left on the device as flat arrays.

        State by state, pixel by pixel (row by row), sample by sample. Without `truth` there is only radiance
        and label.
        """
        if not states:
            raise ValueError("expected at least one state, got none")
        count = len(states)
        rays = self._rays if count == 1 else self._repeated_rays(count)
        return self._computed(rays, self._uploaded(states), self._depth(states), frames=count, truth=truth)

    def sweep_arrays(self, states: Sequence[State], *, truth: bool = True) -> FrameArrays:
        """Same as `render_sweep`, left on the device as `arrays` does."""
        if len(states) < 2:
            raise ValueError(f"expected the states of the first and the last row at least, got {len(states)}")
        records = self._records.still_between(self._records.of(states))
        knots = self._packing.upload(records, len(states))
        sweep = {"rows": self.shape[0], "knots": len(states)}
        return self._computed(self._swept_rays, knots, self._depth(states), frames=1, truth=truth, **sweep)

    def _computed(
        self,
        rays: Rays,
        state_records: Any,
        depth_m: float,
        *,
        frames: int,
        truth: bool,
        rows: int = 0,
        knots: int = 0,
    ) -> FrameArrays:
        """What the kernel of `scenes.kernels.kernel.Shape` returns."""
        light_packing, light_record = self._light_record(depth_m)
        shape = Shape(
            light=light_packing,
            state=self._packing,
            wavelengths=len(self.stage.light.bands.wavelength_nm),
            lanes=dr.width(rays.place),
            states=frames,
            eyes=dr.width(self._geometry.eyes),
            truth=truth,
            rows=rows,
            knots=knots,
        )
        result: FrameArrays = compiled_frame(shape)(rays, self._geometry, self._tables, light_record, state_records)
        return result

    def _depth(self, states: Sequence[State]) -> float:
        """Mean depth of the robot, metres."""
        return float(np.mean([-self._records.body_pose(state).translation[2] for state in states]))

    @cached_property
    def _swept_rays(self) -> Rays:
        """Rays of the port, and which row of the frame each belongs to."""
        row = self._rays.place // (self.shape[1] * self.samples)
        dr.eval(row)
        return replace(self._rays, row=row)

    def _uploaded(self, states: Sequence[State]) -> Any:
        """Records of the states."""
        return self._packing.upload(self._records.of(states), len(states))

    def _light_record(self, depth_m: float) -> tuple[Packing, Any]:
        """Uniforms of the light at a depth; the last are kept, since robots hover."""
        if self._light is None or self._light[0] != depth_m:
            uniforms = replace(self.stage.sea.uniforms(depth_m), lamps=self._lamps)
            packing = Packing.of(uniforms)
            self._light = (depth_m, (packing, packing.upload(uniforms)))
        record: tuple[Packing, Any] = self._light[1]
        return record

    def _eyes(self) -> NDArray[np.float64]:
        """Where lines of sight begin, body frame: the camera, and the mirrors' centres; shape (1 or 3, 3)."""
        eyes = [camera_pose(self.rig.camera).translation]
        if self.rig.gaze is not None:
            layout = Layout.from_rig(self.rig)
            eyes += [layout.body_from_m1.translation, layout.body_from_gimbal.translation]
        return np.array(eyes)

    def _line_begins(self, mirrors: dict[str, MirrorPlate]) -> NDArray[np.float64]:
        """Where each eye's lines of sight begin, by direction (`scenes.baking.robot_shadow_in_water`), body frame."""
        eyes = self._eyes()
        begins = np.repeat(eyes[:, np.newaxis], ELEVATIONS * AZIMUTHS, axis=1)
        if mirrors:
            begins[1] = folded_begins(eyes[0], mirrors[Primitive.M1.name])
        return begins

    def _repeated_rays(self, count: int) -> Rays:
        """Rays of the port once for each state, and which state each belongs to."""
        lanes = self.samples * self.shape[0] * self.shape[1]
        lane = dr.arange(UInt32, count * lanes)
        state, ray = lane // lanes, lane % lanes

        def repeated(values: Any) -> Any:
            return dr.gather(type(values), values, ray)

        found = Rays(
            origin=repeated(self._rays.origin),
            direction=repeated(self._rays.direction),
            gain=repeated(self._rays.gain),
            prefix=tuple(
                FixedHit(distance=repeated(hit.distance), face=repeated(hit.face)) for hit in self._rays.prefix
            ),
            place=repeated(self._rays.place) + state * lanes,
            state=state,
        )
        dr.eval(found)
        return found
