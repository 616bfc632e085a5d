"""A camera whose images are rendered: the rig in its world, and the image sensor with its own will.

Each image is exposed about its time: the middle of the middle row's exposure is the frame's number over the frame
rate. Every row is rendered at its own instant, as the rolling shutter opens it. What the sensor sets from one image
to the next (exposure, gain, white balance) and the frame's number are its whole state; noise is keyed by seed and
frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from dives.dive import Dive
from dives.known_target import above_water
from dives.looked_at import part_around
from dives.paths import body_pose, decoy_pose, target_pose
from dives.timed_mirrors import MovingJoints
from optics.gaze.kinematics import forward_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh
from optics.workers.threads import woken_threads
from rigs import Rig
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.light.waves import Wind
from scenes.renderer import FastRenderer
from scenes.sensor import (
    CameraSettings,
    ImageSensor,
    RawImage,
    develop,
    frame_key,
    next_settings,
    read_out,
    sweep_count,
    sweep_times,
)
from scenes.sensor import start_settings as settings_at_start
from scenes.sensor.automatic import metered_pixels
from scenes.sensor.colour import WHOLE
from scenes.stage.scene import Scene, Target, make_scene
from scenes.stage.state import State
from tracking.protocols import CameraFrame

MOST_SWEEPS = 3
"""Frames rendered for one exposure at most: during a fast slew a blur of three steps stands for a smooth one."""

STEP_PX = 4.0
"""How far the view may move between two of them: one frame for a blur of so much differs from eight by less than the
sensor's noise (`docs/explanation/dives.md`)."""


@dataclass(frozen=True, kw_only=True)
class Exposure:
    """What ground truth needs to know of an image beside the image.

    Attributes
    ----------
    frame : int
    time_s, start_s, end_s : float
        Of the image; of its first row's opening and its last row's closing.
    settings : CameraSettings
    state : State
        Where everything is at the image's time.
    label : array, shape (height, width)
        `scenes.stage.frame.Label` of what each pixel shows in the middle of its row's exposure; `HOUSING` where nothing
        was rendered.
    smear_px : float
        How far the view moved during the exposure of one row, at most.
    sweeps : int
        Frames that were rendered.
    """

    frame: int
    time_s: float
    start_s: float
    end_s: float
    settings: CameraSettings
    state: State
    label: NDArray[np.uint8]
    smear_px: float
    sweeps: int

    @property
    def rows_s(self) -> FloatArray:
        """Middle of the first and of the last row's exposure, shape (2,)."""
        half_s = self.settings.exposure_s / 2
        return np.array([self.start_s + half_s, self.end_s - half_s])


class RenderedCamera:
    """Camera of a dive; a `tracking.protocols.Camera` that runs out of images when the dive is over.

    Parameters
    ----------
    dive : Dive
    rig : Rig
        The dive's (`Dive.load_rig`).
    parts : sequence of PartMesh
        Hull and mount (`cad.assembly.meshes.rig_meshes`); may be empty.
    mirrors : MovingJoints
        Where the joints are while an image is exposed.
    quality : LightQuality, optional
        Full by default.

    Attributes
    ----------
    exposure : Exposure, optional
        Of the last image.
    renderer : FastRenderer
    """

    def __init__(
        self,
        dive: Dive,
        rig: Rig,
        parts: Sequence[PartMesh],
        mirrors: MovingJoints,
        quality: LightQuality | None = None,
    ):
        self.dive, self.rig, self.mirrors = dive, rig, mirrors
        self.renderer = FastRenderer(prepare(dive_scene(dive, rig), rig, parts, quality=quality))
        self.exposure: Exposure | None = None
        self._sensor = ImageSensor.from_rig(rig)
        card = self.renderer.scene.light.white_radiance(dive.depth_m)
        self._settings = settings_at_start(self._sensor, card)
        self._metered = metered_pixels(self._sensor)
        self._next = 0
        self._layout = Layout.from_rig(rig)
        # On the axis, a flat port turns an angle in the water into one larger by the index in the air.
        self._px_per_rad = rig.camera.fx_px * self.renderer.scene.light.n_water

    @property
    def next_time_s(self) -> float | None:
        """Time of the next image, None when there will be no more."""
        return None if self._next >= self.dive.frames else self._next / self.dive.frame_rate_hz

    def read(self, looked_at: NDArray[np.bool_] | None = None) -> CameraFrame | None:
        """Expose the next image; None when the dive is over.

        Parameters
        ----------
        looked_at : array, shape (height, width), optional
            Pixels that somebody looks at, with those beside them that their colours come from (`dives.looked_at`). Of
            the others nothing is rendered but those that are metered; these are as in the whole image.
        """
        time_s = self.next_time_s
        if time_s is None:
            return None
        half_s = ((self._sensor.height_px - 1) * self._sensor.row_time_s + self._settings.exposure_s) / 2
        self.mirrors.advance(time_s + half_s)
        opened, state, closed = self.states(np.array([-0.5, 0.0, 0.5]) * self._settings.exposure_s + time_s)
        smear_px = self._smear_px(opened, closed)
        sweeps = sweep_times(
            self._sensor,
            exposure_s=self._settings.exposure_s,
            start_s=time_s - half_s,
            # An odd number: one of them is the middle of the exposure.
            sweeps=sweep_count(motion_px=smear_px, step_px=STEP_PX, most=MOST_SWEEPS) | 1,
        )
        raw, label = self._exposed(sweeps, looked_at)
        image = develop(raw, self._sensor, WHOLE if looked_at is None else part_around(looked_at))
        self.exposure = Exposure(
            frame=self._next,
            time_s=time_s,
            start_s=time_s - half_s,
            end_s=time_s + half_s,
            settings=self._settings,
            state=state,
            label=label,
            smear_px=smear_px,
            sweeps=len(sweeps),
        )
        self._settings = next_settings(raw, self._sensor)
        self._next += 1
        return CameraFrame(image=image, time_s=time_s)

    def snapshot(self) -> dict[str, Any]:
        """State, as JSON holds it."""
        settings = self._settings
        return {
            "next": self._next,
            "exposure_s": settings.exposure_s,
            "gain_db": settings.gain_db,
            "white_gains": list(settings.white_gains),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a state."""
        red, green, blue = snapshot["white_gains"]
        self._next = snapshot["next"]
        self._settings = CameraSettings(
            exposure_s=snapshot["exposure_s"], gain_db=snapshot["gain_db"], white_gains=(red, green, blue)
        )

    def states(self, times_s: FloatArray) -> list[State]:
        """Where everything is at times, shape (n,)."""
        joints = self.mirrors.q(times_s).tolist()
        bodies, targets = body_pose(self.dive, times_s), target_pose(self.dive, times_s)
        decoys = [decoy_pose(self.dive, decoy, times_s) for decoy in self.dive.decoys]
        return [
            State(
                q1=q1,
                q2=q2,
                world_from_body=bodies[k],
                world_from_target=targets[k],
                world_from_decoys=tuple(poses[k] for poses in decoys),
                time_s=time_s,
            )
            for k, ((q1, q2), time_s) in enumerate(zip(joints, times_s.tolist(), strict=True))
        ]

    def _exposed(self, sweeps: FloatArray, looked_at: NDArray[np.bool_] | None) -> tuple[RawImage, NDArray[np.uint8]]:
        """Raw image of sweeps between two instants each, and what the pixels of the middle one show."""
        rays = pixels = None
        if looked_at is not None:
            rays, pixels = self.renderer.rays_of(looked_at | self._metered)
        instants = np.stack([sweeps[:, 0], sweeps.mean(axis=1), sweeps[:, 1]], axis=1)
        states = self.states(instants.ravel())
        key = frame_key(self.dive.seed, self._next)
        with woken_threads():
            # Points, normals and distances of every pixel stay where they are: handing them over takes half as long as
            # the frame.
            rendered = [
                self.renderer.sweep_arrays(states[k : k + 3], truth=False, chosen=rays)
                for k in range(0, len(states), 3)
            ]
            # Scattered light is a difference of two fields, and may come out below nothing where it is dark.
            raw = read_out([arrays.rgb for arrays in rendered], self._sensor, self._settings, key, pixels)
        label = np.zeros(self.renderer.shape, dtype=np.uint8)
        label.ravel()[slice(None) if pixels is None else pixels] = rendered[len(sweeps) // 2].label.numpy()
        return raw, label

    def _smear_px(self, opened: State, closed: State) -> float:
        """How far the view moves while one row is exposed, pixels: mirrors, robot and target, at most.

        Angles on the axis; where they add up, they are added.
        """
        gaze = forward_gaze(self._layout, *np.array([(opened.q1, opened.q2), (closed.q1, closed.q2)]).T)
        bodies = [_matrix(state.world_from_body) for state in (opened, closed)]
        targets = [_matrix(state.world_from_target) for state in (opened, closed)]
        turned = float(Rotation.from_matrix(bodies[0][:3, :3].T @ bodies[1][:3, :3]).magnitude())
        seen = np.array([target[:3, 3] - body[:3, 3] for body, target in zip(bodies, targets, strict=True)])
        # Panned, the image turns about its own axis as well: at its edge as fast as if it moved along.
        swept = max(_angle(gaze.direction), abs(closed.q1 - opened.q1))
        return float((swept + turned + _angle(seen)) * self._px_per_rad)


def dive_scene(dive: Dive, rig: Rig) -> Scene:
    """World, water, light, target and decoys of a dive; all where they are at its beginning."""
    start = np.add(target_pose(dive, 0.0).translation, [0.0, 0.0, dive.depth_m])
    scene = make_scene(
        rig,
        world=dive.world,
        depth_m=dive.depth_m,
        **above_water(dive),
        wind=Wind(speed_m_per_s=dive.wind.speed_m_per_s, azimuth_deg=dive.wind.azimuth_deg),
        target=dive.target.load_shape(),
        target_m=start,
        snow=dive.snow,
        seed=dive.world_seed,
    )
    decoys = (Target(shape=decoy.load_shape(), world_from_target=decoy_pose(dive, decoy, 0.0)) for decoy in dive.decoys)
    return replace(scene, decoys=tuple(decoys))


def _matrix(pose: RigidTransform | None) -> FloatArray:
    assert pose is not None  # a dive knows all poses
    return np.asarray(pose.as_matrix())


def _angle(vectors: FloatArray) -> float:
    """Angle between two vectors, shape (2, 3), radians."""
    first, second = vectors
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
