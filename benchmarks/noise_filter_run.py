"""Outlines and models of a run over a synthetic town whose façade points are found again without and with the noise filter.

    cp -r RUN COPY; python benchmarks/noise_filter_run.py COPY SURVEY

Only what depends on façade points is made again, in this process, as far as models; tasks write into the RUN, so give it a copy. Outlines are judged against
the true walls of all units under them: intersection over union, and the distance of found walls to true ones every 0.25 m. Models: the true share of a
roof within 20 cm (``verdicts_run.py``).
"""

from __future__ import annotations

import argparse
import contextlib
import json
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.building import Status
from cityflow.core.reconstruction import Evidence
from cityflow.errors import RefusedUnit
from cityflow.flow.task import Outcome, Task
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.runs.prepare import prepared
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from in_process import run_all
from stages_again import records_of
from verdicts_run import share_of, units_of

MADE = ("walls", "frame", "outline", "split", "units")
STEP_M, NEAR_M, UNITS_NEAR_M = 0.25, 0.2, 6.0


def evidences(workflow: Path, run: Path, settings: list[str]) -> list[tuple[Evidence, ModelParameters]]:
    """Of all units of the run with these settings."""
    description = json.loads((run / "run.json").read_text())
    x_0, y_0, x_1, y_1 = shapely.from_wkt(description["area"]).bounds
    wanted = prepared(workflow, description["catalog"], str(run), settings, f"{x_0:.0f},{y_0:.0f},{x_1:.0f},{y_1:.0f}")
    found: list[tuple[Evidence, ModelParameters]] = []

    def fate(task: Task) -> Outcome | None:
        if task.stage == "reconstruct" and task.function.endswith(":run"):
            given, parameters = task.arguments_as(UnitInputs), task.parameters_as(ModelParameters)
            outline = given.outline.read(wanted.store)
            with contextlib.suppress(RefusedUnit):
                found.append((read_evidence(wanted.store, given.evidence, outline), parameters))
        elif task.stage in MADE:
            return None
        return Outcome(Status.REFUSED, "not asked for")

    known = {key: record for key, record in records_of(run).items() if key[0] not in ("reconstruct", "export")}
    run_all(wanted.source(), wanted.store, known=known, fate=fate)
    return sorted(found, key=lambda pair: pair[0].id)


def judge(name: str, found: list[tuple[Evidence, ModelParameters]], survey: Path) -> None:
    units = units_of(survey)
    tree = shapely.STRtree([u.wall_outline for u in units])
    outlines = [e.outline for e, _ in found]
    mine = shapely.union_all(outlines)
    true = shapely.union_all([u.wall_outline for u in units if u.wall_outline.intersects(mine)])
    edges = shapely.get_coordinates(shapely.segmentize(mine.boundary, STEP_M))
    off = shapely.distance(shapely.points(edges), true.boundary)
    shares, walls = [], 0
    for number, (evidence, parameters) in enumerate(found):
        walls += len(evidence.walls)
        others = shapely.union_all([o for k, o in enumerate(outlines) if k != number])
        solid = model(evidence, parameters.model_copy(update={"with_overhangs": False})).candidate.solid
        shares.append(0.0 if solid is None else share_of(evidence.outline, solid, others, units, tree))
    shown = np.array(shares)
    print(
        f"{name}: {len(found)} units, {walls} façade points; IoU {mine.intersection(true).area / mine.union(true).area:.4f}; walls"
        f" {100 * np.median(off):.1f} cm off in the median, {100 * np.mean(off <= NEAR_M):.1f} % within 20 cm, mean {100 * off.mean():.1f} cm;"
        f" corners {len(shapely.get_coordinates(mine))}; roofs within 20 cm {shown.mean():.3f}, {100 * np.mean(shown >= 0.95):.0f} % of units with 0.95 of it",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("survey", type=Path)
    parser.add_argument("--workflow", type=Path, default=Path(__file__).parents[1] / "workflows" / "demo_flight.yaml")
    o = parser.parse_args()
    for name, settings in (("off", ["walls.noise.remove=false"]), ("on", ["walls.noise.remove=true"])):
        judge(name, evidences(o.workflow, o.run, settings), o.survey)


if __name__ == "__main__":
    main()
