"""Roofs of few points against the truth: drawn suburbs, drawn towns and rows of old houses, thinned to some densities.

    python benchmarks/sparse_roofs.py [--cases suburb:1 town:301 old:1] [--densities 2 0.7] [--set primitives.number_nats=4]

A case is kind and seed. Truth is the roof without clutter, 0.3 m inside the outline. What is missed is told by its cause: what the model from all points
misses, too; units of fewer points than two for each face of that model; one level face where that model has several; fewer faces; as many faces, in the
wrong place or shape.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from itertools import product

import numpy as np

from changed_parameters import changed_parameters
from cityflow.core.arrays import BoolArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.evaluation.roof_points import unit_distances
from cityflow.geometry.roof_distances import NEAR
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.choose import Choice, ReconstructParameters, choose
from drawn_suburb import FULL_M2, Roof, suburb, town
from drawn_town import table
from scenes.inner_city import InnerCityParameters, inner_city

FUNDAMENTAL, BLOCK, FEWER, WRONG, BOTH = (
    "too few points",
    "one level face",
    "fewer faces",
    "wrong place or shape",
    "all points, too",
)
CAUSES = (BOTH, FUNDAMENTAL, BLOCK, FEWER, WRONG)


def old_houses(seed: int) -> Iterator[Roof]:
    """Rows of old houses, scanned as densely as the suburbs."""
    for house in inner_city(seed, InnerCityParameters(density_m2=FULL_M2)):
        yield Roof("old", house.evidence, house.roof_points())


KINDS: Mapping[str, Callable[[int], Iterator[Roof]]] = {"suburb": suburb, "town": town, "old": old_houses}


def judged(
    made: list[Roof], whole: list[Polyhedron | None], per_m2: float, parameters: ReconstructParameters
) -> list[str]:
    """One row of the table; `whole`: the models from all points."""
    lost: Counter[str] = Counter()
    met = of_whole = of_best = places = bad = 0
    methods: Counter[str] = Counter()
    for roof, full in zip(made, whole, strict=True):
        evidence = roof.thinned(per_m2)
        choice = choose(evidence, parameters)
        solid = choice.candidate.solid
        ours, theirs = _met(roof, solid), _met(roof, full)
        best = max(_valid(choice), key=lambda s: int(_met(roof, s).sum()), default=None)
        places, met, of_whole = places + len(ours), met + int(ours.sum()), of_whole + int(theirs.sum())
        of_best += int(_met(roof, best).sum())
        lost[BOTH] += int((~ours & ~theirs).sum())
        lost[_cause(len(evidence.points), _faces(solid), _faces(full))] += int((~ours & theirs).sum())
        bad += solid is None or bool(check_polyhedron(solid))
        methods[choice.candidate.method] += 1
    share = [f"{lost[cause] / places:.1%}" for cause in CAUSES]
    told = ", ".join(f"{m} {n}" for m, n in sorted(methods.items()))
    return [
        str(len(made)),
        str(bad),
        f"{met / places:.1%}",
        f"{of_best / places:.1%}",
        f"{of_whole / places:.1%}",
        *share,
        told,
    ]


def _valid(choice: Choice) -> list[Polyhedron]:
    return [c.solid for c, s in zip(choice.tried, choice.scores, strict=True) if c.solid is not None and s.valid]


def _met(roof: Roof, solid: Polyhedron | None) -> BoolArray:
    """(P,) whether the model stands within 20 cm of the true roof."""
    return np.asarray(np.abs(unit_distances(roof.evidence.outline, solid, roof.truth)) <= NEAR)


def _faces(solid: Polyhedron | None) -> int:
    return 0 if solid is None else len(solid.of_semantic(Semantic.ROOF))


def _cause(points: int, faces: int, wanted: int) -> str:
    if points < 2 * wanted:
        return FUNDAMENTAL
    if faces <= 1 < wanted:
        return BLOCK
    return FEWER if faces < wanted else WRONG


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--cases", nargs="+", default=["suburb:1", "town:301", "old:1"])
    options.add_argument("--densities", type=float, nargs="+", default=[2.0, 0.7])
    options.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="parameters of the choice")
    asked = options.parse_args()
    parameters = changed_parameters(asked.set)
    rows = []
    for case in asked.cases:
        kind, seed = case.split(":")
        made = list(KINDS[kind](int(seed)))
        whole = [choose(roof.evidence, parameters).candidate.solid for roof in made]
        rows += [[case, f"{d:g}", *judged(made, whole, d, parameters)] for _, d in product([case], asked.densities)]
    names = ["case", "per m²", "units", "invalid", "within 20 cm", "best of those tried", "from all points"]
    table(f"few points {asked.set}", [*names, *CAUSES, "methods"], rows)


if __name__ == "__main__":
    main()
