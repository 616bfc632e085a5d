"""A lit scene: a rig in a world, with all the light that is found once and kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.assembly.meshes import rig_meshes
from optics.kernels.arrays import FloatArray
from optics.kernels.packing import vectors
from optics.layout import Layout, camera_pose
from optics.mesh import PartMesh
from rigs import Rig
from scenes.baking.ambient import NotKeptError, kept_light_alone
from scenes.baking.light_quality import LightQuality
from scenes.baking.robot_light import RobotLight
from scenes.baking.robot_occlusion import at_rest, with_occlusion
from scenes.baking.robot_shadow_in_water import folded_begins, shadow_in_water
from scenes.baking.robot_shadow_on_world import shadow_on_world
from scenes.baking.source_volume import is_world_lit, lit_world
from scenes.kernels.geometry import Geometry, geometry_of
from scenes.kernels.shadow_table import ShadowTable
from scenes.kernels.state_records import StateRecords
from scenes.kernels.tracing import Primitive
from scenes.kernels.veiling_light import AZIMUTHS, ELEVATIONS
from scenes.light.lamps import LampUniforms
from scenes.light.uniforms import LightTables, LightUniforms
from scenes.stage.frame import Label
from scenes.stage.group_mesh import (
    GroupMesh,
    mirror_plates,
    rig_meshes_by_group,
    snow_mesh,
    target_mesh,
    world_mesh,
)
from scenes.stage.records import SNOW, TARGET, WORLD, MirrorPlate, decoy_group
from scenes.stage.scene import Scene
from scenes.stage.state import State
from scenes.stage.targets import MeshShape, meshed

Lit = TypeVar("Lit")


@dataclass(frozen=True, kw_only=True, eq=False)
class LitScene:
    """A rig in a world, lit: what renderers of all sizes share.

    Attributes
    ----------
    rig : Rig
    scene : Scene
    instance_names : tuple of str
        Names of the parts, of what is in the world, of the target and of decoys, by their number in `Frame.instance`.
    records : StateRecords
    geometry : Geometry
        What rays hit, and what robot and world change of the light around them.
    tables : LightTables
    lamps : LampUniforms, optional
    """

    rig: Rig
    scene: Scene
    instance_names: tuple[str, ...]
    records: StateRecords
    geometry: Geometry
    tables: LightTables
    lamps: LampUniforms | None

    def uniforms(self, depth_m: float) -> LightUniforms:
        """Light for a robot at a depth."""
        return replace(self.scene.sea.uniforms(depth_m), lamps=self.lamps)


def prepare(
    scene: Scene,
    rig: Rig,
    parts: Sequence[PartMesh] | None = None,
    *,
    quality: LightQuality | None = None,
    full_if_kept: bool = False,
) -> LitScene:
    """Light a scene: from the cache, or in seconds to minutes.

    Parameters
    ----------
    scene : Scene
        World, light, and where robot and target are unless a state says otherwise.
    rig : Rig
    parts : sequence of PartMesh, optional
        Hull and mount as triangles, may be empty; by default those that are built for the rig, none for a rig without
        mirrors.
    quality : LightQuality, optional
        Full by default.
    full_if_kept : bool
        Take full light instead where the cache has it: for a look, which need not be the same tomorrow.
    """
    quality = quality or LightQuality.full()
    found = _full_if_kept if full_if_kept else _as_asked
    if parts is None:
        parts = rig_meshes(rig) if rig.gaze is not None else []
    meshes, names = rig_meshes_by_group(parts)
    things = (*names, *scene.world.instance_names, TARGET)
    decoys = tuple(decoy_group(number) for number in range(len(scene.decoys)))
    records = StateRecords(rig, scene, target_instance=len(things))
    in_water = on_world = irradiance = source = None
    if meshes:
        parted = meshes
        meshes, in_water, on_world = found(lambda q: _robot(parts, scene, records, parted, q), quality)
    if len(scene.world.faces):
        world = world_mesh(scene.world, len(names))
        meshes[WORLD], source, irradiance = found(lambda q: lit_world(world, scene.light, q), quality)
    geometry = replace(
        geometry_of(meshes | _unlit(scene, len(things) - 1), scene.light.towards_sun),
        irradiance=irradiance,
        source=source,
        shadow_in_water=in_water,
        shadow_on_world=on_world,
        eyes=vectors(_eyes(rig)),
    )
    return LitScene(
        rig=rig,
        scene=scene,
        instance_names=things + decoys,
        records=records,
        geometry=geometry,
        tables=scene.sea.tables(),
        lamps=LampUniforms.of(rig.lamps, scene.light.bands.wavelength_nm) if rig.lamps else None,
    )


def prepare_from_cache(scene: Scene, rig: Rig, parts: Sequence[PartMesh] | None = None) -> LitScene | None:
    """As `prepare` lights a scene in full, when all of its light is in the cache; else None, at once."""
    try:
        with kept_light_alone():
            return prepare(scene, rig, parts)
    except NotKeptError:
        return None


def is_long_to_light(scene: Scene) -> bool:
    """Whether the full light of a scene's world has to be found: it takes longer than a robot's."""
    world = scene.world
    return len(world.faces) > 0 and not is_world_lit(world_mesh(world, 0), scene.light, LightQuality.full())


def _as_asked(lit: Callable[[LightQuality], Lit], quality: LightQuality) -> Lit:
    return lit(quality)


def _full_if_kept(lit: Callable[[LightQuality], Lit], quality: LightQuality) -> Lit:
    with suppress(NotKeptError), kept_light_alone():
        return lit(LightQuality.full())
    return lit(quality)


def _robot(
    parts: Sequence[PartMesh], scene: Scene, records: StateRecords, meshes: dict[str, GroupMesh], quality: LightQuality
) -> tuple[dict[str, GroupMesh], Any, ShadowTable]:
    """The robot's groups with the light that reaches them, and its shadows in the water and on the world."""
    placed = at_rest(scene.world_from_body)
    body_from = records.body_from([State()])
    poses = {group: RigidTransform.from_matrix(matrix) for group, (matrix,) in body_from.items()}
    mirrors = {name: batch[0] for name, batch in records.mirrors(body_from).items()}
    plates = mirror_plates(parts, poses, mirrors)
    meshes, robot, dark = with_occlusion(meshes, poses, plates, scene.light, quality, world_from_body=placed)
    around = RobotLight(robot, scene.light, quality, dark)
    in_water = shadow_in_water(around, placed, _line_begins(records.rig, mirrors))
    return meshes, in_water, shadow_on_world(around, placed)


def _unlit(scene: Scene, target_instance: int) -> dict[str, GroupMesh]:
    """What moves in the scene: it is lit in every frame. The decoys' instances follow the target's."""
    meshes = {}
    if scene.target is not None and isinstance(scene.target.shape, MeshShape):
        meshes[TARGET] = target_mesh(scene.target.shape, target_instance)
    for number, decoy in enumerate(scene.decoys):
        meshes[decoy_group(number)] = target_mesh(meshed(decoy.shape), target_instance + 1 + number, Label.DECOY)
    if scene.snow is not None:
        meshes[SNOW] = snow_mesh(scene.snow)
    return meshes


def _eyes(rig: Rig) -> FloatArray:
    """Where lines of sight begin, body frame: the camera, and the mirrors' centres; shape (1 or 3, 3)."""
    eyes = [camera_pose(rig.camera).translation]
    if rig.gaze is not None:
        layout = Layout.from_rig(rig)
        eyes += [layout.body_from_m1.translation, layout.body_from_gimbal.translation]
    return np.array(eyes)


def _line_begins(rig: Rig, mirrors: dict[str, MirrorPlate]) -> FloatArray:
    """Where each eye's lines of sight begin, by direction (`scenes.baking.robot_shadow_in_water`), body frame."""
    eyes = _eyes(rig)
    begins = np.repeat(eyes[:, np.newaxis], ELEVATIONS * AZIMUTHS, axis=1)
    if mirrors:
        begins[1] = folded_begins(eyes[0], mirrors[Primitive.M1.name])
    return begins
