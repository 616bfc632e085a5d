"""Loading build123d without what no solid of ours needs.

Of its packages scikit-learn alone, for one function that finds surfaces in a mesh, brings pandas and the statistics of
SciPy: a third of the time of loading it, and 100 MB. That function still works: it loads them when it is called. And a
garbage collector that walks again and again through what has only just been loaded is as slow as loading a quarter.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

NAME = "build123d"
CLUSTERING = "sklearn", "sklearn.cluster"


class OnDemand(MetaPathFinder):
    """Finds build123d, and loads it without scikit-learn."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where build123d is, with a loader around its own; nothing for other modules."""
        spec = PathFinder.find_spec(fullname, path, target) if fullname == NAME else None
        if spec is not None and spec.loader is not None:
            spec.loader = _Loader(spec.loader)
        return spec


class _Loader(Loader):
    def __init__(self, own: Loader):
        self._own = own

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._own.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        with _stand_in_for_clustering(), _no_garbage():
            self._own.exec_module(module)


@contextmanager
def _stand_in_for_clustering() -> Iterator[None]:
    """Within it scikit-learn is not loaded: its clustering is, when it is called."""
    if CLUSTERING[0] in sys.modules:
        yield
        return
    for name in CLUSTERING:
        sys.modules[name] = ModuleType(name)
    sys.modules[CLUSTERING[1]].DBSCAN = _clustering  # type: ignore[attr-defined]
    try:
        yield
    finally:
        for name in CLUSTERING:
            del sys.modules[name]


@contextmanager
def _no_garbage() -> Iterator[None]:
    """Within it no garbage is collected, at its end once; what is left then is not looked through again.

    Among the garbage are frames of the import, which would keep what those who asked for build123d had at hand as long
    as the program lives, and manifold3d complains at length about each of its bodies that it finds at the end.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.collect()
        gc.freeze()
        if collects:
            gc.enable()


def _clustering(*args: Any, **kwargs: Any) -> Any:
    from sklearn.cluster import DBSCAN  # noqa: PLC0415  (takes as long to load as build123d)

    return DBSCAN(*args, **kwargs)
