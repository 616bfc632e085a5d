"""Frozen functions: their kernels are recorded once and replayed, without tracing the Python again.

And how exactly a graphics card computes in them.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Any

from optics.kernels.backend import activate, dr
from optics.kernels.trees import Structure, is_tree, leaves_of, structure_of

Kernel = Callable[..., Any]

_STRUCTURES: dict[Structure, Structure] = {}


class Flat:
    """A tree (`optics.kernels.trees`) taken apart for frozen functions: once, when it is the same in every call."""

    def __init__(self, tree: Any):
        self.leaves = leaves_of(tree)
        # The same object for the same structure: it is looked up in every call.
        structure = structure_of(tree)
        self.structure = _STRUCTURES.setdefault(structure, structure)


def frozen(*, recordings: int = 10, fast: bool = False) -> Callable[[Kernel], Kernel]:
    """Decorator: `drjit.freeze` that does not collect garbage while it records, and takes and returns trees fast.

    A Mitsuba scene in the garbage would be freed in the middle of the recording, which can hold no such thing, and the
    process would end. And Dr.Jit asks for the fields of each dataclass a dozen times in every call, which takes as long
    as a small frame: it is handed the leaves alone. An argument may be `Flat`; the function is given its tree.

    Parameters
    ----------
    recordings : int
        More than these are worth a warning: arguments that change between calls make recordings useless.
    fast : bool
        As `arithmetic` has it: for kernels in single precision alone.
    """

    def decorator(function: Kernel) -> Kernel:
        recorded: dict[tuple[int | None, ...], tuple[Kernel, list[Structure]]] = {}

        @wraps(function)
        def call(*arguments: Any) -> Any:
            key = tuple(id(each.structure) if isinstance(each, Flat) else None for each in arguments)
            if key not in recorded:
                structures = [each.structure if isinstance(each, Flat) else None for each in arguments]
                recorded[key] = _recorder(function, structures, recordings, fast=fast)
            kernel, result = recorded[key]
            with _without_collection():
                leaves = kernel(*(each.leaves if isinstance(each, Flat) else each for each in arguments))
            return result[0].filled(iter(leaves)) if result else leaves

        return call

    return decorator


def _recorder(
    function: Kernel, structures: Sequence[Structure | None], recordings: int, *, fast: bool
) -> tuple[Kernel, list[Structure]]:
    """The function from leaves to leaves, frozen; and a list to which the result's structure comes, if it has one."""
    found: list[Structure] = []

    def of_leaves(*arguments: Any) -> Any:
        pairs = zip(structures, arguments, strict=True)
        with arithmetic(fast=fast):
            result = function(
                *(each if structure is None else structure.filled(iter(each)) for structure, each in pairs)
            )
        if not is_tree(result):
            return result
        found[:] = [structure_of(result)]
        return leaves_of(result)

    # Numbers are inputs from the first call on: else a second call with another number records and compiles once more.
    return dr.freeze(wraps(function)(of_leaves), warn_after=recordings, auto_opaque=False), found


@contextmanager
def arithmetic(*, fast: bool) -> Iterator[None]:
    """Kernels that are traced inside take a graphics card's fast reciprocals, quotients and roots, or exact ones.

    A fast reciprocal is good to 3e-7 in double precision too (PTX, ``rcp.approx.ftz.f64``; measured), and Dr.Jit
    takes it for ``rcp``, ``rsqrt``, ``normalize``, a vector over a number, and in derivatives: in every thread but the
    one that activated the backend, because its flag is a thread's own. On the processor there is no choice.
    """
    if activate().kind == "llvm":
        yield
        return
    with dr.scoped_set_flag(dr.JitFlag.FastMath, fast):
        yield


@contextmanager
def _without_collection() -> Iterator[None]:
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
