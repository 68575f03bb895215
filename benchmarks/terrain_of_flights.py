"""Terrain of finished flights over synthetic towns against their truth, by the distance from houses.

    python benchmarks/terrain_of_flights.py RUN SURVEY [RUN SURVEY ...]        # SURVEY: what `cityflow synth` left

Median and 90th percentile of the absolute error, metres, of the cells of the terrain under true houses and beside them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt

from cityflow.core.arrays import FloatArray
from false_surface import judge_of
from town_figures import read_surface
from town_images import parameters_cell

BANDS = ((-99.0, -4.0), (-4.0, -1.0), (-1.0, 0.0), (0.0, 0.5), (0.5, 1.0), (1.0, 4.0), (4.0, 99.0))
"""Metres from the outline, negative inside."""


def errors_and_distances(run: Path, survey: Path) -> tuple[FloatArray, FloatArray]:
    """(rows, cols) metres, both; errors are NaN where either terrain is not known."""
    judge = judge_of(survey, parameters_cell(run))
    error = np.asarray(read_surface(run, judge.bounds).dtm, np.float64) - judge.truth.dtm
    house = judge.truth.unit >= 0
    away = np.where(house, -distance_transform_edt(house), distance_transform_edt(~house)) * judge.truth.grid.cell
    return error, away


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("pairs", nargs="+", type=Path, metavar="RUN SURVEY")
    pairs = options.parse_args().pairs
    if len(pairs) % 2:
        options.error("each RUN wants its SURVEY")
    print("|", " | ".join(["run", *(f"{low:g} to {high:g} m" for low, high in BANDS)]), "|")
    for run, survey in zip(pairs[::2], pairs[1::2], strict=True):
        error, away = errors_and_distances(run, survey)
        told = [np.abs(error[(away > low) & (away <= high) & np.isfinite(error)]) for low, high in BANDS]
        print("|", " | ".join([str(run), *(f"{np.median(e):.2f}, {np.percentile(e, 90):.2f}" if len(e) else "none" for e in told)]), "|")  # fmt: skip


if __name__ == "__main__":
    main()
