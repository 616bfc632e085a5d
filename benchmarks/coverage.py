"""Coverage with the mount in the way, against the same occlusion done with trimesh and embreex, pose by pose."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform
from trimesh.ray.ray_pyembree import RayMeshIntersector

from cad.assembly.meshes import rig_meshes
from optics.coverage.coverage import compute_coverage, stepped_joints
from optics.coverage.field import SKIN_M
from optics.coverage.outcome import Outcome
from optics.kernels.arrays import FloatArray, to_columns
from optics.kernels.backend import Array3f64, Bool
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role, merge
from optics.occlusion import Occluder, blocks
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

RIG = "aqua2"
POSES_PER_JOINT = 91
PEER_POSES_PER_JOINT = 9
"""The peer is timed on every tenth pose of each joint: all of them would take minutes."""
COLUMNS, ROWS = 64, 48
REPEATS = 3

STEP_DEG = 1.0
HULL_SPLITS = (3, 4)
"""Times that every triangle of the hull is split into four: to some 300 thousand and more than a million."""

LocalRays = dict[Group, tuple[FloatArray, FloatArray]]
"""Origins and directions of the same rays in the frame of each group."""


def run() -> list[dict[str, Any]]:
    """Rows for the table: occlusion alone on the same rays, then whole chains from pixel to open water."""
    rig = Rig.load(RIG)
    parts = rig_meshes(rig)
    return [_occlusion(rig, parts), _chains(rig, parts), *(_large_hull(parts, splits) for splits in HULL_SPLITS)]


def _occlusion(rig: Rig, parts: Sequence[PartMesh]) -> dict[str, Any]:
    layout = Layout.from_rig(rig)
    poses = [_rays_beyond_m2(rig, layout, q1, q2) for q1, q2 in _pose_list(rig, PEER_POSES_PER_JOINT)]
    rays: LocalRays = {}
    for group in Group:
        origins, directions = zip(*(pose[group] for pose in poses), strict=True)
        rays[group] = np.concatenate(origins), np.concatenate(directions)
    ours = _our_occluders(parts)
    peers = _peer_occluders(parts)
    our_time, our_flags = _best(lambda: _blocked_by_ours(ours, rays))
    peer_time, peer_flags = _best(lambda: _blocked_by_peer(peers, rays))
    tests = sum(len(origin) for origin, _ in rays.values())
    different = np.count_nonzero(our_flags != peer_flags)
    if different:
        raise RuntimeError(f"occlusion: expected the same flags as embreex, got {different} of {len(our_flags)} others")
    return _row(
        "occlusion, rays against meshes",
        tests / our_time / 1e6,
        tests / peer_time / 1e6,
        "M rays/s",
        f"peer: trimesh + embreex; {tests} rays, any hit, NumPy in and out; none of {len(our_flags)} flags differs",
    )


def _chains(rig: Rig, parts: Sequence[PartMesh]) -> dict[str, Any]:
    layout = Layout.from_rig(rig)
    grid = _joint_values(rig, POSES_PER_JOINT)
    our_time, found = _best(lambda: compute_coverage(rig, parts, q1=grid[0], q2=grid[1], columns=COLUMNS, rows=ROWS))
    peers = _peer_occluders(parts)
    poses = _pose_list(rig, PEER_POSES_PER_JOINT)

    def by_pose() -> int:
        return sum(int((~_blocked_by_peer(peers, _rays_beyond_m2(rig, layout, q1, q2))).sum()) for q1, q2 in poses)

    peer_time, _ = _best(by_pose)
    pixels = COLUMNS * ROWS
    return _row(
        "coverage, pose-pixel chains",
        POSES_PER_JOINT**2 * pixels / our_time / 1e6,
        len(poses) * pixels / peer_time / 1e6,
        "M chains/s",
        f"{POSES_PER_JOINT}^2 poses in {our_time:.2f} s, {100 * found.covered_fraction:.1f} % of the sphere covered; "
        f"peer: our trace pose by pose, then trimesh + embreex behind M2 only; "
        f"{100 * found.pixels[..., Outcome.SEEN].sum() / found.pixels.sum():.1f} % of the chains reach the water",
    )


def _large_hull(parts: Sequence[PartMesh], splits: int) -> dict[str, Any]:
    """Full coverage at one degree with a subdivided hull, in a process of its own, so that its memory can be told."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        measured = pool.submit(_full_coverage, [_split_hull(part, splits) for part in parts]).result()
        plain = pool.submit(_full_coverage, parts).result()
    row = _row(
        f"coverage at 1 degree, hull of {measured['triangles'] / 1000:.0f} k triangles",
        measured["time_s"],
        plain["time_s"],
        "s",
        f"peer: ours with the plain hull of {plain['triangles'] / 1000:.1f} k; {measured['poses']} poses x "
        f"{COLUMNS * ROWS} rays; building the search tree and compiling included; "
        f"processor time {measured['processor_s']:.1f} and {plain['processor_s']:.1f} s, "
        f"process at most {measured['memory_gb']:.2f} GB",
    )
    return row | {"ratio": plain["time_s"] / measured["time_s"]}


def _full_coverage(parts: Sequence[PartMesh]) -> dict[str, float]:
    rig = Rig.load(RIG)
    q1, q2 = stepped_joints(rig, STEP_DEG)
    start, processor = time.perf_counter(), time.process_time()
    compute_coverage(rig, parts, q1=q1, q2=q2, columns=COLUMNS, rows=ROWS)
    return {
        "time_s": time.perf_counter() - start,
        "processor_s": time.process_time() - processor,
        "poses": len(q1) * len(q2),
        "triangles": sum(len(part.faces) for part in parts if part.role is Role.HULL),
        "memory_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
    }


def _split_hull(part: PartMesh, splits: int) -> PartMesh:
    if part.role is not Role.HULL:
        return part
    vertices, faces = part.vertices_m, part.faces
    for _ in range(splits):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return replace(part, vertices_m=vertices, faces=faces.astype(np.int32))


def _row(name: str, ours: float, peer: float, unit: str, note: str) -> dict[str, Any]:
    return {"name": name, "ours": ours, "peer": peer, "unit": unit, "ratio": ours / peer, "note": note}


def _best(work: Callable[[], Any]) -> tuple[float, Any]:
    """Shortest time of a few runs, seconds, after one that compiles; and the result."""
    result = work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
    return min(times), result


def _joint_values(rig: Rig, count: int) -> tuple[FloatArray, FloatArray]:
    return rig.gaze.joints.pan.values(count), rig.gaze.joints.tilt.values(count)


def _pose_list(rig: Rig, count: int) -> list[tuple[float, float]]:
    q1, q2 = _joint_values(rig, count)
    return [(float(a), float(b)) for b in q2 for a in q1]


def _rays_beyond_m2(rig: Rig, layout: Layout, q1: float, q2: float) -> LocalRays:
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    rays = train.trace(pixel_grid(train.camera, COLUMNS, ROWS))
    seen = rays.status == Status.OK
    direction = layout.body_from_camera.rotation.apply(rays.direction[seen])
    origin = layout.body_from_camera.apply(rays.origin_m[seen]) + SKIN_M * direction
    frames = {
        Group.FIXED: RigidTransform.identity(),
        Group.PAN: layout.body_from_pan(q1).inv(),
        Group.TILT: layout.body_from_m2(q1, q2).inv(),
    }
    return {group: (pose.apply(origin), pose.rotation.apply(direction)) for group, pose in frames.items()}


def _our_occluders(parts: Sequence[PartMesh]) -> dict[Group, Any]:
    return {group: Occluder.of_group(parts, group).parameters() for group in Group}


def _peer_occluders(parts: Sequence[PartMesh]) -> dict[Group, RayMeshIntersector]:
    occluders = {}
    for group in Group:
        vertices, faces, _ = merge(part for part in parts if part.group is group)
        occluders[group] = RayMeshIntersector(trimesh.Trimesh(vertices, faces, process=False))
    return occluders


def _blocked_by_ours(occluders: dict[Group, Any], rays: LocalRays) -> NDArray[np.bool_]:
    flags = []
    for group in Group:
        origin, direction = (Array3f64(*to_columns(array)) for array in rays[group])
        flags.append(blocks(occluders[group], origin, direction, np.inf, Bool(True)))
    return np.array(flags[0] | flags[1] | flags[2])


def _blocked_by_peer(occluders: dict[Group, RayMeshIntersector], rays: LocalRays) -> NDArray[np.bool_]:
    return np.asarray(np.any([occluders[group].intersects_any(*rays[group]) for group in Group], axis=0))
