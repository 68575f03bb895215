"""What the monolithic method adds to the best set of methods: units of finished runs over synthetic towns, made again from the run's own points.

    cp -r RUN COPY; python benchmarks/monolithic_share.py COPY SURVEY [COPY SURVEY …]

Three choices, all by the same score: the default set, the same with `monolithic`, and the order of the paper (`workflows/frommholz_2017.yaml`). Judged by the
true share of a unit's roof within 20 cm (``verdicts_run.py``). Outlines and surfaces are those of the run; nothing of it is changed.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.building import Polyhedron
from cityflow.errors import RefusedUnit
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from verdict_flights import tasks_of
from verdicts_run import share_of, units_of

BEST = ("orientation_histogram", "volumetric", "extruded")
SETS = {
    "default": BEST,
    "with monolithic": (*BEST[:2], "monolithic", BEST[2]),
    "order of the paper": ("monolithic",),
    "volumetric alone": ("volumetric", "extruded"),
    "orientation histogram alone": ("orientation_histogram", "extruded"),
}
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
    tree = shapely.STRtree([u.wall_outline for u in units])
    for number, evidence in enumerate(evidences):
        others = shapely.union_all([e.outline for k, e in enumerate(evidences) if k != number])
        if (
            evidence.outline.difference(others)
            .intersection(shapely.union_all([u.wall_outline for u in units]))
            .is_empty
        ):
            continue
        for name, methods in SETS.items():
            start = time.process_time()
            found = choose(evidence, ReconstructParameters(methods=methods)).candidate
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
    tallies = {name: Tally() for name in SETS}
    for run, truth in zip(given[::2], given[1::2], strict=True):
        judge(run, Path(truth), tallies)
    first = np.array(tallies["default"].shares)
    for name, t in tallies.items():
        s = np.array(t.shares)
        print(
            f"{name}: {len(s)} units, {t.invalid} invalid; share within 20 cm {s.mean():.3f} in the mean, {np.median(s):.3f} in the median,"
            f" {100 * np.mean(s >= ENOUGH):.1f} % with {ENOUGH} of it; better by 1 % than the default {int((s > first + 0.01).sum())}, worse"
            f" {int((s < first - 0.01).sum())}; faces {np.mean(t.faces):.1f}; kept {dict(t.kept)}; {t.seconds / max(len(s), 1):.2f} s a unit"
        )


if __name__ == "__main__":
    main()
