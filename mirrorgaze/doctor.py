"""Look at the machine: what computes, what judges, what is missing and why that matters."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import math
import os
import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

TIMEOUT_S = 300.0
"""How long a child process may take; the first import after an installation reads hundreds of megabytes."""

TERMS = 1_000_000
"""Terms of the sum that proves double precision: single precision misses it by about 1e-7."""

TOLERANCE = 1e-12
"""Rounding of a million float64 additions, added up in blocks, stays far below this."""

TRIANGLES_M = (1.0, 2.0)
"""Distances of the triangles that prove the search for rays."""

MISS_M = 1e-5
"""A hit this far from its triangle is none; single precision places it to 1e-7."""

PROGRAMS = (
    ("slicer", ("prusa-slicer",), "judges whether parts print; apt-get install prusa-slicer"),
    ("chromium", ("chromium", "chromium-browser"), "shows report pages to the tests; apt-get install chromium"),
)
"""Programs that are not needed: what we call them, their names on PATH, what they are for and where they come from."""

EXTRAS = (
    ("viser", "viser", "shows the studio's page; pip install 'mirrorgaze[studio]'"),
    ("onnxruntime", "onnxruntime", "runs a learned detector; pip install 'mirrorgaze[onnx]'"),
    ("gymnasium", "gymnasium", "makes an environment of a dive; pip install 'mirrorgaze[env]'"),
    ("pvlib", "pvlib", "says where the sun stands at a time and place; pip install 'mirrorgaze[sun]'"),
    ("optiland", "optiland", "benchmarks compare our rays with it; ./run bench installs it"),
    ("embreex", "embreex", "benchmarks compare our ray casting with it; ./run bench installs it"),
)
"""Packages that are not needed: distribution, module, what they are for and where they come from."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that was looked for; `detail` says what was found, or what its absence means."""

    name: str
    found: bool
    needed: bool
    detail: str

    @property
    def verdict(self) -> str:
        """One word for a table."""
        if self.found:
            return "ok"
        return "MISSING" if self.needed else "absent"


def version() -> str:
    """Version of the installed mirrorgaze."""
    return importlib.metadata.version("mirrorgaze")


def examine() -> list[Finding]:
    """Look for everything the toolkit needs or can use."""
    return [
        Finding(name="python", found=True, needed=True, detail=f"{platform.python_version()}, {sys.prefix}"),
        *_backend(),
        _solid_modelling(),
        *(_program(*program) for program in PROGRAMS),
        *(_extra(*extra) for extra in EXTRAS),
    ]


def prove_backend() -> None:
    """Load the backend, run a float64 kernel and a search for rays, and print what was used and found as JSON."""
    from optics.kernels.backend import Float64, activate, dr

    backend = activate()
    k = dr.arange(Float64, TERMS) + 1
    total = float(dr.sum(1 / (k * k))[0])
    # Euler-Maclaurin; the next term is 1e-25.
    expected = math.pi**2 / 6 - 1 / TERMS + 1 / (2 * TERMS**2) - 1 / (6 * TERMS**3)
    answer = {
        "kind": backend.kind,
        "llvm_path": None if backend.llvm_path is None else str(backend.llvm_path),
        "llvm_version": backend.llvm_version,
        "device": backend.device,
        "variant": backend.variant,
        "threads": dr.thread_count(),
        "error": abs(total - expected),
        "hit_m": _hit_m(),
    }
    print(json.dumps(answer))


def _hit_m() -> list[float]:
    """How far a ray goes to each of two triangles, `TRIANGLES_M` away, that one kernel searches."""
    import numpy as np

    from optics.kernels.backend import dr, mi
    from optics.kernels.ray_scene import mesh_scene

    corners, face = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    scenes = [mesh_scene(corners + np.array([0, 0, away]), face) for away in TRIANGLES_M]
    ray = mi.Ray3f(mi.Point3f(0, 0, 0), mi.Vector3f(0, 0, 1))
    found = [scene.ray_intersect_preliminary(ray).t for scene in scenes]
    dr.eval(found)
    return [float(distance[0]) for distance in found]


def _backend() -> list[Finding]:
    # In a child process: a bad LLVM does not raise, it aborts.
    answer, complaint = _ask("from mirrorgaze.doctor import prove_backend; prove_backend()")
    if answer is None:
        return [Finding(name="backend", found=False, needed=True, detail=complaint)]
    card = answer["device"] or "none whose driver traces rays (OptiX); everything runs on the processor"
    findings = [
        Finding(name="backend", found=True, needed=True, detail=f"{answer['kind']}, {answer['variant']}"),
        Finding(
            name="float64 kernel",
            found=answer["error"] < TOLERANCE,
            needed=True,
            detail=f"a sum of {TERMS} terms is off by {answer['error']:.0e}; at most {TOLERANCE:.0e} is right",
        ),
        Finding(
            name="rays",
            found=all(abs(hit - away) < MISS_M for hit, away in zip(answer["hit_m"], TRIANGLES_M, strict=True)),
            needed=True,
            detail="one kernel hit triangles of two scenes at {:g} and {:g} m; {:g} and {:g} m is right".format(
                *answer["hit_m"], *TRIANGLES_M
            ),
        ),
        Finding(name="threads", found=True, needed=True, detail=f"{answer['threads']} of {os.cpu_count()} processors"),
        Finding(name="graphics card", found=answer["device"] is not None, needed=False, detail=card),
    ]
    if answer["llvm_path"]:
        detail = ", ".join(filter(None, [".".join(map(str, answer["llvm_version"])), answer["llvm_path"], complaint]))
        findings.insert(1, Finding(name="llvm", found=True, needed=True, detail=detail))
    return findings


def _solid_modelling() -> Finding:
    answer, complaint = _ask("import OCP.gp; print('{}')")
    if answer is None:
        detail = f"{complaint}; mounts cannot be built; ./run setup, or on Debian: apt-get install libgl1"
        return Finding(name="build123d", found=False, needed=True, detail=detail)
    return Finding(name="build123d", found=True, needed=True, detail=importlib.metadata.version("build123d"))


def _program(name: str, commands: tuple[str, ...], purpose: str) -> Finding:
    paths = [path for path in map(shutil.which, commands) if path]
    return Finding(name=name, found=bool(paths), needed=False, detail=paths[0] if paths else purpose)


def _extra(distribution: str, module: str, purpose: str) -> Finding:
    found = importlib.util.find_spec(module) is not None
    detail = importlib.metadata.version(distribution) if found else purpose
    return Finding(name=distribution, found=found, needed=False, detail=detail)


def _ask(code: str) -> tuple[dict[str, Any] | None, str]:
    """Run code in a fresh interpreter; return the JSON it prints, or None, and the last thing it complained about."""
    try:
        # -P: a file of the working directory does not stand in for one of our packages.
        child = subprocess.run(
            [sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return None, f"no answer within {TIMEOUT_S:g} s"
    complaint = (child.stderr.strip().splitlines() or [""])[-1]
    if child.returncode == 0:
        return json.loads(child.stdout.splitlines()[-1]), complaint
    if child.returncode < 0:
        return None, f"the process was ended by signal {-child.returncode}"
    return None, re.sub(r"^[\w.]+Error: ", "", complaint)
