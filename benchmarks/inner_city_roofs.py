"""Sparse and cluttered roofs against the truth: rows of old houses, and towns under a scanner.

    python benchmarks/inner_city_roofs.py [--seeds 1 2] [--cases old:15:1 old:15:2.5 old:2:1 town:8 town:2 town:0.45]
    python benchmarks/inner_city_roofs.py --set orientation_histogram.partition.number_cost=0.6 orientation_histogram.unevenness=0.04

A case is kind, pulses per m² and, for old houses, the amount of clutter. Truth is the roof without clutter, also under it, 0.3 m inside the
outline; planes count from 1.5 m². A plane missed and one too many in the same house cancel.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np
import shapely

from changed_parameters import changed_parameters
from cityflow.core.arrays import FloatArray
from cityflow.core.reconstruction import Evidence
from cityflow.evaluation.roof_points import unit_distances
from cityflow.geometry.roof_distances import summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.choose import Choice, ReconstructParameters, choose
from cityflow.synthetic.town_lidar import TownLidarParameters
from delft_reconstruction import made_units
from drawn_town import table
from scenes.inner_city import InnerCityParameters, inner_city
from scenes.scanned_town import scanned_town

CASES = ("old:15:1", "old:15:2.5", "old:2:1", "town:8", "town:2", "town:0.45")


def units_of(case: str, seed: int) -> Iterator[tuple[Evidence, int, FloatArray]]:
    """Evidence, number of true planes, and points of the true roof."""
    kind, density, *clutter = case.split(":")
    if kind == "old":
        scene = InnerCityParameters(density_m2=float(density), clutter=float(clutter[0]))
        for house in inner_city(seed, scene):
            yield house.evidence, house.planes, house.roof_points()
        return
    for evidence, planes, truth in made_units(scanned_town(seed, scan=TownLidarParameters(density_m2=float(density)))):
        yield evidence, planes, truth[shapely.contains_xy(evidence.outline.buffer(-0.3), *truth[:, :2].T)]


def judged(case: str, seeds: list[int], parameters: ReconstructParameters) -> list[str]:
    """One row of the table."""
    made = [unit for seed in seeds for unit in units_of(case, seed)]
    choose(made[0][0], parameters)
    choices, seconds = list[Choice](), list[float]()
    for evidence, _, _ in made:
        start = time.process_time()
        choices.append(choose(evidence, parameters))
        seconds.append(time.process_time() - start)
    solids = [c.candidate.solid for c in choices]
    off = [len(c.candidate.planes) - planes for c, (_, planes, _) in zip(choices, made, strict=True)]
    truth = summarise(
        np.concatenate([unit_distances(u[0].outline, s, u[2]) for u, s in zip(made, solids, strict=True)])
    )
    points = summarise(
        np.concatenate([unit_distances(u[0].outline, s, u[0].points.xyz) for u, s in zip(made, solids, strict=True)])
    )
    methods = Counter(c.candidate.method for c in choices)
    return [
        case, str(len(made)), str(sum(s is None or bool(check_polyhedron(s)) for s in solids)),
        f"{sum(len(c.candidate.planes) for c in choices)} of {sum(u[1] for u in made)}",
        f"{np.mean(np.abs(off) <= 1):.0%}", f"{truth.within_20cm:.1%}", f"{100 * truth.nmad:.1f} cm", f"{points.within_20cm:.1%}",
        f"{1e3 * np.median(seconds):.0f} ms", ", ".join(f"{m} {n}" for m, n in sorted(methods.items())),
    ]  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    options.add_argument("--cases", nargs="+", default=CASES)
    options.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="parameters of the choice")
    asked = options.parse_args()
    parameters = changed_parameters(asked.set)
    names = [
        "case",
        "units",
        "invalid",
        "planes",
        "within one",
        "truth within 20 cm",
        "NMAD",
        "points within 20 cm",
        "median",
        "methods",
    ]
    table(f"seeds {asked.seeds} {asked.set}", names, [judged(case, asked.seeds, parameters) for case in asked.cases])


if __name__ == "__main__":
    main()
