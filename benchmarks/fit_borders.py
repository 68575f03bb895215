"""The models of borders, from LiDAR alone and with pictures: fitted on rows of synthetic streets or flights, judged on others and on the footprints of Delft.

    python benchmarks/fit_borders.py --cache FOLDER            # judge the committed weights on streets that they were not fitted on, strip by strip
    python benchmarks/fit_borders.py --cache FOLDER --write    # fit them anew, and write them into `splitting/borders/border_weights.py`
    python benchmarks/fit_borders.py --cache FOLDER --folds    # Delft in two halves by blocks, each judged by a fit to streets and the other half
    python benchmarks/fit_borders.py --cache FOLDER --pictures [--write]   # all files that `picture_rows.py` has left there: judged by files, or fitted
    python benchmarks/fit_borders.py --cache FOLDER --pictures --folds     # in four parts by files, each judged by a fit to the other three

The likelihood is that of the true borders of a row among all sequences of borders (`row_choice.py`), so odds of features and values of
widths are fitted at once. No weight is negative, so a feature acts with its sign. Whole outlines are judged by `split_lidar.py` and `split_delft.py`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from border_rows import KnownRow, delft_rows, kept, street_rows
from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders import border_weights
from cityflow.splitting.borders.border_model import (
    MOST_ODDS,
    WIDTHS_M,
    ramps,
    station_odds,
    width_factors,
    width_parts,
)
from cityflow.splitting.borders.border_weights import LIDAR, PICTURES, Weights
from cityflow.splitting.borders.possible_borders import borders_of_row
from cityflow.splitting.borders.row_choice import ANY, Row, choose
from cityflow.splitting.borders.station_features import FEATURES

FITTED = ((151, 8), (152, 12), (153, 5), (154, 10), (155, 15), (156, 7))
PLAIN = ((104, 8), (106, 5))
JUDGED = ((161, 8), (162, 14))
"""Seeds and pulses per m² of the streets, and of the rows without annexes, that the weights are fitted to; and of streets that judge them."""
SMALL, EVEN, FEW = 0.3, 0.5, 0.02
"""What keeps weights of features small, values of widths even, and all of the latter finite where no unit is as wide."""
PICTURES_SMALL, NEAR_LIDAR = 0.3, 0.3
"""With pictures: what keeps weights small, and values of widths near those that were fitted to the many streets."""
PARTS = 4
ROUNDS = 60
HIT_M, NAMED = 0.75, 0.05
BINS = (0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.01)
WIDTHS = slice(-len(WIDTHS_M) - 3, -3)
OPEN, REGULAR, MODE = -3, -2, -1
ODDS = slice(1, WIDTHS.start)
"""What is fitted: the base, weights of features, values of widths, and three others."""


def weights_of(x: FloatArray) -> Weights:
    ends = np.cumsum([len(f.knots) for f in FEATURES])
    parts = np.split(x[ODDS], ends[ends < len(x[ODDS])])
    features = tuple(tuple(round(float(w), 3) for w in part) for part in parts)
    base, open_, regular, mode = (round(float(x[k]), 3) for k in (0, OPEN, REGULAR, MODE))
    return Weights(base, features, tuple(round(float(w), 3) for w in x[WIDTHS]), open_, regular, mode)


class Kept(NamedTuple):
    """What keeps weights small, values of widths even, and these near given ones."""

    small: float
    even: float
    near: float
    given: FloatArray


STREETS = Kept(SMALL, EVEN, FEW, np.zeros(len(WIDTHS_M) + 3))
FLIGHTS = Kept(PICTURES_SMALL, 0.0, NEAR_LIDAR, np.array([*LIDAR.widths, LIDAR.open, LIDAR.regular, LIDAR.mode]))


def unlikelihood(
    x: FloatArray, rows: Sequence[KnownRow], columns: Sequence[FloatArray], keep: Kept
) -> tuple[float, FloatArray]:
    """Minus the logarithm of the probability of all true borders, with what keeps weights small; and its gradient."""
    shares, regular = width_parts()
    exact = Weights(x[0], (), tuple(x[WIDTHS]), x[OPEN], x[REGULAR], x[MODE])
    factors, modes = width_factors(exact)
    total, slope = 0.0, np.zeros_like(x)
    for row, ramp in zip(rows, columns, strict=True):
        odds = x[0] + ramp @ x[ODDS]
        free = np.abs(odds) < MOST_ODDS
        odds = allowed(row, np.clip(odds, -MOST_ODDS, MOST_ODDS))
        true = choose(Row(odds, *row.ends, row.group, row.groups), factors, modes)
        if not np.isfinite(true.log_sum):  # units narrower than any that the model allows
            continue
        any_ = choose(Row(odds, *row.ends, np.full(len(odds), ANY), 0), factors, modes)
        total += row.weight * (any_.log_sum - true.log_sum)
        border, units = row.weight * (any_.border - true.border) * free, row.weight * (any_.units - true.units)
        slope[0] += border.sum()
        slope[ODDS] += ramp.T @ border
        of_width = units.sum(axis=0)
        slope[WIDTHS] += shares[1:].T @ of_width[1:]
        modes_off = row.weight * (any_.modes - true.modes)[1:].sum()
        slope[[OPEN, REGULAR, MODE]] += of_width[0], (units * regular).sum(), modes_off
    bend = np.diff(np.eye(len(WIDTHS_M)), 2, axis=0)
    w, v, rest = x[ODDS], x[WIDTHS], x[WIDTHS.start :] - keep.given
    total += keep.small * float(w @ w) + keep.even * float(((bend @ v) ** 2).sum()) + keep.near * float(rest @ rest)
    slope[ODDS] += 2 * keep.small * w
    slope[WIDTHS] += 2 * keep.even * bend.T @ (bend @ v)
    slope[WIDTHS.start :] += 2 * keep.near * rest
    return total, slope


def allowed(row: KnownRow, odds: FloatArray) -> FloatArray:
    """Odds of stations, none where no place was proposed."""
    return odds if row.may is None else np.where(row.may, odds, -np.inf)


def fitted(rows: Sequence[KnownRow], keep: Kept = STREETS) -> Weights:
    columns = [ramps(r.table) for r in rows]
    count = columns[0].shape[1]
    x = np.concatenate([[-3.0], np.full(count, 0.5), np.zeros(len(WIDTHS_M) + 3)])
    bounds = [(None, 0.0), *[(0.0, None)] * count, *[(None, None)] * (len(WIDTHS_M) + 1), (0.0, 5.0), (-6.0, 6.0)]
    found = minimize(
        unlikelihood, x, (rows, columns, keep), "L-BFGS-B", jac=True, bounds=bounds, options={"maxiter": ROUNDS}
    )
    return weights_of(found.x)


def named(row: KnownRow, weights: Weights) -> list[tuple[float, float]]:
    odds = allowed(row, station_odds(row.table, weights))
    found = choose(Row(odds, *row.ends, np.full(len(odds), ANY), 0), *width_factors(weights))
    if row.may is not None:  # places, of which each is named by itself
        order = np.argsort(-found.border, kind="stable")
        return [(float(row.table.u[k]), float(found.border[k])) for k in order if found.border[k] >= NAMED]
    return [(u, p) for u, p in borders_of_row(row.table.u, found.border) if p >= NAMED]


def judge(title: str, rows: Sequence[KnownRow], weights: Weights, near_m: float = HIT_M) -> None:
    """Prints borders found, false ones and reliability, strip by strip."""
    hits = false = true = 0
    told: list[tuple[float, bool]] = []
    for row in rows:
        left = row.borders.tolist()
        true += len(left)
        for u, p in named(row, weights):
            near = [b for b in left if abs(b - u) <= near_m]
            told.append((p, bool(near)))
            if p >= 0.5:
                hits, false = hits + bool(near), false + (not near)
            if near:
                left.remove(min(near, key=lambda b: abs(b - u)))
    chance, right = np.array([t[0] for t in told]), np.array([t[1] for t in told], float)
    bins = [(chance >= a) & (chance < b) for a, b in pairwise(BINS)]
    parts = [f"{chance[b].mean():.2f} is {right[b].mean():.2f} ({b.sum()})" for b in bins if b.any()]
    error = sum(abs(float((chance[b] - right[b]).sum())) for b in bins) / max(len(chance), 1)
    share = 100 * false / max(hits + false, 1)
    print(
        f"{title:<24} {hits:4d} of {true:<4d} false {false:3d} ({share:.1f} %)  calibration error {100 * error:.1f} %: {', '.join(parts)}",
        flush=True,
    )


def write(name: str, weights: Weights) -> None:
    """In place of the weights of that name."""
    path = Path(str(border_weights.__file__))
    lines = [f"    {w},  # {f.name}" for f, w in zip(FEATURES, weights.features, strict=False)]
    text = "\n".join([
        f"{name} = Weights(", f"    {weights.base}, (", *[f"    {line}" for line in lines], "    ),",
        f"    {weights.widths}, {weights.open}, {weights.regular}, {weights.mode},", ")  # fmt: skip",
    ])  # fmt: skip
    own = re.compile(rf"^{name} = Weights\(.*?^\)  # fmt: skip$", flags=re.MULTILINE | re.DOTALL)
    path.write_text(own.sub(lambda _: text, path.read_text()))


def judge_pictures(cache: Path, folds: bool) -> None:
    """Each file by the committed weights, or by those fitted to the other parts."""
    files = {path.stem: kept(cache, path.stem, list) for path in sorted(cache.glob("*.rows"))}
    for k in range(PARTS if folds else 1):
        held = sorted(files)[k::PARTS] if folds else sorted(files)
        others = [row for name, rows in files.items() if name not in held for row in rows]
        weights = fitted(others, FLIGHTS) if folds else PICTURES
        for name in held:
            judge(name, files[name], weights)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument(
        "--cache", type=Path, required=True, help="rows are kept there, since they take ten times the fit"
    )
    options.add_argument("--write", action="store_true")
    options.add_argument("--folds", action="store_true")
    options.add_argument("--pictures", action="store_true")
    asked = options.parse_args()
    if asked.pictures and asked.write:
        paths = sorted(asked.cache.glob("*.rows"))
        write("PICTURES", fitted([row for path in paths for row in kept(asked.cache, path.stem, list)], FLIGHTS))
        return
    if asked.pictures:
        judge_pictures(asked.cache, asked.folds)
        return

    def streets(seeds: Sequence[tuple[int, int]], plain: bool = False) -> list[KnownRow]:
        name = "plain" if plain else "street"
        towns = [kept(asked.cache, f"{name}_{s}_{d}", partial(street_rows, s, d, plain=plain)) for s, d in seeds]
        return [row for town in towns for row in town]

    if asked.write or asked.folds:
        rows = streets(FITTED) + streets(PLAIN, True)
    if asked.folds:
        delft = kept(asked.cache, "delft", delft_rows)
        halves = [[r for r in delft if r.block % 2 == k] for k in (0, 1)]
        for k in (0, 1):
            weights = fitted([*rows, *halves[1 - k]])
            judge(f"Delft, half {k}", halves[k], weights, 1.0)
        return
    if asked.write:
        write("LIDAR", fitted(rows))
        return
    for seed, density in JUDGED:
        judge(f"street {seed}, {density}/m²", streets([(seed, density)]), LIDAR)


if __name__ == "__main__":
    main()
