import numpy as np
import pytest

from cad.placement.mirror_table import mirror_table
from cad.placement.placement import default_request
from optics.search.objectives import rig_with
from optics.sizing.sizing import size_mirrors
from rigs import Rig


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig.load("torpedo")


def test_mirrors_are_those_that_sizing_gives(rig: Rig) -> None:
    request = default_request(rig)
    table = mirror_table(rig, request)
    design = table.designs[len(table.designs) // 2]
    sized = size_mirrors(rig_with(rig, design), request)
    assert sized.m2 is not None
    # The table's grid of poses is coarser: 6 degrees, between which an arc rises by 0.15 %.
    assert design[4:] == pytest.approx(1000 * np.array(sized.m2.sides_m("rectangle")), abs=1.0)
    assert (design[2:4] >= 1000 * np.array(sized.m1.sides_m("rectangle")) - 0.5).all() if sized.m1 else False


def test_what_never_fits_is_named(rig: Rig) -> None:
    small = rig.with_gaze(mount={"printer_bed_mm": (30.0, 30.0, 30.0)})
    table = mirror_table(small, default_request(small))
    assert not len(table.designs)
    assert table.rejected["M1 on the printer bed"] > 0
