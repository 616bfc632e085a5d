"""build123d loads without what no solid of ours needs, has it when it is asked to, and keeps nothing of who asked."""

import subprocess
import sys

LOADED = """
import inspect
import sys
import cad.shapes
import build123d
print(*(name in sys.modules for name in ("sklearn", "pandas", "ezdxf", "lib3mf", "build123d.exporters")))
print(hasattr(build123d, "no_such_thing"))
names = ("export_step", "ExportSVG", "import_dxf", "import_step", "Mesher", "detect_primitives")
print(*(callable(getattr(build123d, name)) for name in names))
from build123d import import_dxf
print(*(inspect.isfunction(each) for each in (import_dxf, build123d.import_dxf)))
missing = [name for name in build123d.__all__ if not hasattr(build123d, name)]
print(missing)
"""


def test_what_no_solid_needs_is_loaded_when_it_is_asked_for():
    child = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    loaded, unknown, found, functions, missing = child.stdout.splitlines()
    assert set(loaded.split()) == {"False"}
    assert unknown == "False"
    assert set(found.split()) == {"True"}
    assert functions == "True True"
    assert missing == "[]"


KEPT = """
import weakref
import cad

class Held:
    pass

def asks():
    held = Held()
    import build123d
    return weakref.ref(held)

print(asks()() is None)
"""


def test_what_the_caller_had_at_hand_is_let_go():
    """Frames of the import would keep it for good, and manifold3d complains of each body that is kept."""
    child = subprocess.run([sys.executable, "-c", KEPT], capture_output=True, text=True, check=True)
    assert child.stdout.split() == ["True"]
