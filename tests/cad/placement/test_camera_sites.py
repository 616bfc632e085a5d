import numpy as np
import pytest

from cad.hulls.camera_housing import HOUSING_MM
from cad.placement.camera_sites import PROUD_MM, CameraSite, camera_sites
from cad.placement.seats import SeatFinder
from rigs import Rig
from tests.cad.placement.conftest import LENGTH_MM, RADIUS_MM


def test_the_port_stands_in_front_of_the_nose(finder: SeatFinder) -> None:
    rig = Rig.load("torpedo")
    assert rig.port.shape == "flat"
    sites = camera_sites(rig, finder.space, 0.0)
    depth = rig.port.distance_mm + rig.port.thickness_mm
    foremost = min(sites, key=lambda site: site.behind_nose_mm + site.gap_mm)
    assert abs(foremost.pinhole_mm[0] + depth - LENGTH_MM / 2 - PROUD_MM) < finder.space.step_mm
    assert abs(foremost.pinhole_mm[2]) < 20
    # Where a port would look past the nose there is no place for it.
    assert max(abs(site.pinhole_mm[2]) for site in sites) < RADIUS_MM


def test_a_camera_takes_up_a_cylinder_behind_its_ports_face() -> None:
    site = CameraSite(pinhole_mm=(100.0, 0.0, 10.0), ahead_mm=28.0, radius_mm=23.0)
    places = np.array([[127.0, 0.0, 50.0], [127.0, 30.0, 10.0], [128.1, 0.0, 10.0], [127.9 - HOUSING_MM, 0.0, 10.0]])
    assert site.room_mm(places[:1]) == pytest.approx(40 - 23)
    assert site.room_mm(places[:2]) == pytest.approx(30 - 23)
    assert site.room_mm(places[2:]) == np.inf
