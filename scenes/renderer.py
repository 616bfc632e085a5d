"""The fast renderer: what the camera sees through port and mirrors, deterministic, one frozen kernel per frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import aligned
from optics.kernels.backend import UInt32, dr
from optics.kernels.freezing import Flat
from optics.kernels.packing import Packing
from scenes.baking.lit_scene import LitScene
from scenes.kernels.kernel import Shape, compiled_frame, compiled_prefix
from scenes.kernels.port_rays import port_rays
from scenes.kernels.tracing import Rays
from scenes.stage.frame import Frame, FrameArrays, frames_of
from scenes.stage.state import State


class FastRenderer:
    """Renders a lit scene; made once, called for every state.

    Parameters
    ----------
    lit : LitScene
        From `scenes.baking.lit_scene.prepare`.
    width_px, height_px : int, optional
        Size of the frame; the camera's own by default. Another size looks at the same field of view.
    samples : int
        Samples per pixel, spread evenly over it.

    Attributes
    ----------
    rig : Rig
    scene : Scene
    instance_names : tuple of str
        Of the lit scene.
    """

    def __init__(self, lit: LitScene, *, width_px: int | None = None, height_px: int | None = None, samples: int = 1):
        camera = lit.rig.camera
        self.shape = (height_px or camera.height_px, width_px or camera.width_px)
        self.samples = samples
        if min(*self.shape, samples) < 1:
            raise ValueError(f"expected a positive size and sample count, got {self.shape[::-1]} and {samples}")
        self.rig, self.scene, self.instance_names = lit.rig, lit.scene, lit.instance_names
        self._lit = lit
        self._packing = Packing.of(lit.records.of([State()]), batched=True)
        rays = port_rays(lit.rig, *self.shape, samples)
        prefix = compiled_prefix(self._packing)(Flat(rays), Flat(lit.geometry.groups), self._uploaded([State()]))
        self._rays = replace(rays, prefix=prefix)
        self._geometry, self._tables = Flat(lit.geometry), Flat(lit.tables)
        self._flat_rays = Flat(self._rays)
        self._repeated: tuple[int, Flat] | None = None
        self._light: tuple[float, Any] | None = None
        self._light_packing = Packing.of(lit.uniforms(lit.scene.depth_m))
        self._kernels: dict[tuple[int, bool, int, int, int], Callable[..., FrameArrays]] = {}

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

        Poses of robot and target are the scene's unless given.
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

    def arrays(
        self,
        states: Sequence[State],
        *,
        truth: bool = True,
        chosen: Sequence[NDArray[np.uint32]] | None = None,
        depth_m: float | None = None,
    ) -> FrameArrays:
        """Same as `render_states`, left on the device as flat arrays.

        State by state, pixel by pixel (row by row), sample by sample. Without `truth` there is only radiance
        and label.

        Parameters
        ----------
        states : sequence of State
        truth : bool
        chosen : sequence of array, optional
            Of each state the rays that are followed (`rays_of`), in their order; all without it.
        depth_m : float, optional
            For which light is computed; by default the mean of the states. With one of its own a state looks the same
            whatever others it is rendered with.
        """
        if not states:
            raise ValueError("expected at least one state, got none")
        count = len(states)
        rays = self._flat_rays if count == 1 else self._rays_of_states(count)
        lanes = self.samples * self.shape[0] * self.shape[1]
        return self._computed(
            rays,
            self._uploaded(states),
            self._depth(states) if depth_m is None else depth_m,
            frames=count,
            truth=truth,
            chosen=None if chosen is None else np.concatenate([own + k * lanes for k, own in enumerate(chosen)]),
        )

    def sweep_arrays(
        self, states: Sequence[State], *, truth: bool = True, chosen: NDArray[np.uint32] | None = None
    ) -> FrameArrays:
        """Same as `render_sweep`, left on the device as `arrays` does.

        Of the `chosen` rays alone (`rays_of`), in their order, when there are any.
        """
        if len(states) < 2:
            raise ValueError(f"expected the states of the first and the last row at least, got {len(states)}")
        records = self._lit.records.still_between(self._lit.records.of(states))
        knots = self._packing.upload(records, len(states))
        sweep = {"rows": self.shape[0], "knots": len(states)}
        return self._computed(
            self._swept_rays, knots, self._depth(states), frames=1, truth=truth, chosen=chosen, **sweep
        )

    def rays_of(self, pixels: NDArray[np.bool_]) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
        """Numbers of the rays of some pixels, shape (height, width), and the pixel (row by row) of each."""
        (rays,) = np.nonzero(pixels.ravel()[self._pixel_of_ray])
        return rays.astype(np.uint32), self._pixel_of_ray[rays]

    @cached_property
    def _pixel_of_ray(self) -> NDArray[np.intp]:
        return np.asarray(self._rays.place.numpy() // self.samples, dtype=np.intp)

    def _computed(
        self,
        rays: Flat,
        state_records: Any,
        depth_m: float,
        *,
        frames: int,
        truth: bool,
        rows: int = 0,
        knots: int = 0,
        chosen: NDArray[np.uint32] | None = None,
    ) -> FrameArrays:
        """What the kernel of `scenes.kernels.kernel.Shape` returns."""
        # What is chosen stays in its order: it has no place in a whole frame.
        lanes = self.samples * self.shape[0] * self.shape[1] * frames if chosen is None else 0
        key = (frames, truth, rows, knots, lanes)
        if key not in self._kernels:
            self._kernels[key] = compiled_frame(
                Shape(
                    light=self._light_packing,
                    state=self._packing,
                    wavelengths=len(self.scene.light.bands.wavelength_nm),
                    lanes=lanes,
                    states=frames,
                    eyes=dr.width(self._lit.geometry.eyes),
                    truth=truth,
                    rows=rows,
                    knots=knots,
                )
            )
        light_record = self._light_record(depth_m)
        some = () if chosen is None else (UInt32(aligned(chosen, np.uint32)),)
        found: FrameArrays = self._kernels[key](rays, self._geometry, self._tables, light_record, state_records, *some)
        return found

    def _depth(self, states: Sequence[State]) -> float:
        """Mean depth of the robot, metres."""
        return float(np.mean([-self._lit.records.body_pose(state).translation[2] for state in states]))

    @cached_property
    def _swept_rays(self) -> Flat:
        """Rays of the port, and which row of the frame each belongs to."""
        row = self._rays.place // (self.shape[1] * self.samples)
        dr.eval(row)
        return Flat(replace(self._rays, row=row))

    def _uploaded(self, states: Sequence[State]) -> Any:
        """Records of the states."""
        return self._packing.upload(self._lit.records.of(states), len(states))

    def _light_record(self, depth_m: float) -> Any:
        """Uniforms of the light at a depth; the last are kept, since robots hover."""
        if self._light is None or self._light[0] != depth_m:
            self._light = (depth_m, self._light_packing.upload(self._lit.uniforms(depth_m)))
        return self._light[1]

    def _rays_of_states(self, count: int) -> Flat:
        """Rays of the port once for each state; those of the last number of states are kept."""
        if self._repeated is None or self._repeated[0] != count:
            self._repeated = (count, Flat(self._repeated_rays(count)))
        return self._repeated[1]

    def _repeated_rays(self, count: int) -> Rays:
        """Rays of the port once for each state, and which state each belongs to."""
        lanes = self.samples * self.shape[0] * self.shape[1]
        lane = dr.arange(UInt32, count * lanes)
        state = lane // lanes
        rays = self._rays.taken(lane % lanes)
        found = replace(rays, place=rays.place + state * lanes, state=state)
        dr.eval(found)
        return found
