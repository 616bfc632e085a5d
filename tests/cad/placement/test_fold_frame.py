"""From the body to the fold frame and back, for cameras that look anywhere."""

from types import SimpleNamespace

import numpy as np
import pytest

from cad.hulls.anchors import Anchor
from cad.placement.camera_sites import CameraSite
from cad.placement.fold_frame import BASE_ANCHOR, looking_ahead, pinned_seats, rig_of, turn_of
from optics.layout import Layout
from rigs import Rig


def looking(**angles: float) -> Rig:
    rig = Rig.load("torpedo")
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=angles)})


@pytest.mark.parametrize("direction", ["down", "up"])
def test_the_fold_frame_is_turned_as_the_layouts(direction: str) -> None:
    rig = looking(yaw_deg=20.0, pitch_deg=-30.0, roll_deg=40.0)
    expected = Layout.from_rig(rig.with_gaze(fold_mirror={"direction": direction})).body_from_fold.rotation
    np.testing.assert_allclose(turn_of(rig, direction).as_matrix(), expected.as_matrix(), rtol=0, atol=1e-14)


@pytest.mark.parametrize(("direction", "side"), [("down", 1.0), ("up", -1.0)])
def test_what_is_found_for_a_camera_that_looks_left_is_written_in_the_body(direction: str, side: float) -> None:
    """Looking left, x of the fold frame is the body's y, and y the body's -x, or for a fold up its x."""
    rig = looking(yaw_deg=90.0)
    shape = SimpleNamespace(design=np.array([100.0, 200.0, 70.0, 70.0, 100.0, 140.0]))
    seats = [
        Anchor(point_mm=(110.0, 7.0, 90.0), normal=(0.0, 0.0, 1.0)),
        Anchor(point_mm=(1.0, 2.0, -3.0), normal=(0.0, 0.6, -0.8)),
    ]
    site = CameraSite(pinhole_mm=(150.0, 7.04, 10.0), ahead_mm=28.0, radius_mm=23.0)
    found = rig_of(rig, SimpleNamespace(shape=shape, site=site, fold=seats[0], base=seats[1]), direction, set())
    mount = found.require_gaze().mount
    assert found.camera.position_mm == pytest.approx((-7.0 * side, 150.0, 10.0 * side))
    assert (found.camera.yaw_deg, found.require_gaze().fold_mirror.distance_mm) == (90.0, 100.0)
    assert mount.fold_anchor_mm == pytest.approx((-7.0 * side, 110.0, 90.0 * side))
    assert mount.fold_normal == pytest.approx((0.0, 0.0, side))
    assert mount.base_normal == pytest.approx((-0.6 * side, 0.0, -0.8 * side))
    (seat,) = pinned_seats(found, {BASE_ANCHOR}, turn_of(rig, direction).inv()).values()
    np.testing.assert_allclose(seat.point_mm, seats[1].point_mm, rtol=0, atol=1e-9)


def test_looking_ahead_leaves_all_but_the_angles() -> None:
    assert looking_ahead(looking(yaw_deg=90.0, pitch_deg=-10.0, roll_deg=5.0)) == Rig.load("torpedo")
