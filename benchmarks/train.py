"""Ray-surfaces per second: our compiled train beside Optiland's NumPy backend, on the same rays in one run.

The train is the aqua2's: two faces of the port, M1 and M2; a second one has a dome for a port. Optiland is given the
rays behind the camera's model and traces surfaces without bounds. Ours starts from pixels and also gives a status
per ray; the row called "bounded" checks the port's aperture and the mirrors' outlines too.
Both leave the point on M2 and the direction behind it; `run` fails where these differ by more than 1e-9 mm.
The row called "copied only" is the bound that memory sets: as many numbers read and written, with nothing computed.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from optics.camera import PinholeCamera
from optics.kernels import backend
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.ports.port import DomePort, FlatPort
from optics.status import Status
from optics.train import OpticalTrain, compiled_trace
from rigs import Rig

Q1, Q2 = 0.3, 0.2
"""Pose of the mirrors, radians: neither along an axis nor symmetric."""

SURFACES = 4
BATCHES = (1 << 14, 1 << 17, 1 << 20)
"""Rays per call; each code is judged by its best."""

PATIENCE_S = 1.0
"""How long each batch size is repeated; the fastest repetition counts, the others met somebody else's work."""

PROMISE_MM = 1e-9
MM = 1000.0


def run() -> list[dict[str, Any]]:
    """Rows of the table, in millions of ray-surfaces per second; a `RuntimeError` beyond 1e-9 mm."""
    bounded = OpticalTrain.from_rig(Rig.load("aqua2"), q1=Q1, q2=Q2)
    assert isinstance(bounded.port, FlatPort)
    flat = bounded.unbounded()
    dome_port = DomePort(
        centre_m=(0.002, -0.003, -0.008),
        radius_m=0.05,
        thickness_m=0.006,
        n_port=bounded.port.n_port,
        n_water=bounded.port.n_water,
    )
    dome = replace(flat, port=dome_port)
    _warm_up()
    rows = [*_rows("flat port", flat, bounded), *_rows("dome port", dome, replace(bounded, port=dome_port))]
    return [*rows, _memory_row(flat, rows[0]["peer"])]


def _rows(name: str, train: OpticalTrain, bounded: OpticalTrain) -> list[dict[str, Any]]:
    difference_mm = _difference_mm(train)
    if not difference_mm <= PROMISE_MM:
        raise RuntimeError(f"{name}: expected positions within {PROMISE_MM} mm, got {difference_mm:.2e} mm apart")
    peer = max(_rate(count, _optiland(train, _pixels(train, count))) for count in BATCHES)
    rows = []
    for how, whose, prepare in (
        ("Dr.Jit arrays", train, _dr_jit),
        ("Dr.Jit arrays, bounded", bounded, _dr_jit),
        ("NumPy arrays, bounded", bounded, _numpy),
    ):
        ours = max(_rate(count, prepare(whose, _pixels(whose, count))) for count in BATCHES)
        rows.append(
            {
                "name": f"train, {name} and two mirrors, {how}",
                "ours": ours / 1e6,
                "peer": peer / 1e6,
                "unit": "M ray-surfaces/s",
                "ratio": ours / peer,
                "note": f"peer: Optiland, NumPy backend; positions differ by at most {difference_mm:.1e} mm",
            }
        )
    return rows


def _memory_row(train: OpticalTrain, peer: float) -> dict[str, Any]:
    """What any such train could reach here, beside the same peer's rate."""
    rate = max(_rate(count, _copy(_pixels(train, count))) for count in BATCHES) / 1e6
    return {
        "name": "train, flat port and two mirrors, copied only",
        "ours": rate,
        "peer": peer,
        "unit": "M ray-surfaces/s",
        "ratio": rate / peer,
        "note": "no train but the bound of memory: two numbers in, six and a status out",
    }


def _warm_up() -> None:
    """Let Optiland compile what it compiles; numba has warnings to give about code that is not ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        train = OpticalTrain.from_rig(Rig.load("aqua2"), q1=Q1, q2=Q2)
        _optiland(train, _pixels(train, 2))()()


def _pixels(train: OpticalTrain, count: int) -> FloatArray:
    size = [train.camera.width_px - 0.5, train.camera.height_px - 0.5]
    return np.random.default_rng(1).uniform(-0.5, size, (count, 2))


def _rate(count: int, call: Callable[[], Callable[[], object]]) -> float:
    """Ray-surfaces per second of the fastest call; `call` prepares one outside the measured time."""
    fastest, stop = np.inf, time.perf_counter() + PATIENCE_S
    call()()
    while time.perf_counter() < stop:
        work = call()
        start = time.perf_counter()
        work()
        fastest = min(fastest, time.perf_counter() - start)
    return SURFACES * count / fastest


def _dr_jit(train: OpticalTrain, pixels: FloatArray) -> Callable[[], Callable[[], object]]:
    """Kernel alone: its inputs are there, its outputs stay there."""
    dr, parameters, kernel = backend.dr, train.parameters(), compiled_trace(*train.kind)
    u, v = (backend.Float64(np.ascontiguousarray(column)) for column in pixels.T)

    def work() -> None:
        dr.eval(kernel(parameters, u, v))
        dr.sync_thread()

    return lambda: work


def _copy(pixels: FloatArray) -> Callable[[], Callable[[], object]]:
    """Reads and writes what the kernel does; to outputs that are alike Dr.Jit would give one array, hence the sums."""
    dr = backend.dr
    u, v = (backend.Float64(np.ascontiguousarray(column)) for column in pixels.T)

    @dr.freeze
    def copy(u: Any, v: Any) -> Any:
        return [u + k for k in (1, 2, 3)], [v + k for k in (1, 2, 3)], dr.select(u > v, backend.Int32(0), 1)

    def work() -> None:
        dr.eval(copy(u, v))
        dr.sync_thread()

    return lambda: work


def _numpy(train: OpticalTrain, pixels: FloatArray) -> Callable[[], Callable[[], object]]:
    """Public function: NumPy in, NumPy out."""
    return lambda: lambda: train.trace(pixels)


def _optiland(train: OpticalTrain, pixels: FloatArray) -> Callable[[], Callable[[], object]]:
    """Optiland's surfaces one after the other; it moves the rays it is given, so every call needs its own."""
    surfaces, directions = _optiland_surfaces(train), train.camera.unproject(pixels)[0]

    def prepare() -> Callable[[], object]:
        rays = _optiland_rays(directions)
        return lambda: surfaces.trace(rays, skip=1, record=False)

    return prepare


def _difference_mm(train: OpticalTrain, count: int = 100_000) -> float:
    """Largest distance between both codes' points, on M2 and on a sphere of 10 m around it (the directions)."""
    pixels = _pixels(train, count)
    ours = train.trace(pixels)
    rays = _optiland_rays(train.camera.unproject(pixels)[0])
    _optiland_surfaces(train).trace(rays, skip=1, record=False)
    seen = ours.status == Status.OK
    on_mirror = np.stack([rays.x, rays.y, rays.z], axis=1) - MM * ours.origin_m
    directions = np.stack([rays.L, rays.M, rays.N], axis=1) - ours.direction
    return float(max(np.abs(on_mirror[seen]).max(), 10 * MM * np.abs(directions[seen]).max()))


def _optiland_rays(directions: FloatArray) -> Any:
    from optiland.rays import RealRays

    zeros, ones = np.zeros(len(directions)), np.ones(len(directions))
    return RealRays(zeros, zeros, zeros, *directions.T, ones, 0.55 * ones)


def _optiland_surfaces(train: OpticalTrain) -> Any:
    """The same surfaces in Optiland, in millimetres; its object and image surfaces are not traced."""
    from optiland.materials import IdealMaterial
    from optiland.optic import Optic

    assert isinstance(train.camera, PinholeCamera)
    assert isinstance(train.port, FlatPort | DomePort)
    port, layout = train.port, Layout.from_rig(Rig.load("aqua2"))
    if isinstance(port, FlatPort):
        faces = [{"z": MM * port.distance_m}, {"z": MM * (port.distance_m + port.thickness_m)}]
    else:
        x, y, z = (MM * component for component in np.asarray(port.centre_m))
        radii = (MM * port.radius_m, MM * (port.radius_m + port.thickness_m))
        # The vertex is where the sphere crosses its axis; the centre of curvature lies towards -z.
        faces = [{"x": x, "y": y, "z": z + radius, "radius": -radius} for radius in radii]
    optic = Optic()
    optic.surfaces.add(index=0, z=-1.0, material=IdealMaterial(n=port.n_inside))
    for index, (face, n_behind) in enumerate(zip(faces, (port.n_port, port.n_water), strict=True), start=1):
        optic.surfaces.add(index=index, material=IdealMaterial(n=n_behind), is_stop=index == 1, **face)
    for index, pose in enumerate((layout.camera_from_m1, layout.camera_from_m2(Q1, Q2)), start=3):
        x, y, z = MM * pose.translation
        rx, ry, rz = pose.rotation.as_euler("xyz")
        optic.surfaces.add(index=index, material="mirror", x=x, y=y, z=z, rx=rx, ry=ry, rz=rz)
    return optic.surfaces
