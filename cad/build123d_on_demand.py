"""Loading build123d without what no solid of ours needs.

Some of its modules (`LATER`) bring packages of their own for files of other programs and for surfaces in meshes: ezdxf,
svgpathtools, lib3mf, glTF, scikit-learn with pandas and the statistics of SciPy. They take half of the time of loading
it, and 100 MB. What they define is still there: they are loaded when it is asked for. And a garbage collector that
walks again and again through what has only just been loaded is as slow as loading a quarter.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

NAME = "build123d"
LATER = tuple(
    f"{NAME}.{module}" for module in ("exporters", "exporters3d", "importers", "import_dxf", "mesher", "brep_from_stl")
)

_NOT_YET = object()


class OnDemand(MetaPathFinder):
    """Finds build123d, and loads it without the modules that are loaded later."""

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
        with _empty(LATER), _no_garbage():
            self._own.exec_module(module)
        for name in [name for name, value in vars(module).items() if value is _NOT_YET]:
            delattr(module, name)
        module.__getattr__ = _loaded_later  # type: ignore[method-assign]


@contextmanager
def _empty(names: Sequence[str]) -> Iterator[None]:
    """Within it nothing is in these modules, but in those that are loaded already."""
    empty = {name: ModuleType(name) for name in names if name not in sys.modules}
    for module in empty.values():
        module.__dict__.update(__all__=[], __getattr__=lambda _: _NOT_YET)
    sys.modules.update(empty)
    try:
        yield
    finally:
        for name in empty:
            del sys.modules[name]


def _loaded_later(name: str) -> Any:
    """What build123d has by this name in a module that is loaded when it is asked for."""
    if not name.startswith("_"):
        whole = sys.modules[NAME]
        for later in LATER:
            found, its_name = vars(import_module(later)), later.rpartition(".")[2]
            if its_name in found:
                # A function that is called as its module.
                setattr(whole, its_name, found[its_name])
            if name in found:
                return found[name]
    raise AttributeError(f"module {NAME!r} has no attribute {name!r}")


@contextmanager
def _no_garbage() -> Iterator[None]:
    """Within it no garbage is collected, at its end that of it alone; what is left then is not looked through again.

    Among the garbage are frames of the import, which would keep what those who asked for build123d had at hand as long
    as the program lives, and manifold3d complains at length about each of its bodies that it finds at the end.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.collect(1)
        gc.freeze()
        if collects:
            gc.enable()
