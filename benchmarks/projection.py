"""Points per second: projection through port and two mirrors, beside the same Newton written in plain NumPy.

The rig is the aqua2, with a flat port and with a decentred dome; the points lie 0.2 to 10 m behind the gaze mirror.
Both codes unfold the mirrors, solve for the ray in the plane of refraction and give pixels. Ours takes Newton
steps until they have converged, and traces every point's ray forward for its status. `run` fails where the pixels
differ by more than 1e-6 px.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from optics.kernels import backend
from optics.kernels.arrays import FloatArray
from optics.ports.port import DomePort, FlatPort
from optics.status import Status
from optics.train import OpticalTrain, compiled_project
from rigs import Rig

Q1, Q2 = 0.3, 0.2
"""Pose of the mirrors, radians: neither along an axis nor symmetric."""

BATCHES = (1 << 14, 1 << 17, 1 << 20)
"""Points per call; each code is judged by its best."""

PATIENCE_S = 1.0
"""How long each batch size is repeated; the fastest repetition counts, the others met somebody else's work."""

PEER_STEPS = 6
"""Newton steps of the peer, which does not ask whether they were enough: six are, anywhere in a real port's field."""

PROMISE_PX = 1e-6


def run() -> list[dict[str, Any]]:
    """Rows of the table, in millions of points per second; a `RuntimeError` beyond 1e-6 px."""
    flat = OpticalTrain.from_rig(Rig.load("aqua2"), q1=Q1, q2=Q2)
    assert isinstance(flat.port, FlatPort)
    dome_port = DomePort(
        centre_m=(0.002, -0.003, -0.008),
        radius_m=0.05,
        thickness_m=0.006,
        n_port=flat.port.n_port,
        n_water=flat.port.n_water,
    )
    dome = replace(flat, port=dome_port)
    return [*_rows("flat port", flat, _plain_flat), *_rows("dome port", dome, _plain_dome)]


def _rows(name: str, train: OpticalTrain, aim: Callable[[Any, FloatArray], FloatArray]) -> list[dict[str, Any]]:
    points = _points(train, max(BATCHES))
    ours, peer = train.project(points), _plain_project(train, points, aim)
    difference = float(np.abs(ours.pixels - peer).max())
    if not (difference <= PROMISE_PX and (ours.status == Status.OK).all()):
        raise RuntimeError(f"{name}: expected pixels within {PROMISE_PX} px, got {difference:.2e} px apart")
    peer_rate = max(_rate(count, lambda p=points[:count]: _plain_project(train, p, aim)) for count in BATCHES)
    rows = []
    for how, prepare in (("Dr.Jit arrays", _dr_jit), ("NumPy arrays", _numpy)):
        rate = max(_rate(count, prepare(train, points[:count])) for count in BATCHES)
        rows.append(
            {
                "name": f"projection, {name} and two mirrors, {how}",
                "ours": rate / 1e6,
                "peer": peer_rate / 1e6,
                "unit": "M points/s",
                "ratio": rate / peer_rate,
                "note": f"peer: plain NumPy, {PEER_STEPS} Newton steps; pixels differ by at most {difference:.1e} px",
            }
        )
    return rows


def _points(train: OpticalTrain, count: int) -> FloatArray:
    """What random pixels of the gaze region see, as many near as far."""
    rng = np.random.default_rng(1)
    pixels = rng.uniform([0, 0], [train.camera.width_px - 1, train.camera.height_px - 1], (8 * count, 2))
    rays = train.trace(pixels)
    seen = np.flatnonzero(rays.status == Status.OK)[:count]
    reach = np.exp(rng.uniform(np.log(0.2), np.log(10), (len(seen), 1)))
    return np.ascontiguousarray(rays.origin_m[seen] + reach * rays.direction[seen])


def _rate(count: int, work: Callable[[], object]) -> float:
    fastest, stop = np.inf, time.perf_counter() + PATIENCE_S
    work()
    while time.perf_counter() < stop:
        start = time.perf_counter()
        work()
        fastest = min(fastest, time.perf_counter() - start)
    return count / fastest


def _dr_jit(train: OpticalTrain, points: FloatArray) -> Callable[[], object]:
    """Kernel alone: its inputs are there, its outputs stay there."""
    dr, parameters, kernel = backend.dr, train.parameters(), compiled_project(*train.kind)
    columns = backend.Array3f64(*(backend.Float64(np.ascontiguousarray(column)) for column in points.T))

    def work() -> None:
        dr.eval(kernel(parameters, columns))
        dr.sync_thread()

    return work


def _numpy(train: OpticalTrain, points: FloatArray) -> Callable[[], object]:
    """Public function: NumPy in, NumPy out."""
    return lambda: train.project(points)


def _plain_project(train: OpticalTrain, points: FloatArray, aim: Callable[[Any, FloatArray], FloatArray]) -> FloatArray:
    for mirror in reversed(train.mirrors):
        points = mirror.reflection.apply(points)
    x, y, z = aim(train.port, points).T
    camera = train.camera
    return np.stack([camera.fx_px * x / z + camera.cx_px, camera.fy_px * y / z + camera.cy_px], axis=1)


def _plain_flat(port: FlatPort, points: FloatArray) -> FloatArray:
    """Newton on the sine in the air: sum of the layers' radii equals the point's; the normal is the camera's z."""
    assert tuple(np.asarray(port.normal)) == (0, 0, 1)
    radius = np.hypot(points[:, 0], points[:, 1])
    depth = points[:, 2] - port.distance_m - port.thickness_m
    layers = [(port.distance_m, 1.0), (port.thickness_m, port.n_inside / port.n_port)]
    layers.append((depth, port.n_inside / port.n_water))
    slope = radius / sum(length * ratio for length, ratio in layers)
    for _ in range(PEER_STEPS):
        reached, rate, secant2 = 0.0, 0.0, 1 + slope * slope
        for length, ratio in layers:
            root = 1 / np.sqrt(secant2 - (ratio * slope) ** 2)
            reached = reached + length * ratio * slope * root
            rate = rate + length * ratio * root**3
        slope = np.maximum(slope + (radius - reached) / rate, 0)
    outwards = slope / np.where(radius > 0, radius, 1)
    return np.stack([points[:, 0] * outwards, points[:, 1] * outwards, np.ones(len(points))], axis=1)


def _plain_dome(port: DomePort, points: FloatArray) -> FloatArray:
    """Newton on the angle at the pinhole: the polar angle swept around the centre equals the point's."""
    centre = np.asarray(port.centre_m)
    offset = float(np.linalg.norm(centre))
    axis = -centre / offset
    radial = points - centre
    distance = np.linalg.norm(radial, axis=1)
    along = radial @ axis
    sideways = radial - along[:, np.newaxis] * axis
    across = np.linalg.norm(sideways, axis=1)
    target = np.arctan2(across, along)
    inner, outer = port.radius_m, port.radius_m + port.thickness_m
    passages = [
        (inner, port.n_inside, -1),
        (inner, port.n_port, 1),
        (outer, port.n_port, -1),
        (outer, port.n_water, 1),
        (distance, port.n_water, -1),
    ]
    angle = target
    for _ in range(PEER_STEPS):
        invariant, slope = port.n_inside * offset * np.sin(angle), port.n_inside * offset * np.cos(angle)
        swept, rate = angle, 1.0
        for radius, index, sign in passages:
            sine = invariant / (index * radius)
            swept = swept + sign * np.arcsin(sine)
            rate = rate + sign * slope / (index * radius) / np.sqrt(1 - sine * sine)
        angle = angle + (target - swept) / rate
    outwards = sideways / np.where(across > 0, across, 1)[:, np.newaxis]
    return np.cos(angle)[:, np.newaxis] * axis + np.sin(angle)[:, np.newaxis] * outwards
