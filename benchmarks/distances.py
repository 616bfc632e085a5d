"""`./run bench distances`: distances between parts of a mount by FCL, which the checks use, coal and manifold3d."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass

import coal
import manifold3d
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cad.assembly.meshes import rig_meshes
from cad.checks.clearance.bodies import Body
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh, Role
from rigs import Rig

POSES = 120
SEED = 0
TOLERANCE_MM = 1e-9
JUDGES = ("FCL", "coal", "manifold3d")


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A part for each of the three."""

    name: str
    size_mm: float
    body: Body
    tree: coal.BVHModelOBBRSS
    solid: manifold3d.Manifold


def main(arguments: Sequence[str]) -> int:
    """Measure pairs of parts at random poses; 1 when the distances differ by more than the tolerance."""
    parser = argparse.ArgumentParser(prog="./run bench distances", description=__doc__)
    parser.add_argument("--rig", default="aqua2", metavar="RIG", help="whose mount")
    parser.add_argument("--poses", type=int, default=POSES, metavar="N", help="random poses of two parts")
    options = parser.parse_args(arguments)
    # The hull's surface need not be closed, as manifold3d wants it; screws are many and alike.
    shapes = [_shape(part) for part in rig_meshes(Rig.load(options.rig)) if part.role in {Role.MOUNT, Role.SERVO}]
    print(
        f"{options.poses} poses of two of {len(shapes)} parts of {options.rig}, distances in mm by {', '.join(JUDGES)}"
    )
    rng = np.random.default_rng(SEED)
    measured = [_measured(shapes, rng) for _ in range(options.poses)]
    found, times_s = (np.array(rows) for rows in zip(*measured, strict=True))
    apart = found[:, 0] > 0
    print(
        f"{apart.sum()} are apart, by {found[apart, 0].min():.3f} to {found[apart, 0].max():.1f} mm; the others touch"
    )
    for judge, theirs_mm, column_s in zip(JUDGES, found.T, 1e3 * times_s.T, strict=True):
        differs = f"differs from FCL by at most {np.abs(theirs_mm - found[:, 0]).max():.1e} mm"
        print(f"{judge}: {differs}; {np.median(column_s):.2f} ms a distance, {column_s.max():.2f} at most")
    agree = bool(np.abs(found - found[:, :1]).max() <= TOLERANCE_MM)
    print("they agree" if agree else f"FAILED: expected differences of at most {TOLERANCE_MM:g} mm")
    return 0 if agree else 1


def _measured(shapes: Sequence[Shape], rng: np.random.Generator) -> tuple[list[float], list[float]]:
    """Distances by FCL, coal and manifold3d at one random pose, millimetres, and the time that each took."""
    here, there = (shapes[k] for k in rng.choice(len(shapes), 2, replace=False))
    turn = Rotation.random(rng=rng).as_matrix()
    # From one middle on the other to as far as both are large: some poses cross, some are close, some far.
    direction = Rotation.random(rng=rng).apply([1.0, 0.0, 0.0])
    between = rng.uniform(0.0, here.size_mm + there.size_mm) * direction
    shift_mm = here.body.vertices_mm.mean(axis=0) + between - turn @ there.body.vertices_mm.mean(axis=0)
    distances, times_s = [], []
    for measure in (_by_fcl, _by_coal, _by_manifold3d):
        start = time.perf_counter()
        distances.append(measure(here, there, turn, shift_mm))
        times_s.append(time.perf_counter() - start)
    return distances, times_s


def _by_fcl(here: Shape, there: Shape, turn: FloatArray, shift_mm: FloatArray) -> float:
    return here.body.gap_mm(there.body, turn, shift_mm)


def _by_coal(here: Shape, there: Shape, turn: FloatArray, shift_mm: FloatArray) -> float:
    identity, pose = coal.Transform3s.Identity(), coal.Transform3s(turn, shift_mm)
    distance = coal.distance(here.tree, identity, there.tree, pose, coal.DistanceRequest(), coal.DistanceResult())
    return max(float(distance), 0.0)


def _by_manifold3d(here: Shape, there: Shape, turn: FloatArray, shift_mm: FloatArray) -> float:
    # It searches up to a limit, and fast when that is close: no two corners are nearer than the surfaces.
    corners_mm = there.body.vertices_mm @ turn.T + shift_mm
    limit_mm = 1.01 * float(cKDTree(here.body.vertices_mm).query(corners_mm)[0].min())
    return float(here.solid.min_gap(there.solid.transform(np.column_stack([turn, shift_mm])), limit_mm))


def _shape(part: PartMesh) -> Shape:
    body = Body.of(part.name, [part])
    tree = coal.BVHModelOBBRSS()
    tree.beginModel(len(body.faces), len(body.vertices_mm))
    tree.addVertices(body.vertices_mm)
    tree.addTriangles(body.faces)
    tree.endModel()
    # In double precision: distances are to be compared to rounding.
    mesh = manifold3d.Mesh64(vert_properties=body.vertices_mm, tri_verts=body.faces.astype(np.uint64))
    return Shape(
        name=part.name,
        size_mm=float(np.ptp(body.vertices_mm, axis=0).max()),
        body=body,
        tree=tree,
        solid=manifold3d.Manifold(mesh),
    )
