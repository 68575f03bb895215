"""Parts of the reconstruction off or swapped: units of finished runs over synthetic towns, made again from the run's own points.

    cp -r RUN COPY; python benchmarks/ablations.py COPY SURVEY [COPY SURVEY …]

Judged by the true share of a unit's roof within 20 cm (``verdicts_run.py``). Outlines and surfaces are those of the run; nothing of it is changed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from cityflow.core.building import Polyhedron
from cityflow.errors import RefusedUnit
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from verdict_flights import tasks_of
from verdicts_run import share_of, units_of

BEST = ("orientation_histogram", "volumetric", "extruded")
PARTS: dict[str, dict[str, Any]] = {
    "default": {"methods": BEST},
    "with monolithic": {"methods": (*BEST[:2], "monolithic", BEST[2])},
    "order of the paper": {"methods": ("monolithic",)},
    "volumetric alone": {"methods": ("volumetric", "extruded")},
    "orientation histogram alone": {"methods": ("orientation_histogram", "extruded")},
    "blocks": {"methods": ("extruded",)},
}
"""What is measured → parameters that differ from those of the stage."""
ENOUGH = 0.95
"""Share of a good model."""


class Tally:
    def __init__(self) -> None:
        self.shares: list[float] = []
        self.faces: list[int] = []
        self.kept: Counter[str] = Counter()
        self.invalid, self.seconds = 0, 0.0


def judge(run: str, truth: Path, tallies: dict[str, Tally]) -> None:
    store, tasks = tasks_of(run)
    evidences = []
    for task in tasks:
        given = task.arguments_as(UnitInputs)
        outline = given.outline.read(store)
        try:
            evidences.append(read_evidence(store, given.evidence, outline, given.roofs.roof_type_of(outline.polygon)))
        except RefusedUnit:
            continue
    units = units_of(truth)
    made = {name: ModelParameters.model_validate(changed) for name, changed in PARTS.items()}
    tree = shapely.STRtree([u.wall_outline for u in units])
    for number, evidence in enumerate(evidences):
        others = shapely.union_all([e.outline for k, e in enumerate(evidences) if k != number])
        if (
            evidence.outline.difference(others)
            .intersection(shapely.union_all([u.wall_outline for u in units]))
            .is_empty
        ):
            continue
        for name, parameters in made.items():
            start = time.process_time()
            found = model(evidence, parameters).candidate
            solid, tally = found.solid, tallies[name]
            tally.seconds += time.process_time() - start
            tally.kept[found.method] += 1
            tally.shares.append(_share(solid, evidence.outline, others, units, tree))
            tally.faces.append(0 if solid is None else len(solid.faces))
            tally.invalid += solid is None or bool(check_polyhedron(solid))
        print(evidence.id, *(f"{t.shares[-1]:.3f}" for t in tallies.values()), flush=True)


def _share(solid: Polyhedron | None, outline: shapely.Polygon, others: shapely.Geometry, units, tree) -> float:  # type: ignore[no-untyped-def]
    return 0.0 if solid is None else share_of(outline, solid, others, units, tree)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", metavar="RUN SURVEY")
    given = parser.parse_args().runs
    tallies = {name: Tally() for name in PARTS}
    for run, truth in zip(given[::2], given[1::2], strict=True):
        judge(run, Path(truth), tallies)
    first = np.array(tallies["default"].shares)
    heads = (
        "what is changed",
        "units",
        "share within 20 cm, mean",
        "right over 95 %",
        "better, worse by 1 %",
        "faces",
        "invalid",
        "s a unit",
    )
    print(f"\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for name, t in tallies.items():
        s = np.array(t.shares)
        better, worse = int((s > first + 0.01).sum()), int((s < first - 0.01).sum())
        right, seconds = int((s >= ENOUGH).sum()), t.seconds / max(len(s), 1)
        print(
            f"| {name} | {len(s)} | {s.mean():.3f} | {right} | {better}, {worse} | {np.mean(t.faces):.1f} | {t.invalid} | {seconds:.2f} |"
        )
        print(f"{name}: kept {dict(t.kept)}", file=sys.stderr)


if __name__ == "__main__":
    main()
