"""Outlines of runs over synthetic flights, split again by the present code, against the truth.

    python benchmarks/split_flights.py RUN SURVEY [RUN SURVEY ...]      # each SURVEY is what `cityflow synth` wrote, each RUN one over it

Nothing is written into the RUN. Counted are lines against true borders in one outline, as `split_town.py` does: all, those with a trace in the town, and
those whose trace the survey shows: a surface known on both sides where heights or roofs differ, a façade seen on both sides where only façades do.
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
from cityflow.splitting.strips.strip_rasters import Cells, facade_cells
from cityflow.stages.split import SplitInputs, read_evidence
from drawn_town import table, true_borders
from stages_again import records_of, tasks_of

BESIDE_M, NEAR_FACADE_M, LEAST_M2, KNOWN = (0.3, 3.0), 1.2, 1.0, 0.5
"""Beside a border so far along the row; near its ends; a façade is seen where so much of it is, a roof known where this share is."""
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


def shows(evidence: SplitEvidence, cells: Sequence[Cells], border: Border) -> bool:
    """Whether the survey shows a trace of a border."""
    if border.traces is None or border.traces & {"height", "roof", "gap"}:
        nadir, ends = evidence.frames[0], shapely.get_coordinates(border.line)[[0, -1]]
        along = (ends[1] - ends[0]) / max(float(np.hypot(*(ends[1] - ends[0]))), 1e-9)
        places = [
            ends.mean(axis=0) + side * d * np.array([-along[1], along[0]])
            for side in (-1, 1)
            for d in (0.5, 1.0, 1.5, 2.0)
        ]
        row, col = nadir.grid.indices(*np.array(places).T)
        inside = (row >= 0) & (row < nadir.grid.rows) & (col >= 0) & (col < nadir.grid.cols)
        known = np.zeros(8, bool)
        known[inside] = np.isfinite(nadir.dsm[row[inside], col[inside]])
        if known.reshape(2, 4).mean(axis=1).min() >= KNOWN:
            return True
    return "facade" in (border.traces or ()) and _seen_facade(evidence, cells, border)


def _seen_facade(evidence: SplitEvidence, cells: Sequence[Cells], border: Border) -> bool:
    ends = shapely.get_coordinates(border.line)[[0, -1]]
    for frame, seen in zip([f for f in evidence.frames[1:] if f.ortho is not None], cells, strict=True):
        for end, other in (ends, ends[::-1]):
            along = (other - end) / max(float(np.hypot(*(other - end))), 1e-9)
            v, u = (seen.xyz[:, :2] - end) @ along, (seen.xyz[:, :2] - end) @ np.array([-along[1], along[0]])
            near = (np.abs(v) < NEAR_FACADE_M) & (np.abs(u) > BESIDE_M[0]) & (np.abs(u) < BESIDE_M[1])
            if min((near & (u < 0)).sum(), (near & (u > 0)).sum()) * frame.grid.cell**2 >= LEAST_M2:
                return True
    return False


def shown_borders(
    evidences: Sequence[SplitEvidence], borders: Sequence[Border], accuracy: UnitsAccuracy
) -> tuple[int, int]:
    """Of the counted borders, those whose trace the survey shows: found, and all."""
    found = {h.border for h in accuracy.hits}
    cells = [facade_cells(e.frames[1:]) for e in evidences]
    count = [0, 0]
    for k in sorted(found | set(accuracy.missed)):
        home = max(
            range(len(evidences)), key=lambda i: evidences[i].outline.intersection(borders[k].line.buffer(0.3)).area
        )
        if shows(evidences[home], cells[home], borders[k]):
            count = [count[0] + (k in found), count[1] + 1]
    return count[0], count[1]


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
    rows, total = [], np.zeros(8, int)
    for run, survey in zip(asked.folders[::2], asked.folders[1::2], strict=True):
        evidences = list(evidences_of(run, survey))
        a = judged(evidences, survey)
        shown = shown_borders(evidences, truth_of(survey)[1], a)
        every = [
            *(n for s in (a.all_borders, a.traced) for n in (s.hits, s.borders)),
            *shown,
            len(a.false_alarms),
            a.lines,
        ]
        total += every
        rows.append([str(run), *_shares(every), f"{a.position_m:.2f}"])
    rows.append(["all", *_shares(total.tolist()), ""])
    names = ["run", "borders found", "with a trace", "with a trace that is shown", "false lines", "position, m"]
    table("Outlines split again", names, rows)


def _shares(counts: Sequence[int]) -> list[str]:
    return [f"{part} of {whole}" for part, whole in zip(counts[::2], counts[1::2], strict=True)]


if __name__ == "__main__":
    main()
