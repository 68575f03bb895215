"""Balconies and dormers of models against those of a synthetic town with discontinuities.

python benchmarks/balconies.py --seeds 41 [--level 2] [--size 250]     # exact points of five heads with noise, true outlines
python benchmarks/balconies.py --seeds 41 --kind dormer                 # units that have one, and as many others
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Installation, Semantic
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.synthetic import roofs
from cityflow.synthetic.town import TownParameters, make_town
from cityflow.synthetic.town_details import BALCONY_M
from cityflow.synthetic.town_units import Unit
from discontinuities import Views

RAIL_M = BALCONY_M[3]
SMALLEST_M2, SLIVER_M = 1.0, 0.02
HALF, NEAR_M = 0.5, 0.3
"""Found where the plans have so much in common of what either covers, and floors or rims are as near as this."""


@dataclass(frozen=True)
class Balcony:
    """World plan, and world heights of underside, floor (NaN where unknown) and upper rim."""

    plan: Polygon
    low: float
    floor: float
    high: float


@dataclass
class Tally:
    """True balconies, found ones and their errors, and what is none."""

    true: int = 0
    invented: int = 0
    errors: list[tuple[float, float, float, float]] = field(default_factory=list)

    def add(self, true: list[Balcony], made: list[Balcony]) -> None:
        left = list(made)
        self.true += len(true)
        for t in true:
            alike = [m for m in left if abs(m.high - t.high) <= NEAR_M and _common(t.plan, m.plan) >= HALF]
            if alike:
                best = max(alike, key=lambda m: _common(t.plan, m.plan))
                left.remove(best)
                depth, width = np.subtract(_sides(best.plan), _sides(t.plan))
                self.errors.append((depth, width, best.high - t.high, best.floor - t.floor))
        self.invented += len(left)

    def report(self, name: str) -> None:
        made = len(self.errors) + self.invented
        print(f"{name}: {len(self.errors)} of {self.true} found, {self.invented} of {made} invented")
        if self.errors:
            depth, width, high, floor = np.abs(np.array(self.errors)).T
            known = floor[np.isfinite(floor)]
            shown = f"{100 * np.median(known):.1f} cm of {len(known)}" if len(known) else "none seen"
            print(
                f"  medians: depth {100 * np.median(depth):.1f} cm, width {100 * np.median(width):.1f} cm, upper rim"
                f" {100 * np.median(high):.1f} cm, floor {shown}",
                flush=True,
            )


def true_balconies(unit: Unit) -> list[Balcony]:
    found = []
    for v in unit.volumes:
        if v.kind == roofs.BALCONY and v.bottom is not None:
            floor = unit.base_m + max(f.height for f in v.faces)
            plan = Polygon(unit.frame.to_world([*v.ring]))
            found.append(Balcony(plan, unit.base_m + v.bottom, floor, floor + RAIL_M))
    return found


def true_dormers(unit: Unit) -> list[Balcony]:
    """What of them stands out of the roof; a dormer has no floor that could be seen."""
    found = []
    for f in unit.roof_planes:
        plan = f.polygon.buffer(-SLIVER_M, join_style="mitre").buffer(SLIVER_M, join_style="mitre")
        if f.kind == roofs.DORMER and isinstance(plan, Polygon) and plan.area > SMALLEST_M2:
            found.append(Balcony(plan, np.nan, np.nan, float(f.plane.z(*shapely.get_coordinates(plan).T).max())))
    return found


def dormer_of(one: Installation) -> Balcony:
    faces = one.surfaces.of_semantic(Semantic.ROOF)
    plan = shapely.union_all([Polygon(one.surfaces.ring(f.rings[0])[:, :2]) for f in faces])
    return Balcony(plan, np.nan, np.nan, float(one.surfaces.vertices[:, 2].max()))


def balcony_of(one: Installation) -> Balcony:
    xyz, ceilings = one.surfaces.vertices, one.surfaces.of_semantic(Semantic.OUTER_CEILING)
    floors = [one.surfaces.ring(f.rings[0])[0, 2] for f in one.surfaces.of_semantic(Semantic.OUTER_FLOOR)]
    plan = Polygon(one.surfaces.ring(ceilings[0].rings[0])[:, :2])
    return Balcony(plan, float(xyz[:, 2].min()), float(floors[0]) if floors else np.nan, float(xyz[:, 2].max()))


def _common(a: Polygon, b: Polygon) -> float:
    return float(a.intersection(b).area / a.union(b).area)


def _sides(plan: Polygon) -> FloatArray:
    """(2,) lengths of the sides of a rectangle, the shorter one first: depth and width."""
    ring = shapely.get_coordinates(shapely.minimum_rotated_rectangle(plan))
    return np.sort(np.hypot(*np.diff(ring[:3], axis=0).T))


def _with_dormers(units: Sequence[Unit]) -> list[Unit]:
    """Units with dormers, and the first others, as many."""
    have = [u for u in units if true_dormers(u)]
    return [*have, *[u for u in units if not true_dormers(u)][: len(have)]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[41])
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--eaves", type=float, default=0.0, help="`town.eaves`")
    parser.add_argument("--size", type=int, default=250)
    parser.add_argument("--kind", choices=("balcony", "dormer"), default="balcony")
    asked = parser.parse_args()
    for seed in asked.seeds:
        town = make_town(
            seed,
            TownParameters(width_m=asked.size, height_m=asked.size, level=asked.level, eaves=asked.eaves, relief=0.2),
        )
        views, tally = Views(town), Tally()
        units = _with_dormers(town.units) if asked.kind == "dormer" else [u for u in town.units if u.breaks]
        true_ones, made_one = (true_dormers, dormer_of) if asked.kind == "dormer" else (true_balconies, balcony_of)
        for unit in units:
            choice = model(views.evidence(unit, seed), ModelParameters())
            tally.add(true_ones(unit), [made_one(i) for i in choice.candidate.installations if i.kind == asked.kind])
        tally.report(f"seed {seed}, {len(units)} units")


if __name__ == "__main__":
    main()
