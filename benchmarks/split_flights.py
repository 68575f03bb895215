"""Outlines of runs over synthetic flights, split again by the present code, against the truth.

    python benchmarks/split_flights.py RUN SURVEY [RUN SURVEY ...]      # each SURVEY is what `cityflow synth` wrote, each RUN one over it

Nothing is written into the RUN. Counted are lines against true borders in one outline, as `split_town.py` does.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from cityflow.core.splitting import SplitEvidence
from cityflow.evaluation.unit_accuracy import FoundUnits, UnitsAccuracy, compare_units
from cityflow.evaluation.unit_borders import Border
from cityflow.flow.shared import SharedTexts
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.io.tables.vector import Layer, read_layer
from cityflow.runs.prepare import prepared
from cityflow.splitting.split import SplitParameters, split
from cityflow.stages.split import SplitInputs, read_evidence
from drawn_town import table, true_borders
from stages_again import records_of, tasks_of

WORKFLOW = Path(__file__).resolve().parents[1] / "workflows" / "demo_flight.yaml"


class Unwritten(SharedTexts):
    """Leaves the texts of tasks with them: the RUN stays as it is."""

    def stored(self, task: Task) -> Task:
        return task


def evidences_of(run: Path, survey: Path) -> Iterator[SplitEvidence]:
    """What every outline of a run shows to splitting, in the order of their names."""
    area = shapely.from_wkt(json.loads((run / "run.json").read_text())["area"]).bounds
    wanted = prepared(WORKFLOW, str(survey / "catalog"), str(run), [], ",".join(f"{v:g}" for v in area))
    store = Store.open(str(run))
    for task in tasks_of(wanted, records_of(run), Unwritten(store)):
        if task.stage == "split":
            given = task.arguments_as(SplitInputs)
            found = read_evidence(store, given, given.outline.read(store))
            if found is not None:
                yield found


def truth_of(survey: Path) -> tuple[list[shapely.Polygon], list[Border]]:
    """All true units of the town, and the borders between them."""
    town = survey / "truth" / "town.gpkg"
    return true_borders({name: _rows(read_layer(town, name)) for name in ("units", "cut_lines")})


def _rows(layer: Layer) -> list[tuple[Any, dict[str, Any]]]:
    return [(g, {name: values[k] for name, values in layer.columns.items()}) for k, g in enumerate(layer.geometry)]


def judged(evidences: Sequence[SplitEvidence], survey: Path) -> UnitsAccuracy:
    results = [split(e, SplitParameters()) for e in evidences]
    found = FoundUnits(
        [e.outline for e in evidences],
        [u for r in results for u in r.units],
        [c.line for r in results for c in r.cut_lines],
    )
    return compare_units(found, *truth_of(survey))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="RUN and SURVEY of each flight")
    asked = parser.parse_args()
    rows, total = [], np.zeros(4, int)
    for run, survey in zip(asked.folders[::2], asked.folders[1::2], strict=True):
        a = judged(list(evidences_of(run, survey)), survey)
        counts = np.array([a.all_borders.borders, a.traced.borders, len(a.hits), len(a.false_alarms)])
        total += counts
        rows.append([str(run), *map(str, counts), f"{a.position_m:.2f}"])
    rows.append(["all", *map(str, total), ""])
    table("Outlines split again", ["run", "true borders", "with a trace", "found", "false lines", "position, m"], rows)


if __name__ == "__main__":
    main()
