"""The page of the arena: each loop's numbers, the same by factor, and the dives that went worst."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dives.arena.judged import SHORTEST_AVAILABLE_S
from dives.arena.run import ArenaOutcome
from dives.arena.tables import ALL, HEADLINES, MEANINGS, ArenaRow, is_available
from dives.metrics.intervals import Interval
from reports.pages import content, page
from tracking.loop.ablations import ABLATIONS

APART = {("red decoy", "no"): "  without a red decoy", ("red decoy", "yes"): "  with one"}
"""Factor and level of dives whose headlines stand beside those of all: two red balls cannot be told apart by looks."""

INTERVALS = (
    "In brackets intervals of 95 %: Wilson's for shares of dives and losses, Student's for means, order statistics for "
    "medians."
)


@dataclass(frozen=True, kw_only=True)
class WorstDive:
    """A dive with its story and images, and a video of it if there is one."""

    outcome: ArenaOutcome
    story: str
    images: Sequence[tuple[Path, str]]
    video: Path | None = None


@dataclass(frozen=True, kw_only=True)
class ArenaResults:
    """What the page reports.

    Attributes
    ----------
    outcomes : sequence of ArenaOutcome
    rows : sequence of ArenaRow
    differences : sequence of tuple
        Loop, metric, mean difference to the first loop over the same seeds.
    worst : sequence of WorstDive
    """

    outcomes: Sequence[ArenaOutcome]
    rows: Sequence[ArenaRow]
    differences: Sequence[tuple[str, str, Interval]]
    worst: Sequence[WorstDive]

    @property
    def variants(self) -> list[str]:
        """The loops, in their order."""
        return list(dict.fromkeys(outcome.variant for outcome in self.outcomes))

    def table(self) -> list[list[str]]:
        """Metrics down, loops that are reported in full across; the head first.

        Below a headline of all dives stand those without a red decoy and those with one.
        """
        loops = in_full(self.variants)
        cells = {(row.variant, row.metric, row.factor, row.level): str(row.interval) for row in self.rows}
        rows = [
            [words, *(cells.get((variant, metric, *dives), "-") for variant in loops)]
            for metric in MEANINGS
            for dives, words in ({(ALL, ""): metric} | (APART if metric in HEADLINES else {})).items()
        ]
        return [["metric", *loops], *rows]

    def difference_table(self) -> list[list[str]]:
        """Loops down but the first, pairs of dives and mean differences of headlines across; the head first."""
        found = {(variant, metric): interval for variant, metric, interval in self.differences}
        rows = []
        for variant in self.variants[1:]:
            intervals = [found[variant, metric] for metric in HEADLINES]
            rows.append([variant, str(intervals[0].count), *map(str, intervals)])
        return [[f"difference to {self.variants[0]}", "pairs", *HEADLINES], *rows]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        usable = [outcome.variant for outcome in self.outcomes if is_available(outcome)]
        return {
            "meanings": MEANINGS,
            "available": {variant: usable.count(variant) for variant in self.variants},
            "summary": [asdict(row) for row in self.rows],
            "differences": [
                {"loop": variant, "metric": metric, "interval": asdict(interval)}
                for variant, metric, interval in self.differences
            ],
            "worst": [_about(each.outcome) | {"story": each.story, "video": _video_file(each)} for each in self.worst],
            "dives": [
                _about(outcome)
                | {"failure": outcome.failure.sentence if outcome.failure else None, "numbers": outcome.numbers}
                for outcome in self.outcomes
            ],
        }


def _about(outcome: ArenaOutcome) -> dict[str, Any]:
    return {"seed": outcome.seed, "loop": outcome.variant, "factors": dict(outcome.factors)}


def in_full(variants: Sequence[str]) -> list[str]:
    """Loops that are reported with all their numbers and worst dives: the first, and those that are no ablation.

    Of an ablation the difference to the first is reported.
    """
    return [variant for number, variant in enumerate(variants) if number == 0 or variant not in ABLATIONS]


def _video_file(dive: WorstDive) -> str | None:
    """Named from the report's folder."""
    return None if dive.video is None else f"{dive.outcome.folder.name}/{dive.video.name}"


def arena_page(results: ArenaResults) -> str:
    """Page of the arena as HTML."""
    sections: list[content.Block] = [content.Title(name="Arena"), _numbers(results)]
    if results.differences:
        sections.append(_differences(results))
    sections += [_by_factor(results.rows, variant) for variant in in_full(results.variants)]
    sections += [_worst(each) for each in results.worst]
    return page.page("Arena", sections)


def _numbers(results: ArenaResults) -> content.Section:
    (_, *loops), *rows = results.table()
    return content.section(
        "Numbers",
        content.paragraph(_counts(results)),
        content.table(
            ["", *loops],
            [[MEANINGS.get(metric, metric), *cells] for metric, *cells in rows],
        ),
        content.paragraph(INTERVALS),
    )


def _counts(results: ArenaResults) -> str:
    seeds = len({outcome.seed for outcome in results.outcomes})
    usable = len({outcome.seed for outcome in results.outcomes if is_available(outcome)})
    return (
        f"{seeds} seeds. In {usable} of them the target could be seen for {SHORTEST_AVAILABLE_S:g} s or more in the "
        "dives of one loop at least; those count."
    )


def _differences(results: ArenaResults) -> content.Section:
    (_, pairs, *metrics), *rows = results.difference_table()
    first = results.variants[0]
    return content.section(
        f"Difference to {first}, seed by seed",
        content.table(["", pairs, *(MEANINGS[metric] for metric in metrics)], rows, numbers=[1]),
        content.paragraph(
            f"Mean over the seeds that both loops dived, in brackets Student's interval of 95 %; above 0 it is more "
            f"than with {first}. Pairs of which one has no number do not count: a dive that follows nothing has no "
            "identity errors."
        ),
    )


def _by_factor(rows: Sequence[ArenaRow], variant: str) -> content.Section:
    found: dict[tuple[str, str], dict[str, ArenaRow]] = {}
    for row in rows:
        if row.variant == variant and row.factor != ALL and row.metric in HEADLINES:
            found.setdefault((row.factor, row.level), {})[row.metric] = row
    return content.section(
        f"By factor, loop {variant}",
        content.table(
            ["Factor", "", "Dives", *(MEANINGS[metric] for metric in HEADLINES)],
            [
                [factor, level, str(by["acquired_fraction"].interval.count)]
                + [str(by[metric].interval) for metric in HEADLINES]
                for (factor, level), by in found.items()
            ],
            numbers=[2],
        ),
    )


def _worst(dive: WorstDive) -> content.Section:
    outcome = dive.outcome
    factors = ", ".join(f"{factor}: {level}" for factor, level in outcome.factors.items())
    video = _video_file(dive)
    return content.section(
        f"Seed {outcome.seed}, loop {outcome.variant}",
        content.paragraph(dive.story),
        content.paragraph(factors),
        *([] if video is None else [content.paragraph(content.Link(file=video, words="what the loop saw, as video"))]),
        content.gallery(content.figure(path, caption) for path, caption in dive.images),
    )
