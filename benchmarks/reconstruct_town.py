"""Models of the buildings of synthetic towns against the truth, by method and by kind of building.

    python benchmarks/reconstruct_town.py [--seeds 7 11 13] [--points exact drawn] [--methods model,volumetric] [--only gable] [--sample 5]
    python benchmarks/reconstruct_town.py --run RUN --truth FOLDER             # the products of a run over what cityflow synth made
    python benchmarks/reconstruct_town.py --unit u00012 --seeds 7 --picture OUT.png

Outlines are the true ones. Points `exact`: the true surface with noise of 3 cm and outliers; `drawn`: with the errors of image matching at 8 cm.
A method is `model` (all methods of the workflow, the choice, overhangs and precision), `model=a+b` (the choice between some), `choose` or
`choose=a+b` (without overhangs and precision), the name of a module of `cityflow.reconstruction` alone, or `module:function`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from cityflow.core.building import Lod, Polyhedron
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.evaluation.models import ModelErrors, compare_model
from cityflow.evaluation.models_table import ASKED, summary
from drawn_town import SEEDS, table
from neighbour_fit import fit_of
from reconstruct_methods import method_of
from town_models import CACHE, buildings_of, model_of, of_run, unit_names, unit_of

KINDS = ("exact", "drawn")
MATCHED = "matched"
GSD_M = 0.08


def judged(
    seed: int,
    kind: str,
    method: Callable[[Evidence], Candidate],
    asked: argparse.Namespace,
    solids: dict[str, Polyhedron],
) -> list[tuple[ModelErrors, float]]:
    """Figures and seconds of every unit asked for; the first unit runs twice, so that nothing is compiled in its time."""
    results: list[tuple[ModelErrors, float]] = []
    for name in _wanted(seed, kind, asked):
        evidence, truth = unit_of(seed, kind, name, asked.size, asked.cache, asked.towns)
        if not results:
            method(evidence)
        start = time.process_time()
        candidate = method(evidence)
        seconds = time.process_time() - start
        results.append((compare_model(truth, model_of(candidate)), seconds))
        if candidate.solid is not None:
            solids[f"{seed} {name}"] = candidate.solid
        if asked.verbose:
            print(_line(seed, kind, results[-1], candidate), flush=True)
    return results


def _wanted(seed: int, kind: str, asked: argparse.Namespace) -> list[str]:
    names = unit_names(seed, kind, asked.size, asked.cache, asked.towns)
    chosen = [name for name, shape in names if not asked.only or shape in asked.only.split(",")]
    return [n for n in chosen if asked.unit in (None, n)][:: asked.sample]


def _line(seed: int, kind: str, result: tuple[ModelErrors, float], candidate: Candidate) -> str:
    e, seconds = result
    flags = "".join(c if ok else "-" for c, ok in (("p", e.planes_right), ("t", e.type_right), ("v", not e.fault)))
    return (
        f"{seed} {kind} {e.id} {e.shape:14s} {flags} planes {e.planes}/{e.true_planes} type {e.roof_type}/{e.true_type} "
        f"within {e.surface.within:.3f} rmse {e.surface.rmse_m:.3f} ({e.surface.rmse_3d_m:.3f}) claims {e.claimed_rmse_m:.3f} "
        f"ridge {np.round(e.ridge_ends.distances, 2).tolist()} -{e.ridge_ends.missed} +{e.ridge_ends.invented} "
        f"{seconds:.2f} s {candidate.method} {e.fault} {candidate.reason}"
    )


def print_tables(title: str, results: Sequence[tuple[ModelErrors, float]]) -> None:
    """All together, then by shape."""
    shapes = sorted({e.shape for e, _ in results})
    columns = {"all": summary(results, GSD_M)} | {s: summary([r for r in results if r[0].shape == s], GSD_M) for s in shapes}  # fmt: skip
    rows = [[name, ASKED.get(name, ""), *(c[name] for c in columns.values())] for name in columns["all"]]
    table(title, ["figure", "asked", *columns], rows)


def print_fit(solids: dict[str, Polyhedron]) -> None:
    """How neighbours fit; those of other towns stand on the same ground, so each seed by itself."""
    for seed in sorted({name.split()[0] for name in solids}):
        own = {name: s for name, s in solids.items() if name.split()[0] == seed}
        table(f"neighbours, seed {seed}", ["figure", "value"], list(fit_of(own).items()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument(
        "--points", nargs="+", default=KINDS, choices=(*KINDS, MATCHED), help="matched: made by matched_models.py"
    )
    parser.add_argument("--methods", default="model")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="parameter of the method")
    parser.add_argument("--only", help="shapes, by commas")
    parser.add_argument("--unit")
    parser.add_argument("--sample", type=int, default=1, help="every n-th unit")
    parser.add_argument("--verbose", action="store_true", help="a line per unit")
    parser.add_argument("--fit", action="store_true", help="how neighbours fit, too")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--cache", type=Path, default=CACHE, help="evidence is kept here")
    parser.add_argument("--towns", type=Path, help="drawn towns are kept here (drawn_town.py)")
    parser.add_argument("--run", type=Path)
    parser.add_argument("--truth", type=Path)
    asked = parser.parse_args()
    if asked.run is not None:
        pairs = of_run(asked.run, asked.truth)
        judged_run = [(compare_model(t, m), float("nan")) for t, m in pairs]
        for e, _ in judged_run if asked.verbose else []:
            print(_line(0, "run", (e, 0.0), Candidate("", None)))
        print_tables(asked.run.name, judged_run)
        if asked.fit:
            solids = {b.id: b.solids[Lod.LOD22] for b in buildings_of(asked.run) if Lod.LOD22 in b.solids}
            table("neighbours", ["figure", "value"], list(fit_of(solids, cut=False).items()))
        return
    for name in asked.methods.split(","):
        method = method_of(name, asked.set)
        if asked.picture:
            _draw(asked, method)
            continue
        for kind in asked.points:
            made: dict[str, Polyhedron] = {}
            results = [r for seed in asked.seeds for r in judged(seed, kind, method, asked, made)]
            print_tables(f"{name}, {kind} points, seeds {' '.join(map(str, asked.seeds))}", results)
            if asked.fit:
                print_fit(made)


def _draw(asked: argparse.Namespace, method: Callable[[Evidence], Candidate]) -> None:
    from unit_pictures import draw_unit

    for seed in asked.seeds:
        for kind in asked.points:
            for name in _wanted(seed, kind, asked):
                evidence, truth = unit_of(seed, kind, name, asked.size, asked.cache, asked.towns)
                candidate = method(evidence)
                print(_line(seed, kind, (compare_model(truth, model_of(candidate)), 0.0), candidate))
                path = asked.picture
                if not asked.unit:
                    path = path.with_name(f"{path.stem}_{seed}_{kind}_{name}{path.suffix}")
                draw_unit(path, evidence, truth, candidate)


if __name__ == "__main__":
    main()
