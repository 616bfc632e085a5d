"""Tables of an ensemble whose dives are made up: means, pooled counts, pairs, and their texts."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from dives.ensembles.members import Choice, members
from dives.ensembles.run import Outcome
from dives.ensembles.tables import (
    AS_IT_IS,
    differences,
    differences_csv,
    differences_table,
    dives_csv,
    markdown,
    summary_csv,
    summary_rows,
    summary_table,
)
from dives.metrics import DEFINITIONS
from dives.metrics.intervals import Interval
from optics.workers.run import Failure


def outcome(member, **metrics):
    nothing = dict.fromkeys(DEFINITIONS) | {
        "passed": True,
        "losses": 0,
        "losses_reacquired": 0,
        "acquired": True,
        "loss_causes": {},
    }
    return Outcome(member=member, folder=Path(member.name), metrics=nothing | metrics, failure=None)


def failed(member):
    return Outcome(member=member, folder=Path(member.name), metrics=None, failure=Failure(sentence="no disk", trace=""))


@pytest.fixture
def outcomes():
    """Two loops, four seeds: errors of 1 to 4 degrees and twice as much; one dive of the second failed."""
    ensemble = members([Choice(key="variant", values=("default", "paper"))], seeds=range(4))
    found = []
    for member in ensemble:
        factor = {"default": 1, "paper": 2}[member.settings["variant"]]
        found.append(
            outcome(
                member,
                gaze_error_rms_deg=factor * (member.seed + 1.0),
                gaze_error_held_rms_deg=5.0 * factor + member.seed,
                losses=2,
                losses_reacquired=factor,
            )
            if (factor, member.seed) != (2, 3)
            else failed(member)
        )
    return found


def row_of(rows, settings, metric):
    (row,) = [row for row in rows if (row.settings, row.metric) == (settings, metric)]
    return row.interval


def test_means_and_pooled_counts(outcomes):
    rows = summary_rows(outcomes)
    assert row_of(rows, "variant = default", "gaze_error_rms_deg").estimate == 2.5
    assert row_of(rows, "variant = paper", "gaze_error_rms_deg").estimate == 4.0
    assert row_of(rows, "variant = paper", "gaze_error_rms_deg").count == 3
    # Four of eight losses of four dives, six of six of three: counted over all dives of a setting.
    recovered = row_of(rows, "variant = default", "recovered_fraction")
    assert (recovered.estimate, recovered.count) == (0.5, 8)
    assert row_of(rows, "variant = paper", "recovered_fraction").estimate == 1.0
    assert row_of(rows, "variant = paper", "acquired_fraction").count == 3
    assert row_of(rows, "variant = paper", "pixel_recall") == Interval(estimate=None, low=None, high=None, count=0)


def test_pairs_share_their_seed(outcomes):
    """Of the three pairs that both finished, the paper's loop errs by 1, 2 and 3 degrees more."""
    (row,) = [row for row in differences(outcomes, "variant") if row.metric == "gaze_error_rms_deg"]
    assert (row.value, row.baseline) == ("paper", "default")
    assert (row.interval.estimate, row.interval.count) == (2.0, 3)
    # 4.303 standard errors, of which one is 1 / sqrt(3).
    assert row.interval.high - 2.0 == pytest.approx(4.303 / 3**0.5, abs=1e-3)
    assert 2.0 - row.interval.low == pytest.approx(4.303 / 3**0.5, abs=1e-3)


def test_pairs_share_all_other_settings():
    """Depth changes the error by 10; within a depth the loops differ by exactly 1."""
    variations = [Choice(key="variant", values=("a", "b")), Choice(key="depth_m", values=(1, 2))]
    found = [
        outcome(m, gaze_error_rms_deg=10.0 * m.settings["depth_m"] + (m.settings["variant"] == "b"))
        for m in members(variations, seeds=[0])
    ]
    (row,) = [row for row in differences(found, "variant") if row.metric == "gaze_error_rms_deg"]
    assert (row.interval.low, row.interval.estimate, row.interval.high) == pytest.approx((1, 1, 1))


def test_what_cannot_be_compared_is_said(outcomes):
    with pytest.raises(ValueError, match="two values or more among variant, got 'depth_m'"):
        differences(outcomes, "depth_m")
    with pytest.raises(ValueError, match="two values or more among none, got 'variant'"):
        differences([outcome(member) for member in members([], seeds=[0, 1])], "variant")


def test_one_line_a_dive(outcomes):
    lines = list(csv.DictReader(io.StringIO(dives_csv(outcomes))))
    assert len(lines) == 8
    assert lines[1]["dive"] == "variant=default,seed=1"
    assert (lines[1]["variant"], lines[1]["seed"], lines[1]["gaze_error_rms_deg"]) == ("default", "1", "2.0")
    assert (lines[7]["failure"], lines[7]["gaze_error_rms_deg"]) == ("no disk", "")
    # Lists and tables of counts have no cell of their own.
    assert "loss_causes" not in lines[0]


def test_tables_in_markdown_and_csv(outcomes):
    rows, pairs = summary_rows(outcomes), differences(outcomes, "variant")
    table = markdown(summary_table(rows)).splitlines()
    assert table[:2] == ["| metric | variant = default | variant = paper |", "| --- | --- | --- |"]
    assert len(list(csv.reader(io.StringIO(summary_csv(rows))))) == 1 + len(rows)
    assert len(list(csv.reader(io.StringIO(differences_csv(pairs))))) == 1 + len(pairs)
    compared = dict(differences_table(pairs))
    assert compared["metric"] == "paper minus default"
    # Three differences of 1 to 3 leave zero possible, three of 5 do not.
    assert compared["gaze_error_rms_deg"] == "2 (-0.484 to 4.48)"
    assert compared["gaze_error_held_rms_deg"] == "5 (5 to 5) *"
    assert compared["losses"] == "0 (0 to 0)"


def test_an_ensemble_of_seeds_has_one_column():
    found = [outcome(member) for member in members([], seeds=[0, 1])]
    assert summary_table(summary_rows(found))[0] == ["metric", AS_IT_IS]
