"""Frozen functions: their kernels are recorded once and replayed, without tracing the Python again."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any

from optics.kernels.backend import dr

Kernel = Callable[..., Any]


def frozen(*, recordings: int = 10) -> Callable[[Kernel], Kernel]:
    """Decorator: `drjit.freeze` that does not collect garbage while it records.

    A Mitsuba scene in the garbage would be freed in the middle of the recording, which can hold no such thing, and the
    process would end.

    Parameters
    ----------
    recordings : int
        More than these are worth a warning: arguments that change between calls make recordings useless.
    """

    def decorator(function: Kernel) -> Kernel:
        recorded = dr.freeze(function, warn_after=recordings)

        @wraps(function)
        def call(*arguments: Any) -> Any:
            with _without_collection():
                return recorded(*arguments)

        return call

    return decorator


@contextmanager
def _without_collection() -> Iterator[None]:
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
