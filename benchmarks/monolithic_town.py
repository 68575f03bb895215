"""When the monolithic method calls a roof inconsistent, and when it should: by kind of building, against the truth.

python benchmarks/monolithic_town.py [--seeds 7 11 13] [--points exact drawn] [--sample 5] [--verbose]

A true roof is broken where two of its surfaces meet, within the walls, in a step of more than `STEP_M` along more than `LENGTH_M`.
`right`: consistent, 97 % of the area within 0.15 m, and the right number of planes; `wrong`: consistent and not so. `handed over`: inconsistent and
broken; `missed`: inconsistent although whole.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np
import shapely

from cityflow.core.reconstruction import Candidate
from cityflow.evaluation.models import ModelErrors, TrueModel, compare_model
from cityflow.reconstruction.monolithic import MonolithicParameters, reconstruct
from drawn_town import SEEDS, table
from town_models import CACHE, KINDS, model_of, unit_names, unit_of

STEP_M, LENGTH_M, CELL_M = 0.25, 0.5, 0.1
OUTCOMES = ("right", "wrong", "handed over", "missed")


def broken(truth: TrueModel) -> float:
    """Metres of steps within the walls."""
    x_0, y_0, x_1, y_1 = truth.walls.bounds
    x, y = np.meshgrid(np.arange(x_0, x_1, CELL_M), np.arange(y_0, y_1, CELL_M))
    surface, z = np.full(x.shape, -1), np.full(x.shape, np.nan)
    within = shapely.contains_xy(truth.walls, x, y)
    for k, (polygon, plane) in enumerate(truth.surfaces):
        mine = within & shapely.contains_xy(polygon, x, y)
        surface[mine], z[mine] = k, plane.z(x[mine], y[mine])
    length = 0.0
    for a, b in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        with np.errstate(invalid="ignore"):
            differ = (surface[a] != surface[b]) & (surface[a] >= 0) & (surface[b] >= 0) & (np.abs(z[a] - z[b]) > STEP_M)
        length += CELL_M * np.count_nonzero(differ)
    return length


def outcome(errors: ModelErrors, candidate: Candidate, steps: float) -> str:
    if candidate.solid is None:
        return "handed over" if steps > LENGTH_M else "missed"
    good = errors.surface.within >= 0.97 and errors.planes == errors.true_planes and not errors.fault
    return "right" if good else "wrong"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--points", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--sample", type=int, default=1)
    parser.add_argument("--verbose", action="store_true")
    asked = parser.parse_args()
    parameters = MonolithicParameters()
    for kind in asked.points:
        counts: dict[str, Counter[str]] = {}
        reasons: Counter[str] = Counter()
        seconds: list[float] = []
        for seed in asked.seeds:
            for name, shape in unit_names(seed, kind, 200, CACHE, None)[:: asked.sample]:
                evidence, truth = unit_of(seed, kind, name, 200, CACHE, None)
                if not seconds:
                    reconstruct(evidence, parameters)
                start = time.process_time()
                candidate = reconstruct(evidence, parameters)
                seconds.append(time.process_time() - start)
                errors = compare_model(truth, model_of(candidate))
                steps = broken(truth)
                what = outcome(errors, candidate, steps)
                for row in (shape, "all"):
                    counts.setdefault(row, Counter())[what] += 1
                if candidate.solid is None:
                    reasons["".join(c for c in candidate.reason if not c.isdigit())] += 1
                if asked.verbose and what in ("wrong", "missed"):
                    figures = f"{steps:.1f} m of steps, {errors.planes} of {errors.true_planes} planes, within {errors.surface.within:.3f}"
                    print(seed, kind, name, shape, what, figures, candidate.reason)
        rows = [[s, str(c.total()), *(str(c[o]) for o in OUTCOMES)] for s, c in sorted(counts.items())]
        table(f"monolithic, {kind} points, s median {np.median(seconds):.3f} worst {max(seconds):.3f}", ["shape", "units", *OUTCOMES], rows)  # fmt: skip
        for reason, count in reasons.most_common():
            print(f"{count:4d} {reason}")


if __name__ == "__main__":
    main()
