"""Borders between houses in runs over synthetic towns: how far from the true ones do they stand, before and after photographs have moved them?

    python benchmarks/seen_borders.py RUN SURVEY [RUN SURVEY ...]          # SURVEY: what `cityflow synth` made

The lines are those that each run has split by (made before borders moved: its `split` has version 9 or less). A true border is where one true house ends and
the next one begins, at most 2 m from the line, at about the same place at three places along it. Seconds: processor time of a line, images read.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import CUT
from cityflow.handover.split_lines import decode_splitting
from cityflow.io.rasters.surface_dataset import grids_of, read_layers
from cityflow.splitting.cuts.seen_borders import border_shifts
from cityflow.synthetic.town_units import Unit
from drawn_town import table
from texture_world import images_of
from verdicts_run import units_of

REACH_M, STEP_M, ALONG, SPREAD_M, AROUND_M = 2.0, 0.02, (0.3, 0.5, 0.7), 0.5, 3.0
HEAD = ("run", "lines", "with a true border", "moved", "m off, median", "≤ 0.1 m %", "≤ 0.2 m %", "area off, m²", "s")


def true_border(line: shapely.LineString, near: list[Unit]) -> float:
    """Metres to the right of a line; NaN where there is none."""
    start, end = shapely.get_coordinates(line)[[0, -1]]
    along = (end - start) / np.hypot(*(end - start))
    off, found = np.arange(-REACH_M, REACH_M, STEP_M), []
    for share in ALONG:
        x, y = (start + share * (end - start) + off[:, None] * np.array([along[1], -along[0]])).T
        house = np.full(len(off), -1)
        for k, u in enumerate(near):
            house[shapely.contains_xy(u.wall_outline, x, y)] = k
        changes = np.flatnonzero((house[1:] != house[:-1]) & (house[1:] >= 0) & (house[:-1] >= 0))
        if len(changes):
            found.append(float(off[changes[np.abs(off[changes]).argmin()]] + STEP_M / 2))
    return float(np.median(found)) if len(found) == len(ALONG) and np.ptp(found) < SPREAD_M else float("nan")


def lines_of(run: Path, survey: Path) -> FloatArray:
    """(L, 4) of each line: metres to the right to its true border, by how much it moves, its length, seconds."""
    units, images = units_of(survey), images_of(survey / "catalog", run)
    tree = shapely.STRtree([u.wall_outline for u in units])
    group = str(run / "surface.zarr")
    whole, rows = grids_of(group)[0], []
    newest = {
        f.parents[1].name: f for f in sorted(run.glob("work/split/*/*/split.json"), key=lambda f: f.stat().st_mtime)
    }
    for _, file in sorted(newest.items()):
        found = decode_splitting(file.read_bytes())
        lines = [c.line for c in found.cut_lines if c.kind == CUT]
        if not lines:
            continue
        hull = shapely.union_all(list(found.units))
        near = [units[k] for k in np.sort(tree.query(hull, predicate="dwithin", distance=AROUND_M))]
        grid, layers = read_layers(group, whole, shapely.buffer(hull, AROUND_M).bounds)
        begun = time.process_time()
        shifts = border_shifts(lines, grid, layers["dsm"], images)
        took = (time.process_time() - begun) / len(lines)
        rows += [(true_border(n, near), by, n.length, took) for n, by in zip(lines, shifts, strict=True)]
    return np.array(rows, np.float64).reshape(-1, 4)


def told(name: str, rows: FloatArray) -> list[list[str]]:
    true = rows[np.isfinite(rows[:, 0])]
    counts = [f"{len(rows)}", f"{len(true)}"]
    result = []
    for when, by in ((", before", np.zeros(len(true))), (", after", true[:, 1])):
        off = np.abs(true[:, 0] - by)
        result.append([
            name + when, *counts, f"{int(np.count_nonzero(by))}", f"{np.median(off):.3f}",
            *(f"{100 * np.mean(off <= m):.0f}" for m in (0.1, 0.2)), f"{(off * true[:, 2]).sum():.1f}", f"{rows[:, 3].mean():.3f}",
        ])  # fmt: skip
    return result


def main() -> None:
    runs = [Path(a) for a in sys.argv[1:]]
    if not runs or len(runs) % 2:
        raise SystemExit(__doc__)
    every = [(str(run), lines_of(run, survey)) for run, survey in zip(runs[::2], runs[1::2], strict=True)]
    every.append(("all", np.concatenate([rows for _, rows in every])))
    table(
        "Borders between houses and true borders",
        HEAD,
        [row for name, rows in every if len(rows) for row in told(name, rows)],
    )


if __name__ == "__main__":
    main()
