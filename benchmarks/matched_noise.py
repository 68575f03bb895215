"""How noisy matched roofs are: of runs over synthetic towns that were matched from images, and of the cases that verdicts are fitted to.

    python benchmarks/matched_noise.py --run RUN TRUTH --run RUN TRUTH      # TRUTH: what `cityflow synth` made
    python benchmarks/matched_noise.py --drawn 201 202 203                  # towns of `verdict_cases_images.py`, sound units

Errors of heights against the true roof: NMAD in the middle of faces and beside walls, how alike errors within a square metre are, and the shares
off by more than 20 cm in the middle of faces and at creases.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.io.rasters.surface_dataset import chunked_surface
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.roofs import CHIMNEY
from cityflow.synthetic.town_units import Unit
from verdict_cases import height_of
from verdict_cases_images import image_survey
from verdicts_run import units_of

MIDDLE_M, RIM_M, CREASE_M, SQUARE_M, OFF_M, CLIPPED_M = 0.4, 0.3, 0.2, 1.0, 0.2, 0.3
"""From edges: the middle of faces, what is beside walls, what is at creases; squares whose errors are held together; what counts as off; outliers."""
LEAST_POINTS = 200
NAMES = ("NMAD, GSD", "mean of a square metre / NMAD", "off in the middle", "NMAD beside walls, GSD", "off at creases")


def nmad(errors: FloatArray) -> float:
    return 1.4826 * float(np.median(np.abs(errors - np.median(errors)))) if len(errors) else np.nan


def row_of(xyz: FloatArray, unit: Unit, gsd: float) -> tuple[float, ...] | None:
    """The figures of `NAMES`, by points within one unit; None where there are few."""
    faces = shapely.union_all([f.polygon.boundary for f in unit.prisms if f.kind != CHIMNEY])
    spots = shapely.points(xyz[:, :2])
    to_edge, to_wall = shapely.distance(spots, faces), shapely.distance(spots, unit.wall_outline.boundary)
    error = xyz[:, 2] - height_of(unit, xyz[:, 0], xyz[:, 1])
    known = shapely.contains_xy(unit.wall_outline, *xyz[:, :2].T) & np.isfinite(error)
    middle, rim = known & (to_edge > MIDDLE_M), known & (to_wall < RIM_M)
    crease = known & (to_edge < CREASE_M) & (to_wall > MIDDLE_M)
    if middle.sum() < LEAST_POINTS:
        return None
    off = np.abs(error) > OFF_M
    at_creases = float(off[crease].mean()) if crease.any() else np.nan
    noise = nmad(error[middle])
    return (
        noise / gsd,
        _alike(xyz[middle], error[middle]) / noise,
        float(off[middle].mean()),
        nmad(error[rim]) / gsd,
        at_creases,
    )


def _alike(xyz: FloatArray, error: FloatArray) -> float:
    """Standard deviation of the means over squares, metres."""
    _, square = np.unique(np.floor(xyz[:, :2] / SQUARE_M).astype(np.int64), axis=0, return_inverse=True)
    count = np.bincount(square.ravel())
    mean = np.bincount(square.ravel(), np.clip(error, -CLIPPED_M, CLIPPED_M)) / count
    return float(np.sqrt(np.average((mean - np.median(mean)) ** 2, weights=count)))


def of_run(run: Path, truth: Path) -> Iterator[tuple[float, ...]]:
    p = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    if p.flight is None:
        raise SystemExit(f"{truth}: has no images")
    surface = chunked_surface(str(run / "surface.zarr"))
    dsm, x, y = (np.asarray(surface[name]) for name in ("dsm", "x", "y"))
    for unit in units_of(truth):
        x_0, y_0, x_1, y_1 = unit.wall_outline.bounds
        if x_0 < x.min() or x_1 > x.max() or y_0 < y.min() or y_1 > y.max():
            continue
        cols, rows = np.flatnonzero((x >= x_0) & (x <= x_1)), np.flatnonzero((y >= y_0) & (y <= y_1))
        east, north = np.meshgrid(x[cols], y[rows])
        xyz = np.column_stack([east.ravel(), north.ravel(), dsm[np.ix_(rows, cols)].astype(np.float64).ravel()])
        found = row_of(xyz[np.isfinite(xyz[:, 2])], unit, p.flight.gsd_m)
        if found:
            yield found


def of_drawn(seed: int) -> Iterator[tuple[float, ...]]:
    town, survey, gsd = image_survey(seed)
    xyz = survey.points.xyz
    for unit in town.units:
        x_0, y_0, x_1, y_1 = unit.wall_outline.bounds
        there = (xyz[:, 0] > x_0) & (xyz[:, 0] < x_1) & (xyz[:, 1] > y_0) & (xyz[:, 1] < y_1)
        found = row_of(xyz[there], unit, gsd)
        if found:
            yield found


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--run", nargs=2, type=Path, action="append", default=[], metavar=("RUN", "TRUTH"))
    options.add_argument("--drawn", nargs="+", type=int, default=[])
    asked = options.parse_args()
    tables = [("matched", [r for run, truth in asked.run for r in of_run(run, truth)])]
    tables += [("drawn", [r for seed in asked.drawn for r in of_drawn(seed)])]
    for name, rows in tables:
        for figure, values in zip(NAMES, np.array(rows).reshape(-1, len(NAMES)).T, strict=True) if rows else ():
            told = " ".join(f"{v:.2f}" for v in np.nanpercentile(values, [10, 25, 50, 75, 90]))
            print(f"{name}, {len(rows)} units, {figure} (10, 25, 50, 75, 90 %): {told}")


if __name__ == "__main__":
    main()
