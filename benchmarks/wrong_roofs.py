"""What is wrong in the models of matched flights, by cause.

    python benchmarks/wrong_roofs.py ROWS TRUTH ROWS TRUTH …     # ROWS: of `verdict_flights.py rows`; TRUTH: a folder with synth.json

Models, evidence and truth are those of the rows; units at which the survey ends are left out. Places of the true roofs that a model misses by more than
20 cm are counted under the first cause that fits; per cause: square metres in wrong units and in all, units that would be right over 95 % if it alone were
gone, and wrong units whose largest cause it is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import MultiPolygon, Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.reconstruction import Evidence
from cityflow.surface.sample import sample
from cityflow.synthetic.roofs import DORMER
from cityflow.synthetic.town_units import Unit
from verdict_cases import GOOD_SHARE, WITHIN_M, height_of
from verdict_flights import read_rows
from verdicts_run import AROUND_M, MOST, units_of

CAUSES = (
    "the outline misses a part of the building", "the outline misses a rim of 0.5 m", "the outline is beyond the building",
    "the border takes a neighbour's roof", "no points near", "dormer", "within 1 m of a shared wall", "within 0.6 m of a free side",
    "step within the unit", "the surface is wrong", "the surface is right",
)  # fmt: skip
NEAR_M, SHARED_M, FREE_M, STEP_M, HOLE_M, DORMER_M, RIM_M = 0.75, 1.0, 0.6, 1.3, 0.8, 0.5, 0.5


class Wrong(NamedTuple):
    """A unit: the share of its roof that is right, the share of each cause that is wrong, and its area, m²."""

    name: str
    right: float
    shares: FloatArray
    area: float


def wrong_units(rows: Path, truth: Path) -> Iterator[Wrong]:
    units = units_of(truth)
    tree = shapely.STRtree([u.wall_outline for u in units])
    for row in read_rows(rows):
        if row.survey_end or row.solid is None or not len(row.places):
            continue
        outline = row.evidence.outline
        near = [units[k] for k in np.sort(tree.query(outline, predicate="dwithin", distance=AROUND_M))]
        shared = [shapely.intersection(outline, u.wall_outline).area for u in near]
        own = [u for u, m2 in zip(near, shared, strict=True) if m2 > MOST * min(u.wall_outline.area, outline.area)]
        wrong = ~(row.away <= WITHIN_M)
        cause = _causes(row.places, row.evidence, near, own)
        shares = np.bincount(cause[wrong], minlength=len(CAUSES)) / len(row.places)
        step = float(np.median(np.diff(np.unique(np.round(row.places[:, 0], 3)))))
        yield Wrong(f"{row.seed} {row.unit}", 1 - float(wrong.mean()), shares, len(row.places) * step**2)


def _causes(places: FloatArray, evidence: Evidence, near: list[Unit], own: list[Unit]) -> IntArray:
    """(P,) number of the first cause in `CAUSES` that fits each place."""
    x, y, z = places.T
    points, heights, outline = shapely.points(x, y), evidence.heights, evidence.outline
    if heights is None:
        raise ValueError("matched units have heights")
    walls = shapely.union_all([u.wall_outline for u in own])
    beside = shapely.union_all([*evidence.party, *(u.wall_outline for u in near if not any(u is o for o in own))])
    to_shared = np.nan_to_num(shapely.distance(points, beside), nan=np.inf)
    dormers = shapely.union_all([f.polygon for u in own for f in u.prisms if f.kind == DORMER])
    to_dormer = np.nan_to_num(shapely.distance(points, dormers), nan=np.inf)
    found = evidence.points.xyz
    to_point = cKDTree(found[:, :2]).query(places[:, :2])[0] if len(found) else np.full(len(x), np.inf)
    out = shapely.distance(points, outline)
    fits = (
        out > RIM_M, out > 0, np.isnan(z), ~shapely.contains_xy(walls, x, y), to_point > HOLE_M,
        (to_dormer <= DORMER_M) & (to_shared > DORMER_M), to_shared <= SHARED_M, shapely.distance(points, outline.boundary) <= FREE_M,
        _beside_step(x, y, z, own, walls), ~(np.abs(sample(heights.grid, heights.dsm, x, y) - z) <= WITHIN_M), np.ones(len(x), bool),
    )  # fmt: skip
    return np.asarray(np.argmax(np.column_stack(fits), axis=1))


def _beside_step(
    x: FloatArray, y: FloatArray, z: FloatArray, own: list[Unit], walls: Polygon | MultiPolygon
) -> BoolArray:
    """(P,) where the true roof of the unit differs by more than `STEP_M` within `NEAR_M`: more than a slope."""
    step = np.zeros(len(x), bool)
    for angle in np.arange(8) * np.pi / 4:
        for away in (NEAR_M / 2, NEAR_M):
            a, b = x + away * np.cos(angle), y + away * np.sin(angle)
            there = np.fmax.reduce([height_of(u, a, b) for u in own]) if own else np.full(len(x), np.nan)
            step |= shapely.contains_xy(walls, a, b) & (np.abs(there - z) > STEP_M)
    return step


def main() -> None:
    rows: list[Wrong] = []
    for file, truth in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        rows += wrong_units(Path(file), Path(truth))
    right, shares = np.array([r.right for r in rows]), np.array([r.shares for r in rows])
    area = shares * np.array([[r.area] for r in rows])
    for row in sorted(rows):
        told = sorted(((s, c) for s, c in zip(row.shares, CAUSES, strict=True) if s >= 0.005), reverse=True)
        print(f"{row.name:32} {100 * row.right:5.1f} %  " + ", ".join(f"{c} {100 * s:.1f}" for s, c in told))
    bad = right < GOOD_SHARE
    print(f"{len(rows)} units, {(~bad).sum()} right over 95 %; wrong in the mean {100 * (1 - right.mean()):.2f} %")
    print("m² in wrong units, in all; units right without it; wrong units whose largest cause it is")
    for k in np.argsort(-area[bad].sum(axis=0)):
        without, largest = right + shares[:, k] >= GOOD_SHARE, shares.argmax(axis=1) == k
        print(
            f"{CAUSES[k]:44} {area[bad, k].sum():7.1f} {area[:, k].sum():7.1f} {(bad & without).sum():4} {(bad & largest).sum():4}"
        )


if __name__ == "__main__":
    main()
