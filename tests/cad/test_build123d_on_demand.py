"""build123d loads without scikit-learn, clusters with it when it is asked to, and keeps nothing of who asked for it."""

import subprocess
import sys

LOADED = """
import sys
import cad.shapes
from build123d import brep_from_stl
print("sklearn" in sys.modules, "pandas" in sys.modules)
points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [9.0, 9.0, 9.0], [9.1, 9.0, 9.0], [9.0, 9.1, 9.0]]
print(*brep_from_stl.DBSCAN(eps=0.5, min_samples=2).fit(points).labels_)
import sklearn.cluster
print(sklearn.cluster.DBSCAN.__module__)
"""


def test_clustering_is_loaded_when_it_is_called():
    child = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    loaded, labels, found_in = child.stdout.splitlines()
    assert loaded == "False False"
    assert labels == "0 0 0 1 1 1"
    assert found_in.startswith("sklearn.cluster.")


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
