"""Design search: fronts by hand, constraints against the rig checks, coarse scores against coverage, and the search."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from plain_boxes import box_part

from optics.coverage.coverage import Coverage, compute_coverage
from optics.feasibility.envelope import hull_half_size
from optics.feasibility.feasibility import feasibility_problems
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.search import score as search_score
from optics.search import search as search_module
from optics.search.choice import MOST_CHECKED, choose
from optics.search.limits import CONSTRAINTS, binding, bounds_around, first_problem, rooms_mm, violated
from optics.search.objectives import (
    OBJECTIVES,
    area_cm2,
    costs,
    design_of,
    dominated_by,
    front,
    objectives_named,
    rig_with,
    spread_out,
    swept_volume_l,
)
from optics.search.score import CoarseScorer, Grid
from optics.search.search import NOTHING_SEEN, Search, search_designs
from optics.sizing.trade_off import plate_part, swept_sphere_m3
from rigs import BoxHull, Rig

SMALL = Grid(pan_steps=7, tilt_steps=9, columns=16, rows=12, nside=8)

ALL = tuple(OBJECTIVES.values())

COVERAGE_ERROR = 0.018
COVERAGE_SPREAD = 0.008
RESOLUTION_ERROR = 0.015
"""Of a coarse score, absolute and relative: seen over fourteen random designs of each preset were 0.016 and 0.010,
against 160 x 120 rays. Cells touched at the rim of what is covered count as a whole (0.012 on average for aqua2), holes
between rays as nothing; the reference decides its cells exactly and shares neither. What all designs share does not
matter to a search: about their mean the errors of coverage were at most 0.005."""


@pytest.fixture(scope="module", params=["aqua2", "bluerov2"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return Rig.load(request.param)


def boxed(rig: Rig) -> PartMesh:
    """The hull as a plain box that ends where its front does: parts come from outside `optics`."""
    assert rig.gaze.hull is not None and rig.gaze.hull.shape != "file"
    half = hull_half_size(rig.gaze.hull)
    if not isinstance(rig.gaze.hull, BoxHull):
        half = half * [0.9, 0.5, 0.5]
    return box_part(-half, half, group=Group.FIXED, role=Role.HULL, name="hull")


def designs_around(rig: Rig, count: int, spread: tuple[float, float] = (0.75, 1.4)) -> FloatArray:
    return np.round(design_of(rig) * np.random.default_rng(1).uniform(*spread, (count, 6)), 1)


def test_a_front_by_hand() -> None:
    rows = np.array([[1.0, 5.0], [2.0, 2.0], [5.0, 1.0], [2.0, 3.0], [2.0, 2.0], [6.0, 6.0]])
    np.testing.assert_array_equal(front(rows), [0, 1, 2])
    np.testing.assert_array_equal(dominated_by(rows, rows), [False, False, False, True, False, True])
    assert len(front(np.empty((0, 2)))) == 0


def test_a_front_is_that_of_all_pairs() -> None:
    rows = np.random.default_rng(0).random((3000, 3)).round(2)
    kept = set(front(rows).tolist())
    for index in range(0, len(rows), 7):
        worse = ((rows <= rows[index]).all(axis=1) & (rows < rows[index]).any(axis=1)).any()
        equal_before = (rows[:index] == rows[index]).all(axis=1).any()
        assert (index in kept) is not (worse or equal_before)


def test_spread_keeps_the_extremes() -> None:
    rows = np.stack([np.linspace(0, 1, 100), np.linspace(1, 0, 100) ** 2], axis=1)
    chosen = spread_out(rows, 5)
    assert len(chosen) == 5 and {0, 99} <= set(chosen.tolist())
    # Five points on an arc of length about 1.5 whose nearest pair is not closer than half of an even spacing.
    gaps = np.linalg.norm(np.diff(rows[chosen], axis=0), axis=1)
    assert gaps.min() > 0.15
    np.testing.assert_array_equal(spread_out(rows[:3], 5), [0, 1, 2])


def test_wrong_objectives_are_sentences() -> None:
    for names in (["coverage"], ["coverage", "beauty"], ["area", "area"]):
        with pytest.raises(ValueError, match="two or more of the objectives coverage, area, swept-volume, resolution"):
            objectives_named(names)


def test_area_and_swept_volume_are_closed_forms(rig: Rig) -> None:
    design = design_of(rig)[np.newaxis]
    m1, m2 = rig.gaze.fold_mirror, rig.gaze.gaze_mirror
    assert area_cm2(rig, design)[0] == pytest.approx((m1.width_mm * m1.height_mm + m2.width_mm * m2.height_mm) / 100)
    # The sizing's sphere, written for one mirror.
    assert swept_volume_l(rig, design)[0] == pytest.approx(1000 * swept_sphere_m3(m2))


def test_a_design_becomes_a_rig_and_back(rig: Rig) -> None:
    design = designs_around(rig, 1)[0]
    np.testing.assert_array_equal(design_of(rig_with(rig, design)), design)


def test_coarse_scores_are_those_of_coverage(rig: Rig) -> None:
    """Hull and M1's plate in the way, against 61 x 61 poses for what is covered, 160 x 120 rays for the resolution."""
    designs = designs_around(rig, 6)
    scores = CoarseScorer(rig, [boxed(rig)]).scores(designs, ALL)
    joints = rig.gaze.joints
    assert joints is not None

    def found(design: FloatArray, steps: tuple[int, int], **options: int) -> Coverage:
        built = rig_with(rig, design)
        plate = plate_part("m1", built.gaze.fold_mirror, Layout.from_rig(built).body_from_m1, Group.FIXED)
        q1, q2 = joints.pan.values(steps[0]), joints.tilt.values(steps[1])
        return compute_coverage(built, [boxed(rig), plate], q1=q1, q2=q2, **options)

    weight = [np.where(np.arange(count) % (count - 1), 1.0, 0.5) for count in (41, 21)]
    weights = np.outer(*weight) / np.outer(*weight).sum()
    fine = []
    for design in designs:
        seen = found(design, (21, 41), columns=160, rows=120, nside=8)
        share = (seen.pixels[..., 0] * weights).sum() / seen.pixels[0, 0].sum()
        pixels = share * rig.camera.width_px * rig.camera.height_px
        fine.append((found(design, (61, 61)).covered_fraction, pixels))
    covered, resolution = np.array(fine).T
    np.testing.assert_allclose(scores[:, 0], covered, atol=COVERAGE_ERROR)
    error = scores[:, 0] - covered
    np.testing.assert_allclose(error, error.mean(), atol=COVERAGE_SPREAD)
    np.testing.assert_allclose(scores[:, 3], resolution, rtol=RESOLUTION_ERROR)
    # What a search needs: the order of designs that differ by more than the error.
    for a, b in ((a, b) for a in range(6) for b in range(6)):
        if covered[a] > covered[b] + 2 * COVERAGE_ERROR:
            assert scores[a, 0] > scores[b, 0]


def test_the_hull_takes_from_the_view(rig: Rig) -> None:
    design = design_of(rig)[np.newaxis]
    bare, hidden = (CoarseScorer(rig, parts).scores(design, ALL)[0] for parts in ([], [boxed(rig)]))
    assert hidden[0] < bare[0]
    assert hidden[3] < bare[3]
    np.testing.assert_array_equal(hidden[1:3], bare[1:3])


def test_many_designs_score_as_each_alone(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    scorer = CoarseScorer(rig, [boxed(rig)], SMALL)
    monkeypatch.setattr(search_score, "LANES_PER_LAUNCH", 40 * SMALL.poses * SMALL.rays)
    designs = designs_around(rig, 90)
    together = scorer.scores(designs, ALL)
    for index in (0, 41, 89):
        np.testing.assert_array_equal(together[index], scorer.scores(designs[index : index + 1], ALL)[0])


def test_mirrors_that_show_nothing_have_no_score() -> None:
    rig = Rig.load("aqua2")
    far = design_of(rig)
    far[1] = 5000.0
    far[4:] = 10.0
    assert np.isnan(CoarseScorer(rig, []).scores(far[np.newaxis], ALL)).all()


def test_derivatives_are_those_of_the_soft_resolution(rig: Rig) -> None:
    # Forward differentiation against central differences of 1e-4 mm: cut off at 1e-8, rounding at 1e-11 of the value.
    scorer = CoarseScorer(rig, [], SMALL)
    designs = designs_around(rig, 2)
    value, derivatives = scorer.soft_resolution_derivatives(designs)
    for parameter in range(6):
        step = np.zeros(6)
        step[parameter] = 1e-4
        up, down = (scorer.soft_resolution_derivatives(designs + sign * step)[0] for sign in (1, -1))
        np.testing.assert_allclose(derivatives[:, parameter], (up - down) / 2e-4, rtol=1e-6, atol=1e-9 * value.max())
    # Larger mirrors show more, farther ones less.
    assert (derivatives[:, 2:] > 0).all()
    assert (derivatives[:, :2] < 0).all()


def test_designs_without_violations_are_feasible(rig: Rig) -> None:
    """The vectorised constraints are on the safe side of `optics.feasibility.feasibility`."""
    designs = designs_around(rig, 12, (0.5, 1.7))
    wrong = violated(rooms_mm(rig, designs))
    assert wrong.any() and not wrong.all(axis=1).any()
    for design, own in zip(designs, wrong, strict=True):
        problems = feasibility_problems(rig_with(rig, design))
        if not own.any():
            assert problems == []
        if problems:
            assert own[: len(CONSTRAINTS)].any()


@pytest.mark.parametrize(
    ("index", "value", "constraint"),
    [
        (0, 50.0, "M1 clear of the port"),
        (1, 80.0, "room to turn: M2 clear of M1"),
        (2, 260.0, "M1 on the printer bed"),
        (5, 260.0, "M2 on the printer bed"),
        (3, 5.0, "M1 thicker than half its side"),
        (4, 5.0, "M2 thicker than half its side"),
    ],
)
def test_what_is_violated_has_a_name(index: int, value: float, constraint: str) -> None:
    # The first two are those of the tests of `optics.feasibility.feasibility`, where they are impossible too.
    rig = Rig.load("aqua2")
    design = design_of(rig)
    design[index] = value
    assert violated(rooms_mm(rig, design[np.newaxis]))[0, CONSTRAINTS.index(constraint)]


def test_room_to_turn_is_a_closed_form() -> None:
    # M1 at 45 degrees below which M2 hangs: the nearest point of the plate is its front edge, h / 2 down the slope.
    rig = Rig.load("aqua2")
    design = design_of(rig)
    half = design[3] / 2 / np.sqrt(2)
    edge = np.hypot(half, design[1] - half) - np.sqrt((design[4] / 2) ** 2 + (design[5] / 2) ** 2 + 3.0**2)
    flat = design[1] / np.sqrt(2) - np.sqrt((design[4] / 2) ** 2 + (design[5] / 2) ** 2 + 3.0**2)
    room = rooms_mm(rig, design[np.newaxis])[0, CONSTRAINTS.index("room to turn: M2 clear of M1")]
    # The plate's back is 3 mm further from M2 where its foot is off the plate.
    assert room == pytest.approx(max(edge, flat), abs=1e-6)


def test_what_binds_is_named() -> None:
    rig = Rig.load("aqua2")
    low, high = bounds_around(rig, 1.5)
    assert binding(rig, design_of(rig), low, high) == []
    design = design_of(rig)
    design[0] = low[0]
    assert "smallest fold_mirror.distance_mm" in binding(rig, design, low, high)
    with pytest.raises(ValueError, match="a factor above 1"):
        bounds_around(rig, 1.0)


@pytest.fixture(scope="module", autouse=True)
def coarser() -> Iterator[None]:
    """Searches of these tests score more coarsely than users' do: what is tested here does not depend on it."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(search_module, "GRID", SMALL)
        patched.setattr(search_module, "DERIVATIVE_GRID", SMALL)
        yield


def searched(rig: Rig, **options: object) -> Search:
    settings: dict[str, object] = {"designs": 200, "seed": 3, **options}
    return search_designs(rig, [boxed(rig)], ["coverage", "area", "resolution"], **settings)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def found() -> Search:
    return searched(Rig.load("aqua2"))


def test_no_member_of_the_front_is_beaten(found: Search) -> None:
    good = np.isfinite(found.scores).all(axis=1)
    everything = costs(found.scores[good], found.objectives)
    assert not dominated_by(costs(found.scores[found.front], found.objectives), everything).any()
    assert ((found.designs[found.front] >= found.low) & (found.designs[found.front] <= found.high)).all()
    assert found.rejected["room to turn: M2 clear of M1"] > 0
    rig = Rig.load("aqua2")
    for row in found.front[:10]:
        assert feasibility_problems(rig_with(rig, found.designs[row])) == []


def test_the_front_holds_the_best_of_each(found: Search) -> None:
    coverages, areas, resolutions = found.scores[found.front].T
    assert coverages.max() == np.nanmax(found.scores[:, 0])
    assert areas.min() == np.nanmin(found.scores[:, 1])
    assert resolutions.max() == np.nanmax(found.scores[:, 2])


def test_gathering_and_polishing_beat_filling(found: Search) -> None:
    filling = slice(0, 101)
    first = found.scores[filling]
    first = costs(first[np.isfinite(first).all(axis=1)], found.objectives)
    # Most members of the first half's front are beaten by what came later.
    early = first[front(first)]
    assert dominated_by(early, costs(found.scores[found.front], found.objectives)).mean() > 0.4
    assert (found.front > 200).any()


def test_the_front_can_be_reproduced(found: Search) -> None:
    rig = Rig.load("aqua2")
    rows = found.front[:3]
    made = [rig_with(rig, found.designs[row]) for row in rows]
    again = np.concatenate(
        [CoarseScorer(one, [boxed(one)], SMALL).scores(design_of(one)[np.newaxis], found.objectives) for one in made]
    )
    np.testing.assert_array_equal(again, found.scores[rows])


def test_the_same_seed_gives_the_same_bytes(found: Search) -> None:
    again, other = searched(Rig.load("aqua2")), searched(Rig.load("aqua2"), seed=4, designs=4)
    assert again.designs.tobytes() == found.designs.tobytes()
    assert again.scores.tobytes() == found.scores.tobytes()
    assert not np.array_equal(other.designs[:3], found.designs[:3])


def test_an_interrupted_search_ends_at_the_same_front(found: Search) -> None:
    remembered: dict[str, tuple[FloatArray, FloatArray]] = {}
    computed: list[str] = []

    def until(limit: int) -> object:
        def checkpoint(name: str, work):  # type: ignore[no-untyped-def]
            if name not in remembered:
                if len(remembered) == limit:
                    raise KeyboardInterrupt
                remembered[name] = work()
                computed.append(name)
            return remembered[name]

        return checkpoint

    with pytest.raises(KeyboardInterrupt):
        searched(Rig.load("aqua2"), checkpoint=until(4))
    again = searched(Rig.load("aqua2"), checkpoint=until(100))
    assert len(computed) == len(set(computed)) == 7
    assert again.scores.tobytes() == found.scores.tobytes()
    np.testing.assert_array_equal(again.front, found.front)


def test_what_cannot_be_built_is_counted(found: Search) -> None:
    limited = searched(
        Rig.load("aqua2"), designs=64, buildable=lambda rig: "too wide" if design_of(rig)[2] > 80.0 else ""
    )
    assert (limited.designs[limited.front, 2] <= 80.0).all()
    assert limited.rejected["too wide"] > 0
    assert NOTHING_SEEN not in limited.rejected


def test_nothing_possible_is_a_sentence() -> None:
    rig = Rig.load("aqua2")
    with pytest.raises(ValueError, match=r"got none of 17") as error:
        searched(rig, designs=16, buildable=lambda _: "no printer")
    assert "no printer" in str(error.value)
    with pytest.raises(ValueError, match="designs > 0"):
        searched(rig, designs=0)
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        search_designs(Rig.load("bench"), [], ["coverage", "area"])


def test_chosen_members_pass_the_closer_check(found: Search) -> None:
    looked: list[float] = []

    def problems_of(designs: list[FloatArray]) -> list[str]:
        looked.extend(float(design[0]) for design in designs)
        return ["too far" if design[0] > 90.0 else "" for design in designs]

    rows, problems = choose(found, 5, problems_of)
    assert 1 <= len(rows) <= 5
    assert (found.designs[rows, 0] <= 90.0).all()
    assert all(found.designs[row, 0] > 90.0 for row in problems)
    assert len(looked) == len(set(rows) | set(problems)) or len(looked) >= len(rows)
    none, all_problems = choose(found, 5, lambda designs: ["no"] * len(designs))
    assert none == [] and len(all_problems) >= min(MOST_CHECKED, len(found.front))
    assert first_problem(Rig.load("aqua2"), found.designs[found.front[0]]) == ""
