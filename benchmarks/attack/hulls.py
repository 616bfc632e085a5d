"""Hull files of every format, damaged; an accepted one is taken for a vehicle, and closed to a solid now and then."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.attack.mutations import damaged_bytes
from benchmarks.attack.verdicts import LostError

NAME = "hulls"
GOAL = 2_000

SOLIDS = 0.1
"""Share of the accepted files of which a solid is made."""

MESHES = ("hull.stl", "hull.ply", "hull.obj", "hull.glb", "hull.gltf", "hull.dae", "hull.3mf", "plain.stl")
IN_METRES = (".glb", ".gltf", ".dae")
LENGTH_MM, RADIUS_MM = 1200.0, 150.0

URDF = """<?xml version="1.0"?>
<robot name="auv"><link name="base_link">
  <inertial><mass value="40"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <visual><origin xyz="0 0 0.1" rpy="0 0 0"/>
    <geometry><mesh filename="hull.stl" scale="0.001 0.001 0.001"/></geometry></visual>
</link>
<link name="camera"/><joint name="j" type="fixed"><parent link="base_link"/><child link="camera"/>
  <origin xyz="0.6 0 0" rpy="0 0.2 0"/></joint></robot>
"""
SDF = """<?xml version="1.0"?>
<sdf version="1.7"><model name="auv"><link name="base_link"><pose>0 0 0.1 0 0 0</pose>
  <visual name="v"><geometry><mesh><uri>hull.stl</uri><scale>0.001 0.001 0.001</scale></mesh></geometry></visual>
  <sensor name="camera" type="camera"><pose>0.6 0 0 0 0 0</pose></sensor>
</link></model></sdf>
"""


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: the same small vehicle in every format."""
    from cad.hulls.files.taken import take_hull
    from cad.hulls.files.triangles import read_hull_file

    contents = written_hulls(folder)
    for name in contents:
        take_hull(read_hull_file(folder / name)).describe()

    def case(rng: random.Random) -> None:
        name = rng.choice(sorted(contents))
        # A file of its own each time, in a folder with the meshes that robots' descriptions name.
        attacked = folder / f"attacked{Path(name).suffix}"
        attacked.write_bytes(damaged_bytes(contents[name], rng))
        try:
            look_at(attacked, rng)
        finally:
            attacked.unlink()

    return case


def look_at(file: Path, rng: random.Random) -> None:
    """What `mirrorgaze new --hull` asks of a file."""
    from cad.hulls.files.taken import take_hull
    from cad.hulls.files.triangles import read_hull_file

    taken = take_hull(read_hull_file(file), unit=None if rng.random() < 0.5 or _says_unit(file) else "mm")
    list(taken.describe())
    if not np.isfinite(taken.found.vertices).all() or not np.isfinite(taken.size_mm).all():
        raise LostError(f"{file.name} is taken with corners that are no numbers")
    if rng.random() < SOLIDS:
        _close(file, taken)


def written_hulls(folder: Path) -> dict[str, bytes]:
    """Write the vehicle in every format; contents by name."""
    import build123d
    import trimesh

    body = trimesh.creation.capsule(LENGTH_MM - 2 * RADIUS_MM, RADIUS_MM, count=[8, 8])
    body.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    fin = trimesh.creation.box((120, 20, 300))
    fin.apply_translation([-450, 0, 250])
    hull = trimesh.util.concatenate([body, fin])
    metres = hull.copy().apply_scale(0.001)
    for name in MESHES:
        vehicle = metres if name.endswith(IN_METRES) else hull
        exported: Any = vehicle.export(file_type="stl_ascii" if name == "plain.stl" else Path(name).suffix[1:])
        # glTF comes with a file of its numbers.
        parts = exported if isinstance(exported, dict) else {name: exported}
        for part, content in parts.items():
            file = folder / (name if part == "model.gltf" else part)
            file.write_bytes(content.encode() if isinstance(content, str) else content)
    (folder / "hull.urdf").write_text(URDF)
    (folder / "hull.sdf").write_text(SDF)
    build123d.export_step(build123d.Box(LENGTH_MM, 2 * RADIUS_MM, 2 * RADIUS_MM), str(folder / "hull.step"))
    names = (*MESHES, "hull.urdf", "hull.sdf", "hull.step")
    return {name: (folder / name).read_bytes() for name in names}


def _says_unit(file: Path) -> bool:
    from rigs.files import FIXED_UNIT_SUFFIXES

    return file.suffix in FIXED_UNIT_SUFFIXES


def _close(file: Path, taken: Any) -> None:
    """Make a solid of a file; it is closed and of numbers."""
    from cad.hulls.hull_mesh import read_hull_solid
    from rigs.mounting import FileHull

    unit = {} if taken.unit is None else {"unit": taken.unit}
    solid = read_hull_solid(FileHull(shape="file", file=file, **unit)).surface
    if not solid.is_watertight or not np.isfinite(solid.vertices).all():
        raise LostError(f"the solid of {file.name} is open, or its corners are no numbers")
