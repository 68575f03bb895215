"""Verdicts on whole flights with the present code, and what they would gain if photographs had a say.

    python benchmarks/verdicts_photographs.py RUN TRUTH [RUN TRUTH ...] [--gain 2.365 --weight 1.27 --from 0.75]

TRUTH is what `cityflow synth` made. The models of finished runs are made and judged again in memory, from the surfaces and outlines that the runs have;
nothing is written to them. True shares are those of `verdicts_run.py`. Photographs have two numbers: how much the logit gains, and how much what they do not
confirm (`roof_photographs.py`) takes off it. Both are fitted to the rows, too, cross-validated over the runs.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from scipy.optimize import minimize
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.figures import Figures
from cityflow.reconstruction.verdicts.fitted_weights import MATCHED
from cityflow.reconstruction.verdicts.judge import judged_model
from cityflow.reconstruction.verdicts.verdict import probability_of
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from roof_photographs import CONFIRMED, WRONG_BEFORE, Told, told_by
from texture_world import images_of
from verdict_cases import GOOD_SHARE, height_of
from verdict_flights import tasks_of
from verdicts_run import AROUND_M, share_of, units_of

SCALE, SHRINKAGE = 0.01, 0.02
"""Scale of what is unconfirmed; weight of the squares of the two numbers, so that a fit to few units has an end."""
SURE = 1e-6


class Row(NamedTuple):
    """A unit: its run and name, true share, figures, whether the survey ends at it, what photographs say, and (P,) how far the roof is off there, metres."""

    run: str
    unit: str
    true: float
    figures: Figures
    end: bool
    told: Told
    off: FloatArray

    @property
    def unconfirmed(self) -> float:
        """Share of the roof."""
        return 1.0 - float(self.told.confirmed.mean()) if len(self.told.wrong) else 1.0


class Count(NamedTuple):
    """What photographs count: the logit gains `gain` and loses `weight` · ln(1 + unconfirmed / `SCALE`)."""

    gain: float
    weight: float


class Case(NamedTuple):
    """A unit as it was made and judged."""

    unit: str
    outline: Polygon
    solid: Polyhedron
    figures: Figures
    end: bool
    told: Told


def cases_of(run: str, truth: Path) -> Iterator[Case]:
    store, tasks = tasks_of(run)
    images = images_of(truth / "catalog", Path(run))
    for task in tasks:
        given, parameters = task.arguments_as(UnitInputs), task.parameters_as(ModelParameters)
        outline = given.outline.read(store)
        evidence = read_evidence(store, given.evidence, outline, given.roofs.roof_type_of(outline.polygon))
        judged = judged_model(evidence, parameters.model_copy(update={"with_overhangs": False}))
        solid = judged.choice.candidate.solid
        if solid is None or judged.figures is None:
            continue
        told = told_by(solid, evidence, images)
        yield Case(task.unit, outline.polygon, solid, judged.figures, bool(judged.survey_end), told)


def rows_of(run: str, truth: Path) -> Iterator[Row]:
    began = time.process_time()
    cases = list(cases_of(run, truth))
    print(f"{run}: {len(cases)} units, {time.process_time() - began:.1f} s of processor time", flush=True)
    units = units_of(truth)
    tree = shapely.STRtree([u.wall_outline for u in units])
    for case in cases:
        others = shapely.union_all([c.outline for c in cases if c is not case])
        true = share_of(case.outline, case.solid, others, units, tree)
        near = [units[k] for k in tree.query(case.outline, predicate="dwithin", distance=AROUND_M)]
        x, y, z = case.told.places.T
        off = np.abs(np.fmax.reduce([np.full(len(x), np.nan), *(height_of(u, x, y) for u in near)]) - z)
        yield Row(run, case.unit, true, case.figures, case.end, case.told, off)


def of_points(rows: Sequence[Row]) -> FloatArray:
    """Probabilities by points and outlines, as verdicts have them."""
    return np.array([probability_of(r.figures, MATCHED.good) for r in rows])


def with_photographs(rows: Sequence[Row], count: Count) -> FloatArray:
    roofs = np.array([probability_of(r.figures, MATCHED.good._replace(faults=())) for r in rows]).clip(SURE, 1 - SURE)
    doubt = np.log1p(np.array([r.unconfirmed for r in rows]) / SCALE)
    logit = np.log(roofs / (1 - roofs)) + count.gain - count.weight * doubt
    return np.asarray(np.array([1.0 - r.figures.astray for r in rows]) / (1 + np.exp(-logit)))


def log_likelihood(rows: Sequence[Row], probability: FloatArray) -> float:
    p, good = probability.clip(SURE, 1 - SURE), _good(rows)
    return float(np.log(np.where(good, p, 1 - p)).sum())


def fitted(rows: Sequence[Row]) -> Count:
    def cost(numbers: FloatArray) -> float:
        return SHRINKAGE * float((numbers**2).sum()) - log_likelihood(rows, with_photographs(rows, Count(*numbers)))

    return Count(*np.round(minimize(cost, [1.0, 1.0], method="Nelder-Mead").x, 3).tolist())


def cross_validated(rows: Sequence[Row]) -> FloatArray:
    """Each run by a fit to the others."""
    found = np.zeros(len(rows))
    for run in {r.run for r in rows}:
        mine = np.array([r.run == run for r in rows])
        count = fitted([r for r in rows if r.run != run])
        found[mine] = with_photographs([r for r in rows if r.run == run], count)
    return found


def _good(rows: Sequence[Row]) -> BoolArray:
    return np.array([r.true >= GOOD_SHARE for r in rows])


def shares(rows: Sequence[Row], called: BoolArray) -> str:
    """What is called good, units at the edge of the survey left out."""
    good = _good(rows)
    return (
        f"of {called.sum()} called good {100 * good[called].mean():.1f} % are; of {(~good).sum()} others {100 * called[~good].mean():.1f} % are called good; "
        f"of {good.sum()} good ones {100 * called[good].mean():.1f} %"
    )


def print_places(rows: Sequence[Row]) -> None:
    """What is said of places that are right, and of others; those that no two photographs show are counted apart."""
    wrong, off = (np.concatenate(arrays) for arrays in ([r.told.wrong for r in rows], [r.off for r in rows]))
    shown = np.isfinite(wrong)
    for name, those in (
        ("up to 15 cm off", off < 0.15),
        ("more than 25 cm off", off > 0.25),
        ("more than 50 cm off", off > 0.5),
    ):
        w = wrong[those & shown]
        print(
            f"{name}: {len(w)} places, {100 * np.mean(w < CONFIRMED * WRONG_BEFORE):.1f} % confirmed, {100 * np.mean(w > 0.5):.1f} % contradicted; "
            f"{(those & ~shown).sum()} not shown"
        )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folders", nargs="+", help="RUN TRUTH [RUN TRUTH ...]")
    options.add_argument("--gain", type=float, default=2.365)
    options.add_argument("--weight", type=float, default=1.27)
    options.add_argument("--from", dest="good_from", type=float, default=0.75)
    asked = options.parse_args()
    pairs = zip(asked.folders[::2], asked.folders[1::2], strict=True)
    rows = [row for run, truth in pairs for row in rows_of(run, Path(truth))]
    points, both = of_points(rows), with_photographs(rows, Count(asked.gain, asked.weight))
    for row, p, q in zip(rows, points, both, strict=True):
        print(
            f"{row.unit:30} {'edge' if row.end else ''} true {100 * row.true:5.1f} % points {p:.3f}, with photographs {q:.3f}; "
            f"unconfirmed {100 * row.unconfirmed:.1f} %"
        )
    inner = np.array([not r.end for r in rows])
    within = [r for r in rows if not r.end]
    print("points:", shares(within, points[inner] >= MATCHED.good_from))
    print("with photographs:", shares(within, both[inner] >= asked.good_from))
    print_places(within)
    if len(asked.folders) > 2:
        held = cross_validated(within)
        print(f"fitted to these: {fitted(within)}")
        for least in (0.7, 0.75, 0.8, 0.85, 0.9):
            print(
                f"cross-validated, from {least}: {shares(within, held >= least)}; points: {shares(within, points[inner] >= least)}"
            )
        print(
            f"log-likelihood: points {log_likelihood(within, points[inner]):.1f}, with photographs {log_likelihood(within, held):.1f}"
        )


if __name__ == "__main__":
    main()
