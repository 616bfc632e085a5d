"""Scenes of a data set: what is lit once, and what its samples are placed in and rendered with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.assembly.meshes import rig_meshes
from dives.checks import bounding_radius_m
from dives.datasets.dataset import Dataset, water_of
from dives.specification import DiveThing
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh, Role, merge
from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.light.sun import Sun
from scenes.light.waves import Wind
from scenes.renderer import FastRenderer
from scenes.sensor import ImageSensor
from scenes.stage.clearance import Clearance
from scenes.stage.scene import Scene, Target, make_scene


@dataclass(frozen=True, eq=False)
class DatasetScene:
    """A scene of a data set.

    Attributes
    ----------
    dataset : Dataset
    number : int
        Among the set's scenes.
    values : dict of str to value
        What makes it, by dotted key.
    rig : Rig
        In the scene's water.
    stage : Scene
    """

    dataset: Dataset
    number: int
    values: dict[str, Any]
    rig: Rig
    stage: Scene

    @cached_property
    def layout(self) -> Layout | None:
        """Frames of a rig with mirrors."""
        return None if self.rig.gaze is None else Layout.from_rig(self.rig)

    @cached_property
    def parts(self) -> list[PartMesh]:
        """Hull and mount; none for a rig without mirrors."""
        return [] if self.rig.gaze is None else list(rig_meshes(self.rig))

    @cached_property
    def hull_radius_m(self) -> float:
        """Of the ball about the robot's origin that holds its hull."""
        hull = [part for part in self.parts if part.role == Role.HULL]
        return float(np.linalg.norm(merge(hull)[0], axis=1).max()) if hull else 0.0

    @cached_property
    def clearance(self) -> Clearance:
        """How far the world keeps from places."""
        return Clearance(self.stage.world)

    @cached_property
    def renderer(self) -> FastRenderer:
        """Renderer of the images; the scene is lit for it."""
        image = self.dataset.spec.image
        return self._renderer(image.samples_per_pixel)

    @cached_property
    def exact_renderer(self) -> FastRenderer:
        """Renderer of one ray through each pixel's centre, which geometry is known of."""
        return self.renderer if self.renderer.samples == 1 else self._renderer(1)

    @cached_property
    def sensor(self) -> ImageSensor:
        """Image sensor at the images' size."""
        rows, columns = self.renderer.shape
        return ImageSensor.from_rig(self.rig, width_px=columns, height_px=rows)

    @cached_property
    def card_radiance(self) -> FloatArray:
        """Radiance of a white card at the scene's depth."""
        return np.asarray(self.stage.light.white_radiance(self.stage.depth_m))

    @cached_property
    def _lit(self) -> Any:
        return prepare(self.stage, self.rig, self.parts, quality=self.dataset.quality)

    def _renderer(self, samples: int) -> FastRenderer:
        image = self.dataset.spec.image
        return FastRenderer(self._lit, width_px=image.width_px, height_px=image.height_px, samples=samples)


def scene_of(dataset: Dataset, number: int) -> DatasetScene:
    """Scene of a number; nothing is lit yet."""
    values = dataset.grid.scene(number)
    rig = dataset.rigs[values["scene.rig"]]
    rig = rig.model_copy(update={"water": water_of(rig, values["scene.water"])})
    stage = make_scene(
        rig,
        world=values["scene.world"],
        depth_m=values["scene.depth_m"],
        sun=Sun(elevation_deg=values["scene.sun.elevation_deg"], azimuth_deg=values["scene.sun.azimuth_deg"]),
        cloud=values["scene.cloud"],
        wind=Wind(speed_m_per_s=values["scene.wind.speed_m_per_s"], azimuth_deg=values["scene.wind.azimuth_deg"]),
        target=DiveThing(shape=values["target.shape"], colour=values["target.colour"]).load_shape(),
        # Samples say where it is.
        target_m=(0.0, 0.0, -1.0),
        snow=values["scene.snow"],
        seed=values["scene.world_seed"],
    )
    decoys = tuple(
        Target(
            shape=DiveThing(shape=each.shape, diameter_m=each.diameter_m, colour=each.colour).load_shape(),
            world_from_target=RigidTransform.identity(),
        )
        for each in dataset.spec.decoys
    )
    return DatasetScene(dataset, number, values, rig, replace(stage, decoys=decoys))


def radii_m(scene: DatasetScene) -> list[float]:
    """Radii of balls that hold the target, as the scene has it, and each decoy, about their origins."""
    things = [scene.stage.target, *scene.stage.decoys]
    return [bounding_radius_m(each.shape) for each in things if each is not None]
