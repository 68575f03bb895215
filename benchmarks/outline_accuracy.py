"""How exact outlines are, by the façades that a laser has seen, and what overhangs come of it: scanned synthetic towns, outlines off by a known amount.

    python benchmarks/outline_accuracy.py --seeds 311 312 [--size 120] [--density 10]

Each outline is moved as a whole in a direction of its own, so that its edges are off by 1/√2 of that (standard deviation), and nothing is said of it. Told
are the figure that the survey's own façades give, and the overhangs that come of it and of a fixed 9 cm: invented are edges without overhang that got one,
missed those with one that got none.
"""

from __future__ import annotations

import argparse

import numpy as np
import shapely

from cityflow.core.building import Outline
from cityflow.core.grid import grown
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.outlines.under_eaves.accuracy import OutlineAccuracy, accuracy_of, facade_offsets
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.synthetic.town import TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from overhangs_town import Place, Tally, judge, places_of, table

OFF_M = (0.0, 0.05, 0.1, 0.2)
FIXED_M = 0.09
AROUND_M = 2.0
HEAD = (
    "seed",
    "outlines off m",
    "true σ m",
    "σ found m",
    "façades",
    "fixed 9 cm: invented",
    "missed",
    "own: invented",
    "missed",
    "median error of stated m",
)


def accuracy(places: list[Place], cloud: PointCloud) -> OutlineAccuracy:
    outlines = [Outline(p.unit.id, p.outline, party=p.party) for p in places]
    return accuracy_of(facade_offsets(outlines, SeenHouses.of(cloud.xyz, None)))


def evidence_of(place: Place, cloud: PointCloud) -> Evidence:
    close = cloud.within(grown(place.outline.bounds, AROUND_M))
    close = close.take(shapely.dwithin(shapely.points(close.xyz[:, :2]), place.outline, AROUND_M))
    return Evidence(place.unit.id, place.outline, place.points, place.unit.floor_m, around=close, party=place.party)


def rows_of(seed: int, size: int, density: float) -> list[list[str]]:
    town = make_town(seed, TownParameters(width_m=size, height_m=size))
    scan = town_lidar(town, seed, TownLidarParameters(density_m2=density, classes="perfect"))
    cloud = scan.points.take(scan.points.classification == BUILDING)
    rows = []
    for off in OFF_M:
        places = places_of(town, off, seed)
        own = accuracy(places, cloud)
        tallies = []
        for sigma in (FIXED_M, own.sigma_m):
            tally, parameters = Tally(), replace_sigma(sigma)
            for place in places:
                judge(tally, place, evidence_of(place, cloud), parameters)
            tallies.append(tally)
        counts = [
            c
            for t in tallies
            for c in (
                f"{np.sum(np.array(t.bare) > 0)} of {len(t.bare)}",
                f"{np.sum(np.array(t.found) == 0)} of {len(t.found)}",
            )
        ]
        found = np.array(tallies[1].found)
        error = np.abs(found - np.array(tallies[1].true))[found > 0]
        rows.append(
            [
                f"{seed}",
                f"{off:g}",
                f"{off / np.sqrt(2):.3f}",
                f"{own.sigma_m:.3f}",
                f"{own.facades}",
                *counts,
                f"{np.median(error):.3f}",
            ]
        )
    return rows


def replace_sigma(sigma_m: float) -> OverhangParameters:
    return OverhangParameters().model_copy(update={"outline_sigma_m": sigma_m})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[311, 312])
    parser.add_argument("--size", type=int, default=120)
    parser.add_argument("--density", type=float, default=10.0)
    asked = parser.parse_args()
    table(
        "Outlines and overhangs",
        HEAD,
        [row for seed in asked.seeds for row in rows_of(seed, asked.size, asked.density)],
    )


if __name__ == "__main__":
    main()
