"""The torpedo's solid has the formula's volume, and the preset's mount fits it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from cad.assembly.assembly import build_assembly
from cad.checks.assembly_checks import assembly_problems
from cad.hulls.anchors import fold_anchor
from cad.hulls.torpedo import torpedo
from optics.feasibility.torpedo import torpedo_radius
from rigs import Rig, TorpedoHull

RIG = Rig.load("torpedo")


def changed(**values) -> TorpedoHull:
    return TorpedoHull.model_validate(RIG.gaze.hull.model_dump() | values)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"nose_exponent": 4.0, "nose_length_mm": 300.0},
        {"nose_length_mm": 600.0, "tail_length_mm": 1000.0, "tail_angle_deg": 15.0},
    ],
)
def test_a_bare_body_has_the_volume_of_its_outline(values):
    """Splines through 25 points of each end: 1e-4 of the volume is 0.01 mm on the radius of the preset."""
    hull = changed(fins=0, **values)
    body = torpedo(hull)
    area = lambda x: np.pi * float(torpedo_radius(hull, np.array(x))) ** 2  # noqa: E731
    shoulders = [hull.tail_length_mm / 1000 - 0.8, 0.8 - hull.nose_length_mm / 1000]
    assert body.volume == pytest.approx(1e9 * quad(area, -0.8, 0.8, points=shoulders)[0], rel=1e-4)
    assert (len(body.solids()), body.is_valid) == (1, True)


@pytest.mark.parametrize("fins", [1, 2, 3, 4, 8])
def test_fins_are_part_of_the_one_solid_and_leave_the_top_free(fins):
    shape = torpedo(changed(fins=fins))
    assert (len(shape.solids()), shape.is_valid) == (1, True)
    assert max(shape.bounding_box().max.Z, 115) == pytest.approx(max(115, 200 * np.cos(np.pi / fins) + 4), abs=4)


def test_the_presets_mount_is_bolted_to_the_cylinder_and_in_order():
    assert (fold_anchor(RIG).point_mm, fold_anchor(RIG).normal) == ((655, 0, 115), (0, 0, 1))
    assert assembly_problems(build_assembly(RIG)) == []
