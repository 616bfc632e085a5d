"""Objects of a data set as BOP knows them: a number for each shape, colour and size, and its model in millimetres."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist
from scipy.spatial.transform import RigidTransform

from dives.datasets.dataset import Dataset
from dives.specification import DiveThing
from optics.kernels.arrays import FloatArray
from optics.kernels.ray_scene import mesh_scene
from optics.mesh import double_area_vectors
from optics.train import Rays
from rigs.atomic_files import write_text
from scenes.stage.targets import Ball, TargetShape, meshed
from scenes.truth.silhouette import meets_ball, meets_mesh

Key = tuple[str, str | None, float | None]
"""Shape, colour and diameter, as a data set's file says them."""

MODELS = "bop/models"
DECIMALS = 6
"""Of a millimetre."""


@dataclass(frozen=True, eq=False)
class BopObject:
    """Something whose pose is told.

    Attributes
    ----------
    number : int
        BOP's `obj_id`, from 1.
    name : str
    shape : TargetShape
        In its own frame: x forward, z up, the origin in the middle of its bounding box.
    """

    number: int
    name: str
    shape: TargetShape

    @cached_property
    def _ray_scene(self) -> Any:
        mesh = meshed(self.shape).surface
        return mesh_scene(mesh.vertices_m, mesh.faces)

    def met_by(self, rays: Rays, pose: RigidTransform) -> NDArray[np.bool_]:
        """Which rays meet it at a pose in their frame, shape (n,)."""
        if isinstance(self.shape, Ball):
            return meets_ball(rays, pose.translation, self.shape.radius_m)
        return meets_mesh(rays, self._ray_scene, pose)


def bop_objects(dataset: Dataset) -> dict[Key, BopObject]:
    """Objects that the file of a set names: the target's first, then the decoys'; more samples change none."""
    target = dataset.spec.target
    diameters = (None,) if target.diameter_m is None else target.diameter_m.all_values() or ()
    keys: list[Key] = list(product(target.shape, target.colour or (None,), diameters))
    keys += [(each.shape, each.colour, each.diameter_m) for each in dataset.spec.decoys]
    return {key: _object(number, key) for number, key in enumerate(dict.fromkeys(keys), 1)}


def write_models(folder: Path, objects: Iterable[BopObject]) -> list[str]:
    """Write the models as PLY and `models_info.json`; returns the files' names."""
    (folder / MODELS).mkdir(parents=True, exist_ok=True)
    names, infos = [], {}
    for each in objects:
        names.append(f"{MODELS}/obj_{each.number:06d}.ply")
        mesh = meshed(each.shape).surface
        vertices_mm = 1000 * mesh.vertices_m
        write_text(folder / names[-1], _ply(vertices_mm, mesh.faces))
        infos[str(each.number)] = {"name": each.name} | _extent(vertices_mm) | _symmetries(each.shape)
    names.append(f"{MODELS}/models_info.json")
    write_text(folder / names[-1], json.dumps(infos, indent=2) + "\n")
    return names


def _object(number: int, key: Key) -> BopObject:
    shape, colour, diameter_m = key
    thing = DiveThing.model_validate({"shape": shape, "colour": colour, "diameter_m": diameter_m})
    name = thing.name if diameter_m is None else f"{thing.name}, {diameter_m:g} m"
    return BopObject(number, name, thing.load_shape())


def _extent(vertices_mm: FloatArray) -> dict[str, float]:
    low, size = vertices_mm.min(axis=0), np.ptp(vertices_mm, axis=0)
    diameter = pdist(vertices_mm[ConvexHull(vertices_mm).vertices]).max()
    found = {"diameter": diameter}
    found |= {f"min_{axis}": value for axis, value in zip("xyz", low, strict=True)}
    found |= {f"size_{axis}": value for axis, value in zip("xyz", size, strict=True)}
    return {name: round(float(value), DECIMALS) for name, value in found.items()}


def _symmetries(shape: TargetShape) -> dict[str, Any]:
    """A ball is the same from everywhere: BOP knows turns about an axis, so that all three are told."""
    if not isinstance(shape, Ball):
        return {}
    return {"symmetries_continuous": [{"axis": axis, "offset": [0, 0, 0]} for axis in np.eye(3).astype(int).tolist()]}


def _ply(vertices_mm: FloatArray, faces: NDArray[np.int32]) -> str:
    """ASCII PLY with normals, those of a vertex the mean of its faces' by area."""
    normals = np.zeros_like(vertices_mm)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], double_area_vectors(vertices_mm[faces]))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    rows = np.hstack([vertices_mm, normals]).tolist()
    return (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices_mm)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join(" ".join(f"{value:.{DECIMALS}f}" for value in row) + "\n" for row in rows)
        + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces.tolist())
    )
