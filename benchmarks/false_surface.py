"""Towers, pits and holes of a run over a synthetic town, in its DSM and in its raw points, against truth.

    python benchmarks/false_surface.py --survey RUNS/flight_survey --run RUNS/flight

Judged are cells of ground and roof more than two cells from a height step. Holes count as misses. Points are held against the truth at their own
place: a point on a façade or in a crown is right wherever it lies between the ground and what stands within a metre of it.
All that is delivered, trees and the rim of the survey with it, is judged in the same way: cells and points above all that is true within a metre, in the
core and `AROUND_M` around it, once without the points that are classified as noise.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Bounds, grown
from cityflow.stages.synth.synthetic_survey import town_of
from cityflow.synthetic.town_truth import TruthRasters, judged_cells
from town_figures import GROUND, Judge, read_points, read_surface
from town_images import parameters_cell, parameters_of

HIGH_M, TOWER_M, PIT_M = 1.0, 10.0, 3.0
BESIDE_M = 1.0
AROUND_M = 60.0
ASKED = {"ground_high": "≤ 0.0005", "complete": "≥ 0.999", "points_high": "≤ 0.0005"}


@dataclass(frozen=True, slots=True)
class PointShares:
    """Shares of points above or below everything true within `BESIDE_M` of their place."""

    high: float
    tower: float
    pit: float
    points: int


def surface_shares(dsm: Float32Array | FloatArray, truth: TruthRasters) -> dict[str, float]:
    """Shares of judged cells: too high, too low, right; of ground alone, too."""
    judged = judged_cells(truth).open_cells
    off = np.asarray(dsm, np.float64) - truth.dsm
    ground = off[judged & np.isin(truth.part, GROUND)]
    inner, cell = off[judged], truth.grid.cell
    known = inner[np.isfinite(inner)]
    return {
        "ground_high": float((ground > HIGH_M).mean()), "ground_tower": float((ground > TOWER_M).mean()),
        "high": float((inner > HIGH_M).mean()), "tower": float((inner > TOWER_M).mean()), "pit": float((inner < -PIT_M).mean()),
        "low": float((inner < -HIGH_M).mean()),
        "within_3": float((np.abs(inner) <= 3 * cell).mean()), "complete": float(np.isfinite(inner).mean()),
        "nmad_gsd": 1.4826 * float(np.median(np.abs(known - np.median(known)))) / cell, "cells": float(inner.size),
    }  # fmt: skip


def point_shares(xyz: FloatArray, truth: TruthRasters) -> PointShares:
    """Points outside the grid are not judged."""
    grid, edge = truth.grid, 2 * round(BESIDE_M / truth.grid.cell) + 1
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    row, col, z = row[inside], col[inside], xyz[inside, 2]
    above = z - maximum_filter(truth.dsm, edge)[row, col]
    below = z - minimum_filter(np.fmin(truth.dtm, truth.dsm), edge)[row, col]
    return PointShares(
        float((above > HIGH_M).mean()), float((above > TOWER_M).mean()), float((below < -PIT_M).mean()), len(z)
    )


def judge_of(survey: Path, cell_m: float, bounds: Bounds | None = None) -> Judge:
    """Truth over the surveyed core; poses are not needed."""
    p = parameters_of(survey)
    return Judge(town_of(p.seed, p.whole_town), bounds or p.area, cell_m, ())


def delivered_shares(survey: Path, run: Path) -> dict[str, float]:
    """Shares of all cells and points of the run, far beyond the core, that stand above everything true within `BESIDE_M`."""
    cell = parameters_cell(run)
    judge = judge_of(survey, cell, grown(parameters_of(survey).area, AROUND_M))
    edge = 2 * round(BESIDE_M / cell) + 1
    found = np.asarray(read_surface(run, judge.bounds).dsm, np.float64)
    above = (found - maximum_filter(judge.truth.dsm, edge))[np.isfinite(found)]
    every = point_shares(read_points(run, judge.bounds), judge.truth)
    kept = point_shares(read_points(run, judge.bounds, with_noise=False), judge.truth)
    return {
        "all_high": float((above > HIGH_M).mean()), "all_tower": float((above > TOWER_M).mean()),
        "all_points_high": every.high, "all_points_tower": every.tower,
        "no_noise_high": kept.high, "no_noise_tower": kept.tower, "noise": 1 - kept.points / every.points,
    }  # fmt: skip


def figures_of(survey: Path, run: Path) -> dict[str, float]:
    judge = judge_of(survey, parameters_cell(run))
    shares = surface_shares(read_surface(run, judge.bounds).dsm, judge.truth)
    points = point_shares(read_points(run, judge.bounds), judge.truth)
    of_points = {f"points_{k}": float(getattr(points, k)) for k in ("high", "tower", "pit")}
    return shares | of_points | delivered_shares(survey, run)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--survey", type=Path, required=True)
    options.add_argument("--run", type=Path, required=True)
    options.add_argument("--json", type=Path, default=None, help="write the figures there")
    o = options.parse_args()
    figures = figures_of(o.survey, o.run)
    for name, value in figures.items():
        print(f"{name:<16} {value:>12.5f}   {ASKED.get(name, '')}")
    if o.json is not None:
        o.json.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
