"""Blind patches, dwell and resolution of coverages whose answer is known, and the order of convergence."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from optics.camera import PinholeCamera
from optics.coverage.blind import OUT_OF_REACH, blind_causes, blind_patches, rim_fraction
from optics.coverage.convergence import convergence, extrapolate
from optics.coverage.coverage import Coverage
from optics.coverage.dwell import dwell
from optics.coverage.field import pixel_solid_angles, pixels_per_degree
from optics.coverage.outcome import Outcome
from optics.coverage.sphere import cell_count, cell_directions
from optics.ports.port import FlatPort, NoPort
from rigs import Rig

NSIDE = 32
CELL_WIDTH_DEG = np.degrees(np.sqrt(4 * np.pi / cell_count(NSIDE)))


def coverage_of(poses_seeing: NDArray[np.int64], stopped: NDArray[np.int64] | None = None) -> Coverage:
    """A coverage with a given sphere."""
    poses_by_outcome = (
        np.zeros((len(Outcome), len(poses_seeing)), dtype=np.int64) if stopped is None else stopped.copy()
    )
    poses_by_outcome[Outcome.SEEN] = poses_seeing
    return Coverage(
        q1_deg=np.zeros(1),
        q2_deg=np.zeros(1),
        pixels=np.zeros((1, 1, len(Outcome)), dtype=np.int64),
        solid_angle_by_outcome_sr=np.zeros((1, 1, len(Outcome))),
        solid_angle_by_region_sr=np.zeros((1, 1, 4, len(Outcome))),
        nside=int(np.sqrt(len(poses_seeing) / 12)),
        poses_by_outcome=poses_by_outcome,
        pixels_per_degree=np.zeros(len(poses_seeing)),
    )


def angle_to(azimuth_deg: float, elevation_deg: float) -> NDArray[np.float64]:
    """Of every cell's centre, degrees."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    axis = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    return np.degrees(np.arccos(np.clip(cell_directions(NSIDE) @ axis, -1, 1)))


def test_caps_are_found_with_place_size_and_cause() -> None:
    """Three blind caps, one over the seam behind the robot, one at the zenith; two with a part in the way."""
    caps = {(180.0, 10.0): 20.0, (-60.0, -30.0): 10.0, (0.0, 90.0): 15.0}
    seeing = np.ones(cell_count(NSIDE), dtype=np.int64)
    stopped = np.zeros((len(Outcome), len(seeing)), dtype=np.int64)
    for place, radius in caps.items():
        seeing[angle_to(*place) < radius] = 0
    stopped[Outcome.HULL, angle_to(180.0, 10.0) < 20.0] = 5
    stopped[Outcome.SERVO, angle_to(180.0, 10.0) < 20.0] = 4
    # Of the small cap only the inner part is hidden, the rest is out of reach.
    stopped[Outcome.MOUNT, angle_to(-60.0, -30.0) < 8.0] = 1
    found = blind_patches(coverage_of(seeing, stopped))
    assert len(found) == 3
    for patch, (place, radius) in zip(found, sorted(caps.items(), key=lambda cap: -cap[1]), strict=True):
        # Whole cells by their centres: the area lies between those of caps smaller and larger by half a cell.
        least, most = (2 * np.pi * (1 - np.cos(np.radians(radius + k * CELL_WIDTH_DEG / 2))) for k in (-1, 1))
        assert least < patch.solid_angle_sr < most
        middle = np.radians([patch.azimuth_deg, patch.elevation_deg])
        axis = [np.cos(middle[1]) * np.cos(middle[0]), np.cos(middle[1]) * np.sin(middle[0]), np.sin(middle[1])]
        off = angle_to(*place)[np.argmax(cell_directions(NSIDE) @ axis)]
        assert off < CELL_WIDTH_DEG
        assert patch.radius_deg == pytest.approx(radius, abs=CELL_WIDTH_DEG)
    assert [patch.cause for patch in found] == ["hull", "reach", "mount"]
    assert found[0].cause_share == found[1].cause_share == 1
    area = (1 - np.cos(np.radians(8))) / (1 - np.cos(np.radians(10)))
    assert found[2].cause_share == pytest.approx(area, abs=0.05)


def test_a_ring_is_one_patch_and_its_middle_is_blind() -> None:
    seeing = np.where(np.abs(cell_directions(NSIDE)[:, 2]) < 0.2, 0, 1)
    (patch,) = blind_patches(coverage_of(seeing))
    assert patch.solid_angle_sr == pytest.approx(4 * np.pi * 0.2, rel=0.05)
    assert abs(patch.elevation_deg) < CELL_WIDTH_DEG
    assert patch.radius_deg == pytest.approx(np.degrees(np.arcsin(0.2)), abs=CELL_WIDTH_DEG)


def test_a_line_of_seen_cells_parts_two_patches() -> None:
    azimuth = np.arctan2(cell_directions(NSIDE)[:, 1], cell_directions(NSIDE)[:, 0])
    blind = angle_to(0.0, 0.0) < 20
    seen = ~blind | (np.abs(np.degrees(azimuth)) < 1.5 * CELL_WIDTH_DEG)
    assert len(blind_patches(coverage_of(np.where(~blind, 1, 0)))) == 1
    assert len(blind_patches(coverage_of(np.where(seen, 1, 0)))) == 2


def test_nothing_or_everything_seen() -> None:
    cells = cell_count(NSIDE)
    assert blind_patches(coverage_of(np.ones(cells, dtype=np.int64))) == []
    assert rim_fraction(coverage_of(np.ones(cells, dtype=np.int64))) == 0
    (patch,) = blind_patches(coverage_of(np.zeros(cells, dtype=np.int64)))
    assert patch.solid_angle_sr == pytest.approx(4 * np.pi)
    assert rim_fraction(coverage_of(np.zeros(cells, dtype=np.int64))) == 0
    assert (blind_causes(coverage_of(np.zeros(cells, dtype=np.int64))) == OUT_OF_REACH).all()


def test_the_rim_is_a_row_of_cells() -> None:
    # Around a cap of 30 degrees: between one and two cells wide, as neighbours over a corner count.
    seeing = np.where(angle_to(20.0, 40.0) < 30, 1, 0)
    length = 2 * np.pi * np.sin(np.radians(30))
    rows = rim_fraction(coverage_of(seeing)) * 4 * np.pi / (length * np.radians(CELL_WIDTH_DEG))
    assert 1 < rows < 2


def test_dwell_counts_poses() -> None:
    seeing = np.zeros(cell_count(4), dtype=np.int64)
    seeing[:7] = [1, 1, 2, 5, 5, 5, 9]
    found = dwell(coverage_of(seeing))
    assert (found.minimum, found.median, found.maximum) == (1, 5.0, 9)
    assert found.once_fraction == pytest.approx(2 / 192)
    assert found.histogram == (185, 2, 1, 0, 0, 3, 0, 0, 0, 1)
    nothing = dwell(coverage_of(np.zeros_like(seeing)))
    assert (nothing.minimum, nothing.median, nothing.maximum, nothing.once_fraction) == (0, 0.0, 0, 0.0)


def test_resolution_on_the_axis_is_that_of_the_focal_length() -> None:
    """In air f px per radian, n times that behind a flat port (paraxial limit), and 1 / cos^1.5 more off the axis."""
    camera = PinholeCamera(width_px=640, height_px=480, fx_px=500.0, fy_px=500.0, cx_px=319.5, cy_px=239.5)
    in_air = pixels_per_degree(camera, NoPort()).reshape(480, 640)
    assert in_air[240, 320] == pytest.approx(np.radians(500), rel=1e-5)
    # A plane at distance f shows cos^3 of its area as solid angle: the root is the resolution.
    cosine = 500 / np.hypot(500, np.hypot(300.5, 200.5))
    assert in_air[440, 620] == pytest.approx(np.radians(500) / cosine**1.5, rel=1e-5)
    port = FlatPort(distance_m=0.02, thickness_m=0.008, n_water=1.34)
    assert pixels_per_degree(camera, port).reshape(480, 640)[240, 320] == pytest.approx(
        1.34 * np.radians(500), rel=1e-5
    )


def test_resolution_does_not_depend_on_the_cells() -> None:
    camera = PinholeCamera(width_px=640, height_px=480, fx_px=500.0, fy_px=500.0, cx_px=319.5, cy_px=239.5)
    coarse = pixels_per_degree(camera, NoPort(), 32, 24)
    pixels = 640 * 480 / (32 * 24)
    np.testing.assert_allclose(np.radians(np.sqrt(pixels / pixel_solid_angles(camera, NoPort(), 32, 24))), coarse)
    assert coarse.max() == pytest.approx(pixels_per_degree(camera, NoPort()).max(), rel=0.05)


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
def test_extrapolation_finds_order_and_limit(order: float) -> None:
    found = extrapolate([3 + 0.7 * step**order for step in (4.0, 2.0, 1.0)])
    assert found.order == pytest.approx(order)
    assert found.estimate == pytest.approx(3)


@pytest.mark.parametrize("values", [(1.0, 2.0, 1.5), (1.0, 1.1, 1.3), (1.0, 2.0, 3.0), (1.0, 1.0, 1.1)])
def test_what_does_not_shrink_has_no_order(values: tuple[float, float, float]) -> None:
    found = extrapolate(values)
    assert (found.order, found.estimate) == (None, None)
    assert found.values == values


def test_what_does_not_change_is_its_own_limit() -> None:
    found = extrapolate([0.3, 0.3, 0.3])
    assert (found.order, found.estimate) == (None, 0.3)


def test_coverage_of_bare_mirrors_converges() -> None:
    """The study that the report prints, on a small grid.

    Rationale: poses only sample the joints' ranges; cells of the sphere at the rim count by their centre, an error
    without a sign; cells of the image do not decide what is covered.
    Expected: finer steps of the poses add to what is covered, and less each time; a finer sphere changes it by less
    than 0.002; finer images not at all. Solid angles do not see the sphere.
    """
    seen: list[str] = []
    study = {refinement.name: refinement for refinement in convergence(Rig.load("aqua2"), [], done=seen.append)}
    for name, refinement in study.items():
        print(name, refinement.covered_fraction, refinement.mean_solid_angle_sr)
    assert len(seen) == 12
    coarse, middle, fine = study["poses"].covered_fraction.values
    order = study["poses"].covered_fraction.order
    assert coarse < middle < fine
    assert order is not None and order > 0.8
    assert len(set(study["pixels"].covered_fraction.values)) == 1
    assert study["pixels"].covered_fraction.estimate == study["pixels"].covered_fraction.values[0]
    assert np.ptp(study["sphere"].covered_fraction.values) < 0.002
    assert len(set(study["sphere"].mean_solid_angle_sr.values)) == 1


def test_studies_that_cannot_be_halved_are_refused() -> None:
    rig = Rig.load("aqua2")
    for options, message in [
        ({"columns": 62}, "multiples of 4, got 62 and 48"),
        ({"nside": 2}, "nside of at least 4, got 2"),
        ({"nside": 48}, "power of two"),
    ]:
        with pytest.raises(ValueError, match=message):
            convergence(rig, [], **options)  # type: ignore[arg-type]


def test_patches_are_plain_data() -> None:
    (patch,) = blind_patches(coverage_of(np.zeros(cell_count(NSIDE), dtype=np.int64)))
    assert set(dataclasses.asdict(patch)) == {
        "azimuth_deg",
        "elevation_deg",
        "radius_deg",
        "solid_angle_sr",
        "cause",
        "cause_share",
    }
