"""The backend is chosen before drjit is loaded, and a bad library never ends the process.

Each look-up runs in a process of its own: the choice is made once per process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from optics.kernels.backend import (
    Backend,
    BackendError,
    _check_loaded_llvm,
    activate,
    find_backend,
    llvm_version,
)

KERNEL = """
import json, math
from optics.kernels.backend import Float64, activate, dr, mi

backend = activate()
x = dr.arange(Float64, 1000) / 7
total = float(dr.sum(dr.sin(x) * dr.sqrt(x))[0])
expected = math.fsum(math.sin(k / 7) * math.sqrt(k / 7) for k in range(1000))
print(json.dumps({"kind": backend.kind, "llvm": str(backend.llvm_path), "variant": mi.variant(),
                  "error": abs(total - expected) / abs(expected)}))
"""

LOOK = """
from optics.kernels.backend import BackendError, find_backend
import sys
try:
    print(find_backend())
except BackendError as error:
    print(error)
print("drjit" in sys.modules, "mitsuba" in sys.modules)
"""

NO_WHEEL = """
import importlib.metadata, pathlib, sys

def not_there(name):
    raise importlib.metadata.PackageNotFoundError(name)

importlib.metadata.distribution = not_there
import optics.kernels.backend
optics.kernels.backend.SYSTEM_LIBRARIES = ()
sys.prefix = "/nonexistent"
"""

SUM_TOLERANCE = 1e-12
"""Relative; the terms are of order 1e1 and alternate in sign, 1000 of them round to about 1e-14."""

TOO_OLD = sorted(Path("/usr/lib").glob("*-linux-gnu/libLLVM-1[4-6].so.1"))
"""A too old LLVM, where the system happens to have one (Mesa's)."""


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    inherited = {name: value for name, value in os.environ.items() if name not in ("DRJIT_LIBLLVM_PATH",)}
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env=inherited | environment,
        capture_output=True,
        text=True,
        check=False,
    )


THREADS = "from optics.kernels.backend import dr; print(dr.thread_count())"


def test_a_number_of_threads_can_be_asked_for():
    assert run(THREADS, MIRRORGAZE_THREADS="3").stdout.split() == ["3"]


@pytest.mark.parametrize("wish", ["0", "-1", "all", "100000"])
def test_no_number_of_threads_is_refused(wish):
    child = run("from optics.kernels.backend import dr", MIRRORGAZE_THREADS=wish)
    assert f"ValueError: MIRRORGAZE_THREADS = {wish!r}: expected a number of threads, 1 to 1024" in child.stderr


def test_float64_kernels_compute_in_double_precision():
    child = run(KERNEL)
    assert child.returncode == 0, child.stderr
    answer = json.loads(child.stdout)
    assert answer["error"] < SUM_TOLERANCE
    assert answer["variant"] == f"{answer['kind']}_ad_rgb"


def test_a_graphics_card_can_be_declined():
    child = run(KERNEL, MIRRORGAZE_BACKEND="llvm")
    assert child.returncode == 0, child.stderr
    assert json.loads(child.stdout)["variant"] == "llvm_ad_rgb"


@pytest.mark.parametrize("bad", ["missing", "text", "not LLVM", "too old"])
def test_a_bad_library_is_passed_over_with_a_sentence(bad, tmp_path):
    text = tmp_path / "libLLVM.so"
    text.write_text("not a library", encoding="utf-8")
    if bad == "too old" and not TOO_OLD:
        pytest.skip("this system has no old LLVM")
    library = {"missing": "/nonexistent/libLLVM.so", "text": text, "not LLVM": "libm.so.6"}.get(bad) or TOO_OLD[0]
    child = run(KERNEL, DRJIT_LIBLLVM_PATH=str(library), MIRRORGAZE_BACKEND="llvm")
    assert child.returncode == 0, child.stderr
    assert json.loads(child.stdout)["llvm"] != str(library)
    assert "passed over, LLVM 17 or newer is needed" in child.stderr


def test_a_good_library_of_your_own_is_taken():
    usual = Path(json.loads(run(KERNEL, MIRRORGAZE_BACKEND="llvm").stdout)["llvm"])
    # Another name of the same file: a copy elsewhere would not find the libraries beside it.
    mine = next((name for name in usual.parent.glob("libLLVM*.so*") if name != usual), None)
    if mine is None:
        pytest.skip("the library has only one name here")
    child = run(KERNEL, DRJIT_LIBLLVM_PATH=str(mine), MIRRORGAZE_BACKEND="llvm")
    assert json.loads(child.stdout)["llvm"] == str(mine)


def test_without_any_llvm_a_sentence_says_what_to_install():
    child = run(NO_WHEEL + LOOK, MIRRORGAZE_BACKEND="llvm", DRJIT_LIBLLVM_PATH="/nonexistent/libLLVM.so")
    assert "no LLVM 17 or newer was found: run pip install 'karellen-llvm-core>=23,<24'" in child.stdout
    assert "libllvm19" in child.stdout


def test_looking_loads_nothing():
    assert run(LOOK).stdout.splitlines()[-1] == "False False"


def test_an_unknown_backend_is_refused():
    stderr = run(LOOK, MIRRORGAZE_BACKEND="metal").stderr
    assert "ValueError: MIRRORGAZE_BACKEND = 'metal': expected llvm or cuda" in stderr


def test_all_that_is_wrong_is_said_at_once():
    stderr = run(LOOK, MIRRORGAZE_BACKEND="metal", MIRRORGAZE_THREADS="all").stderr
    assert "'metal': expected llvm or cuda; MIRRORGAZE_THREADS = 'all': expected" in stderr


@pytest.mark.parametrize("wish", [{"MIRRORGAZE_BACKEND": "metal"}, {"MIRRORGAZE_THREADS": "all"}])
def test_a_wish_that_means_nothing_is_bad_input(wish):
    """Exit status 2 and one line, as for any other bad input."""
    command = "import sys; from mirrorgaze.cli import main; sys.argv[1:] = ['gaze', 'aqua2', '--q1-deg', '10']; main()"
    child = run(command, **wish)
    assert (child.returncode, child.stdout) == (2, "")
    assert child.stderr.startswith("mirrorgaze: MIRRORGAZE_")
    assert len(child.stderr.splitlines()) == 1


def test_cuda_without_a_graphics_card_is_refused():
    if find_backend().kind == "cuda":
        pytest.skip("this machine has a graphics card")
    assert "no NVIDIA driver with a graphics card and OptiX answers" in run(LOOK, MIRRORGAZE_BACKEND="cuda").stdout


def test_activating_again_is_the_same_backend():
    from optics.kernels.backend import dr, mi

    assert activate() is activate() is find_backend()
    assert mi.variant() == activate().variant
    assert dr.__name__ == "drjit"


def test_every_name_on_offer_can_be_imported():
    import optics.kernels.backend

    for name in optics.kernels.backend.TYPES:
        assert optics.kernels.backend.activate().kind in getattr(optics.kernels.backend, name).__module__
    with pytest.raises(ImportError, match="Float16"):
        from optics.kernels.backend import Float16  # noqa: F401


def test_a_library_that_is_not_llvm_has_no_version():
    assert llvm_version(Path("/nonexistent/libLLVM.so")) is None
    assert llvm_version(Path(__file__)) is None


def test_a_backend_names_mitsubas_variant():
    assert Backend(kind="cuda", device="a card").variant == "cuda_ad_rgb"
    assert issubclass(BackendError, RuntimeError)


VARIANT_FIRST = """
import mitsuba
mitsuba.set_variant("llvm_ad_rgb")
import drjit
old = drjit.detail.llvm_version()
from optics.kernels.backend import BackendError, Float64
"""


@pytest.mark.skipif(not TOO_OLD, reason="no LLVM of 14 to 16 in the system")
def test_a_variant_set_before_with_an_old_llvm_is_a_sentence():
    """Where drjit itself finds the old one: the first kernel would abort."""
    child = run(VARIANT_FIRST, DRJIT_LIBLLVM_PATH=str(TOO_OLD[-1]))
    assert child.returncode == 1
    assert "BackendError: Dr.Jit has loaded LLVM " in child.stderr
    assert "import from optics, scenes or tracking before mitsuba.set_variant is called" in child.stderr


def test_a_version_that_is_too_old_is_refused_and_a_newer_one_is_not():
    for version in ((17, 0, 0), (23, 1, 0)):
        _check_loaded_llvm(version)
    with pytest.raises(BackendError, match=r"has loaded LLVM 16\.0\.6 already"):
        _check_loaded_llvm((16, 0, 6))
