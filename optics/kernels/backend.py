"""The one place that chooses what Dr.Jit computes with: LLVM on the processor or CUDA on a graphics card.

Other modules write ``from optics.kernels.backend import dr, mi, Float64``: the first such import chooses the backend.
Nothing else imports drjit or mitsuba. The choice is made before drjit is loaded, because drjit takes the
first LLVM it finds, and with LLVM 15 or 16 the whole process aborts at the first kernel.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import logging
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

Version = tuple[int, int, int]

OLDEST_LLVM: Version = (17, 0, 0)
LLVM_WHEEL = "karellen-llvm-core"
LLVM_VARIABLE = "DRJIT_LIBLLVM_PATH"
"""Drjit reads it; a user may set it to a library of their own."""

BACKEND_VARIABLE = "MIRRORGAZE_BACKEND"
"""A user may set it to llvm or cuda."""

THREADS_VARIABLE = "MIRRORGAZE_THREADS"
"""A user may set it to how many threads compute: where several processes share the processors, their share. Dr.Jit's
threads look for work all the time, and in each process take what the others could use."""

MOST_THREADS = 1024
"""More than any machine has processors; beyond what a system has room for, Dr.Jit ends without a sentence."""

PATIENCE_S = 60.0
"""How long a child process may take to load one library; a cold disk needs a few seconds."""

SYSTEM_LIBRARIES = (
    "usr/lib/*-linux-gnu/libLLVM*.so*",
    "usr/lib/llvm-*/lib/libLLVM*.so*",
    "usr/lib64/libLLVM*.so*",
    "usr/lib64/llvm*/lib/libLLVM*.so*",
    "usr/lib/libLLVM*.so*",
    "usr/local/lib/libLLVM*.so*",
    "opt/homebrew/opt/llvm/lib/libLLVM*.dylib",
)
"""Where distributions put LLVM, from the file system's root."""

NVIDIA_DEVICES = ("/dev/nvidiactl", "/dev/dxg")
"""The driver's device file on Linux, and on Linux under Windows: without one there is no card to ask."""

TYPES = {
    "Bool": "Bool",
    "Int32": "Int32",
    "Int64": "Int64",
    "UInt32": "UInt32",
    "UInt64": "UInt64",
    "Float32": "Float32",
    "Float64": "Float64",
    "Array2f32": "Array2f",
    "Array3f32": "Array3f",
    "Array2f64": "Array2f64",
    "Array3f64": "Array3f64",
    "Matrix3f64": "Matrix3f64",
    "ArrayXf32": "ArrayXf",
    "TensorXf32": "TensorXf",
    "TensorXf64": "TensorXf64",
    "PCG32": "PCG32",
    "Philox4x32": "Philox4x32",
}
"""Array types that can be imported from here, and what the backend's module calls them."""

ASK_LLVM = """
import ctypes, sys
numbers = [ctypes.c_uint() for _ in range(3)]
ctypes.CDLL(sys.argv[1]).LLVMGetVersion(*map(ctypes.byref, numbers))
print(*(number.value for number in numbers))
"""

ASK_CUDA = """
import ctypes, os
ctypes.CDLL(os.environ.get("DRJIT_LIBOPTIX_PATH", "libnvoptix.so.1"))
cuda = ctypes.CDLL(os.environ.get("DRJIT_LIBCUDA_PATH", "libcuda.so.1"))
count, name = ctypes.c_int(), ctypes.create_string_buffer(256)
failed = cuda.cuInit(0) or cuda.cuDeviceGetCount(ctypes.byref(count)) or count.value == 0
if failed or cuda.cuDeviceGetName(name, len(name), 0):
    raise SystemExit(1)
print(name.value.decode())
"""


class BackendError(RuntimeError):
    """There is nothing to compute with; the message says what to install."""


@dataclass(frozen=True, kw_only=True)
class Backend:
    """What kernels run on.

    Attributes
    ----------
    kind : {"llvm", "cuda"}
        Processor or graphics card.
    llvm_path, llvm_version : Path and (major, minor, patch), or None
        The library that compiles kernels for the processor; None with CUDA.
    device : str or None
        Name of the graphics card; None with LLVM.
    variant : str
        Mitsuba's name for the variant that goes with it.
    """

    kind: Literal["llvm", "cuda"]
    llvm_path: Path | None = None
    llvm_version: Version | None = None
    device: str | None = None

    @property
    def variant(self) -> str:
        """Mitsuba's name for the variant that goes with this backend."""
        return f"{self.kind}_ad_rgb"


@cache
def find_backend() -> Backend:
    """Look for something to compute with, without loading it; the answer is kept for the life of the process.

    A graphics card is taken when there is one and its driver can trace rays (containers often lack OptiX,
    ``libnvoptix.so.1``), unless ``MIRRORGAZE_BACKEND=llvm``. LLVM is taken from
    ``DRJIT_LIBLLVM_PATH`` when that is good, then from the wheel that is installed with mirrorgaze, then from
    the system.

    Raises
    ------
    ValueError
        When ``MIRRORGAZE_BACKEND`` or ``MIRRORGAZE_THREADS`` holds what it cannot mean.
    BackendError
        When nothing usable is found.
    """
    wish, _ = _wishes()
    device = _cuda_device() if wish != "llvm" else None
    if device is not None:
        return Backend(kind="cuda", device=device)
    if wish == "cuda":
        raise BackendError(
            f"{BACKEND_VARIABLE} = cuda, but no NVIDIA driver with a graphics card and OptiX answers: install one"
        )
    path, version = _find_llvm()
    return Backend(kind="llvm", llvm_path=path, llvm_version=version)


@cache
def activate() -> Backend:
    """Load Dr.Jit with the backend found, once; later calls return the same backend.

    Raises
    ------
    ValueError
        As `find_backend`.
    BackendError
        When there is no backend, a system library that drjit needs is missing, or somebody else has made drjit load
        an LLVM that is too old: the first kernel would end the process.
    """
    backend = find_backend()
    if backend.llvm_path is not None:
        os.environ[LLVM_VARIABLE] = str(backend.llvm_path)
    drjit = _loaded("drjit")
    if backend.llvm_path is not None:
        _check_loaded_llvm(drjit.detail.llvm_version())
    _, threads = _wishes()
    if threads:
        drjit.set_thread_count(int(threads))
    if backend.kind == "cuda":
        # As `optics.kernels.freezing.arithmetic` has it.
        drjit.set_flag(drjit.JitFlag.FastMath, False)
    return backend


def _check_loaded_llvm(version: Version) -> None:
    if version < OLDEST_LLVM:
        raise BackendError(
            f"Dr.Jit has loaded LLVM {_dotted(version)} already, before mirrorgaze was asked, and {OLDEST_LLVM[0]} or "
            "newer is needed: import from optics, scenes or tracking before mitsuba.set_variant is called, or set "
            f"{LLVM_VARIABLE} to a newer libLLVM"
        )


def _wishes() -> tuple[str, str]:
    """What the user wants to compute with, and in how many threads; empty where it is left to us."""
    backend, threads = os.environ.get(BACKEND_VARIABLE, ""), os.environ.get(THREADS_VARIABLE, "")
    problems = []
    if backend not in ("", "llvm", "cuda"):
        problems.append(f"{BACKEND_VARIABLE} = {backend!r}: expected llvm or cuda")
    if threads and not (threads.isdecimal() and 1 <= int(threads) <= MOST_THREADS):
        problems.append(f"{THREADS_VARIABLE} = {threads!r}: expected a number of threads, 1 to {MOST_THREADS}")
    if problems:
        raise ValueError("; ".join(problems))
    return backend, threads


@contextmanager
def another_thread() -> Iterator[None]:
    """Two threads at least, for reading and writing OpenEXR files.

    Mitsuba's OpenEXR works in Dr.Jit's threads and waits in one of them: with one alone, as on a machine with one core,
    it waits for ever.
    """
    activate()
    drjit = _loaded("drjit")
    threads = drjit.thread_count()
    drjit.set_thread_count(max(threads, 2))
    try:
        yield
    finally:
        drjit.set_thread_count(threads)


@cache
def _mitsuba() -> Any:
    """Mitsuba in the backend's variant; apart from Dr.Jit, since a robot's computer follows rays without Mitsuba."""
    variant = activate().variant
    mitsuba = _loaded("mitsuba")
    mitsuba.set_variant(variant)
    return mitsuba


def _loaded(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise BackendError(
            f"{name} cannot be loaded ({error}): run ./run setup, or on Debian: apt-get install libatomic1"
        ) from error


def __getattr__(name: str) -> Any:
    if name == "dr":
        activate()
        found = importlib.import_module("drjit")
    elif name == "mi":
        found = _mitsuba()
    elif name in TYPES:
        found = getattr(importlib.import_module(f"drjit.{activate().kind}.ad"), TYPES[name])
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # The next time it is an attribute like any other: kernels are traced through hundreds of thousands of them.
    globals()[name] = found
    return found


def _find_llvm() -> tuple[Path, Version]:
    wheel = _wheel_llvm()
    chosen = os.environ.get(LLVM_VARIABLE)
    candidates = [Path(chosen)] if chosen else []
    if wheel is not None:
        candidates.append(wheel[0])
    candidates.extend(_system_llvm())
    for path in candidates:
        # The wheel's metadata is evidence enough: no need to spend a child process on it at every start.
        version = wheel[1] if wheel is not None and path == wheel[0] else llvm_version(path)
        if version is not None and version >= OLDEST_LLVM:
            return path, version
        if chosen and path == Path(chosen):
            found = "which cannot be asked for its version" if version is None else f"which is {_dotted(version)}"
            logging.getLogger(__name__).warning(
                "%s = %s, %s: passed over, LLVM %d or newer is needed",
                LLVM_VARIABLE,
                path,
                found,
                OLDEST_LLVM[0],
            )
    raise BackendError(
        f"no LLVM {OLDEST_LLVM[0]} or newer was found: run pip install '{LLVM_WHEEL}>=23,<24' "
        f"(Linux on x86-64) or apt-get install libllvm19, or set {LLVM_VARIABLE} to a libLLVM of your own"
    )


def llvm_version(library: Path) -> Version | None:
    """Version of an LLVM library, or None when it cannot be had (no such file, damaged, or older than 16).

    It is asked in a child process, because loading a bad library may end the process that does it.
    """
    numbers = _ask(ASK_LLVM, str(library)).split()
    if len(numbers) != 3 or not all(number.isdecimal() for number in numbers):
        return None
    major, minor, patch = map(int, numbers)
    return major, minor, patch


def _wheel_llvm() -> tuple[Path, Version] | None:
    try:
        distribution = importlib.metadata.distribution(LLVM_WHEEL)
    except importlib.metadata.PackageNotFoundError:
        return None
    numbers = re.match(r"(\d+)\.(\d+)\.(\d+)", distribution.version)
    # libLLVM.so is a link that the wheel makes only at the next start of Python; libLLVM.so.23.1 is the file.
    files = sorted(Path(str(file.locate())) for file in distribution.files or () if file.name.startswith("libLLVM"))
    present = [file.resolve() for file in files if file.is_file()]
    if numbers is None or not present:
        return None
    return present[0], (int(numbers[1]), int(numbers[2]), int(numbers[3]))


def _system_llvm() -> list[Path]:
    """Libraries of the system whose names do not say that they are too old, newest name first."""
    places = [(Path(sys.prefix), "lib/libLLVM*.so*"), *((Path("/"), place) for place in SYSTEM_LIBRARIES)]
    found = {path.resolve(): _version_in_name(path) for folder, pattern in places for path in folder.glob(pattern)}
    recent = [path for path, major in found.items() if major == 0 or major >= OLDEST_LLVM[0]]
    return sorted(recent, key=lambda path: found[path], reverse=True)


def _version_in_name(path: Path) -> int:
    """Major version said by a name such as libLLVM-19.so or libLLVM.so.19.1; 0 when the name says none."""
    number = re.search(r"libLLVM(?:-|\.so\.|\.)(\d+)", path.resolve().name)
    return int(number[1]) if number else 0


def _cuda_device() -> str | None:
    if not any(Path(device).exists() for device in NVIDIA_DEVICES):
        return None
    return _ask(ASK_CUDA) or None


def _ask(question: str, *arguments: str) -> str:
    """Return what a fresh interpreter prints when it runs `question`; nothing when that fails."""
    command = [sys.executable, "-S", "-E", "-c", question, *arguments]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""


def _dotted(version: Version) -> str:
    return ".".join(map(str, version))
