from cad.placement.camera_sites import PROUD_MM, camera_sites
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
