"""Models where part of a roof was not seen, and of rough clouds: success against the share unseen, and prior directions.

    python benchmarks/reconstruct_overlap.py [--seeds 7 11 13] [--sample 5] [--study unseen rough prior]

`unseen`: drawn points of synthetic towns (town_models.py), of which a share is taken away: on one `side` of a line (the shadow or the lean of a
higher neighbour), or in `pieces` of 1.5 m radius (trees, water, failed matching). `rough`: the true roofs at 100 points a square metre, whose
errors of 15 cm neighbours within half a metre share. `prior`: the true directions, blurred by what is said to be their precision, as prior.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Direction, Status
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.evaluation.models import ModelErrors, TrueModel, compare_model
from cityflow.reconstruction.model import ModelParameters, model
from drawn_town import SEEDS, table
from town_models import CACHE, model_of, unit_names, unit_of

SHARES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
PIECE_M = 1.5
ROUGH_PER_M2, ROUGH_SIGMA_M, ALIKE_M = 100.0, 0.15, 0.5
NEAR_WALL_M, WALL_STEP_M = 0.5, 0.5
PRIOR_SIGMA_DEG = 1.0
MATCHED_SEEDS, MATCHED_SIZE = (7,), 120
"""Made by matched_models.py."""
PARAMETERS = ModelParameters(with_overhangs=False)


def units(
    seeds: Sequence[int], sample: int, kind: str = "drawn", size: int = 200
) -> Iterator[tuple[int, Evidence, TrueModel]]:
    for seed in seeds:
        for name, _ in unit_names(seed, kind, size, CACHE, None)[::sample]:
            yield seed, *unit_of(seed, kind, name, size, CACHE, None)


def one_side(xyz: FloatArray, share: float, rng: np.random.Generator) -> BoolArray:
    """Points that remain when a share of them on one side of a line of any direction goes."""
    angle = rng.uniform(0, 2 * np.pi)
    along = xyz[:, :2] @ (np.cos(angle), np.sin(angle))
    return np.asarray(along > np.quantile(along, share)) if share else np.ones(len(xyz), bool)


def pieces(xyz: FloatArray, share: float, rng: np.random.Generator) -> BoolArray:
    """Points that remain when discs around some of them go, until a share is gone."""
    stays = np.ones(len(xyz), bool)
    while np.mean(~stays) < share:
        middle = xyz[rng.choice(np.flatnonzero(stays)), :2]
        stays &= np.hypot(*(xyz[:, :2] - middle).T) > PIECE_M
    return stays


WAYS: dict[str, Callable[[FloatArray, float, np.random.Generator], BoolArray]] = {"side": one_side, "pieces": pieces}


def wall_unseen(evidence: Evidence) -> float:
    """Share of the walls that no neighbour hides along which no point stands."""
    ring = evidence.outline.exterior
    hidden = shapely.buffer(shapely.union_all(evidence.party), 0.05) if evidence.party else shapely.Polygon()
    free = shapely.difference(ring, hidden)
    if free.length < WALL_STEP_M:
        return float("nan")
    spots = [p.interpolate(d) for p in shapely.get_parts(shapely.line_merge(free)) for d in np.arange(0.25, p.length, WALL_STEP_M)]  # fmt: skip
    walls = shapely.multipoints(evidence.walls.xyz[:, :2]) if len(evidence.walls.xyz) else shapely.Point()
    shapely.prepare(walls)
    return float(np.mean(~shapely.dwithin(walls, np.asarray(spots), NEAR_WALL_M)))


def rough(evidence: Evidence, truth: TrueModel, rng: np.random.Generator) -> Evidence:
    """The same unit with points of its true roof, dense, noisy and alike."""
    x0, y0, x1, y1 = truth.walls.bounds
    count = int((x1 - x0) * (y1 - y0) * ROUGH_PER_M2)
    x, y = rng.uniform(x0, x1, count), rng.uniform(y0, y1, count)
    z = np.full(count, np.nan)
    for polygon, plane in truth.surfaces:
        inside = shapely.contains_xy(polygon, x, y) & shapely.contains_xy(truth.walls, x, y)
        z[inside] = plane.z(x[inside], y[inside])
    cell = np.floor(np.column_stack([x - x0, y - y0]) / ALIKE_M).astype(int)
    z = z + rng.normal(0, ROUGH_SIGMA_M, cell.max(axis=0) + 1)[cell[:, 0], cell[:, 1]]
    known = np.isfinite(z)
    return replace(evidence, points=PointCloud.of(np.column_stack([x, y, z])[known], BUILDING))


def with_directions(evidence: Evidence, truth: TrueModel, rng: np.random.Generator) -> Evidence:
    """The same unit with its true principal directions, as precise as they say."""
    metres: dict[tuple[str, float], float] = {}
    for polygon, plane in truth.surfaces:
        if plane.slope_deg > 2.0:
            for kind, value in (("aspect", (90.0 - plane.aspect_deg) % 180.0), ("slope", plane.slope_deg)):
                key = kind, round(value, 1)
                metres[key] = metres.get(key, 0.0) + polygon.area
    total = truth.walls.area
    found: dict[str, list[Direction]] = {"aspect": [], "slope": []}
    for (kind, value), area in sorted(metres.items()):
        found[kind].append(Direction(value + rng.normal(0, PRIOR_SIGMA_DEG), PRIOR_SIGMA_DEG, min(area / total, 1.0)))
    return replace(evidence, aspects=tuple(found["aspect"]), slopes=tuple(found["slope"]))


class Tally:
    """What became of many units."""

    def __init__(self) -> None:
        self.errors: list[ModelErrors] = []
        self.degraded: list[bool] = []
        self.unseen: list[float] = []
        self.seconds: list[float] = []

    def add(self, evidence: Evidence, truth: TrueModel, parameters: ModelParameters = PARAMETERS) -> None:
        start = time.process_time()
        choice = model(evidence, parameters)
        self.seconds.append(time.process_time() - start)
        self.errors.append(compare_model(truth, model_of(choice.candidate)))
        self.degraded.append(choice.status is not Status.DONE)
        unseen = choice.candidate.notes.get("unseen_share")
        self.unseen.append(float(unseen) if isinstance(unseen, float) else float("nan"))

    def row(self) -> list[str]:
        e = self.errors
        area = sum(x.surface.area_m2 for x in e)
        within = sum(x.surface.within * x.surface.area_m2 for x in e) / area
        ends = np.concatenate([x.ridge_ends.distances for x in e])
        return [
            str(len(e)), _percent([not x.fault for x in e]), _percent([x.planes_right for x in e]), _percent([x.planes == x.true_planes for x in e]),
            _percent([within]), _percent([x.surface.within >= 0.97 for x in e]), f"{np.sqrt(np.mean(ends**2)) if len(ends) else np.nan:.3f}",
            _percent([float(np.nanmean(self.unseen))]), _percent(self.degraded),
            f"{sum(x.keeps_claim for x in e)} of {sum(x.claims for x in e)}", f"{np.median(self.seconds):.3f}, {np.max(self.seconds):.2f}",
        ]  # fmt: skip


HEAD = [
    "units", "valid", "planes ± 1", "planes", "area within 0.15 m", "units with 97 %", "ridge ends RMSE",
    "said to be unseen", "degraded", "claims kept", "s median, worst",
]  # fmt: skip


def _percent(values: Sequence[bool] | Sequence[float]) -> str:
    return f"{100 * np.mean(values):.1f} %"


def study_unseen(seeds: Sequence[int], sample: int) -> None:
    chosen = list(units(seeds, sample))
    rows = []
    for way, thin in WAYS.items():
        for share in SHARES:
            tally = Tally()
            for seed, evidence, truth in chosen:
                rng = np.random.default_rng([seed, round(100 * share), len(evidence.points)])
                stays = thin(evidence.points.xyz, share, rng)
                tally.add(replace(evidence, points=evidence.points.take(stays)), truth)
            rows.append([way, f"{share:.0%}", *tally.row()])
    walls = np.array([wall_unseen(e) for _, e, _ in chosen])
    table("Part of the roof not seen", ["way", "unseen", *HEAD], rows)
    print(
        f"\nwall unseen: mean {np.nanmean(walls):.3f}, median {np.nanmedian(walls):.3f}, units with all seen {np.nanmean(walls == 0):.3f}"
    )


def study_rough(seeds: Sequence[int], sample: int) -> None:
    tally = Tally()
    for seed, evidence, truth in units(seeds, sample):
        tally.add(rough(evidence, truth, np.random.default_rng([seed, len(evidence.points)])), truth)
    table("100 points a square metre, errors of 15 cm alike over 0.5 m", HEAD, [tally.row()])


def study_prior(seeds: Sequence[int], sample: int) -> None:
    on = PARAMETERS.orientation_histogram.model_copy(update={"prior": True})
    rows = []
    for kind in ("drawn", "rough", "matched"):
        chosen = units(seeds, sample)
        if kind == "matched":
            chosen = units(MATCHED_SEEDS, max(sample // 2, 1), "matched", MATCHED_SIZE)
        without, with_prior = Tally(), Tally()
        for seed, evidence, truth in chosen:
            rng = np.random.default_rng([seed, len(evidence.points)])
            seen = with_directions(rough(evidence, truth, rng) if kind == "rough" else evidence, truth, rng)
            without.add(seen, truth)
            with_prior.add(seen, truth, PARAMETERS.model_copy(update={"orientation_histogram": on}))
        rows += [[kind, "off", *without.row()], [kind, "on", *with_prior.row()]]
    table("Principal directions as prior", ["points", "prior", *HEAD], rows)


STUDIES = {"unseen": study_unseen, "rough": study_rough, "prior": study_prior}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--sample", type=int, default=1, help="every n-th unit")
    parser.add_argument("--study", nargs="+", default=list(STUDIES), choices=STUDIES)
    asked = parser.parse_args()
    for name in asked.study:
        STUDIES[name](asked.seeds, asked.sample)


if __name__ == "__main__":
    main()
