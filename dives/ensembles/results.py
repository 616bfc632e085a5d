"""Results of an ensemble: its dives, their summary, and the differences between settings, as tables and as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dives.ensembles import tables
from dives.ensembles.factors import METRICS, Effect, effects, effects_csv, levels_csv
from dives.ensembles.run import Outcome
from dives.ensembles.tables import Difference, Row
from dives.files import json_text
from rigs.atomic_files import write_text


@dataclass(frozen=True, kw_only=True)
class EnsembleResults:
    """What an ensemble found.

    Attributes
    ----------
    outcomes : sequence of Outcome
        Of each dive.
    summary : list of Row
        Metrics of each setting with their intervals.
    differences : list of Difference
        Between the values of a key, over pairs of the same seed; empty where none was varied.
    effects : list of Effect
        Of the keys on `dives.ensembles.factors.METRICS`; empty where they were not asked for.
    """

    outcomes: Sequence[Outcome]
    summary: list[Row]
    differences: list[Difference]
    effects: list[Effect]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {
            "dives": [
                {
                    "name": outcome.member.name,
                    "settings": outcome.member.settings,
                    "seed": outcome.member.seed,
                    "failure": outcome.failure.sentence if outcome.failure else None,
                    "metrics": outcome.metrics,
                }
                for outcome in self.outcomes
            ],
            "summary": [asdict(row) for row in self.summary],
            "differences": [asdict(pair) for pair in self.differences],
            "effects": [asdict(effect) for effect in self.effects],
        }


def ensemble_results(outcomes: Sequence[Outcome], key: str | None, *, grid: bool = False) -> EnsembleResults:
    """Results of an ensemble; the values of a key are compared pair by pair, and those of a grid all together."""
    return EnsembleResults(
        outcomes=outcomes,
        summary=tables.summary_rows(outcomes),
        differences=[] if key is None else tables.differences(outcomes, key),
        effects=[effect for metric in METRICS for effect in effects(outcomes, metric)] if grid else [],
    )


def write_results(results: EnsembleResults, folder: Path) -> list[str]:
    """Write the tables and all of it as JSON; return the names of the files."""
    texts = {
        "dives.csv": tables.dives_csv(results.outcomes),
        "summary.csv": tables.summary_csv(results.summary),
        "summary.md": tables.markdown(tables.summary_table(results.summary)),
    }
    if results.differences:
        texts |= {
            "differences.csv": tables.differences_csv(results.differences),
            "differences.md": tables.markdown(tables.differences_table(results.differences)),
        }
    if results.effects:
        texts |= {"effects.csv": effects_csv(results.effects), "levels.csv": levels_csv(results.effects)}
    texts["ensemble.json"] = json_text(results.as_dict())
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_text(folder / name, text)
    return list(texts)
