"""Blocks of synthetic towns split into single units, against the truth.

    python benchmarks/split_town.py [--seeds 7 11 13] [--size 200] [--cache FOLDER]     # drawn evidence: no matching
    python benchmarks/split_town.py --run RUN --truth FOLDER                            # a run over what cityflow synth made

The first table splits the true outlines of the blocks, the second what `find_outlines` finds. Borders that the outlines already have are not
counted; both sides of a gap are.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.building import OutlineEdge
from cityflow.core.splitting import Splitting
from cityflow.evaluation.unit_accuracy import FoundUnits, UnitsAccuracy, compare_units
from cityflow.io.tables.vector import Layer, read_layer
from cityflow.outlines.find_outlines import FindParameters, find_outlines
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.splitting.split import SplitParameters, split
from cityflow.stages.synth.synthetic_survey import SynthParameters
from drawn_town import SEEDS, DrawnTown, Layers, drawn_town, table, true_borders
from scenes.drawn_evidence import split_evidence

ASKED = {
    "sensitivity traced": "≥ 90 %", "false alarms share": "≤ 5 %", "position m": "≤ 0.2", "angle deg": "≤ 0.5",
    "s per outline median": "≤ 0.5",
}  # fmt: skip

SEEN = 0.3
"""A unit of which so much lies in the surveyed area is one that may be found, and so are its borders."""

Outlines = Sequence[tuple[Polygon, tuple[OutlineEdge, ...]]]


def figures(a: UnitsAccuracy) -> dict[str, float]:
    by_trace = {f"  {name}": s.share for name, s in a.by_trace.items()}
    counts = {f"  {name}, borders": float(s.borders) for name, s in a.by_trace.items()}
    return {
        "borders": a.all_borders.borders, "hits": len(a.hits), "misses": len(a.missed), "false alarms": len(a.false_alarms),
        "sensitivity": a.all_borders.share, "sensitivity traced": a.traced.share, **by_trace, **counts,
        "false alarms share": a.false_share, "position m": a.position_m, "angle deg": a.angle_deg, "IoU of units": a.iou_mean,
        "units over 0.7": a.same_share,
    }  # fmt: skip


def split_all(made: DrawnTown, outlines: Outlines) -> tuple[list[Splitting], list[float]]:
    """Every outline split, and the seconds that each took."""
    results, seconds = [], []
    for number, (polygon, inner) in enumerate(outlines):
        evidence = split_evidence(f"o{number}", polygon, made.frames, made.terrain, inner)
        start = time.process_time()
        results.append(split(evidence, SplitParameters()))
        seconds.append(time.process_time() - start)
    return results, seconds


def judged(made: DrawnTown, outlines: Outlines) -> dict[str, float]:
    results, seconds = split_all(made, outlines)
    units, borders = true_borders(made.truth)
    found = FoundUnits(
        [p for p, _ in outlines], [u for r in results for u in r.units], [c.line for r in results for c in r.cut_lines]
    )
    accuracy = compare_units(found, units, borders)
    several = [s for s, r in zip(seconds, results, strict=True) if not r.reason]
    return figures(accuracy) | {
        "s per outline median": float(np.median(seconds)),
        "s, of those that can be split": float(np.median(several)) if several else float("nan"),
        "s per outline greatest": max(seconds),
    }


def given(made: DrawnTown) -> Outlines:
    """Without the vertices on straight edges that the single units have left: they would tell where to cut."""
    return [(shapely.simplify(g, 0.005), ()) for g, _ in made.truth["blocks"]]


def found_outlines(made: DrawnTown) -> Outlines:
    walls = made.wall_points(WallPointParameters())
    return [(o.polygon, o.inner_edges) for o in find_outlines(made.region_surface(walls), FindParameters())]


def of_run(run: Path, truth: Path) -> dict[str, float]:
    """A run over a synthetic survey, inside its area."""
    p = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    file, town = run / "products" / "outlines.gpkg", truth / "truth" / "town.gpkg"
    outlines, units = (list(read_layer(file, name).geometry) for name in ("outlines", "units"))
    cuts = read_layer(file, "cut_lines")
    lines = [
        g for g, used in zip(cuts.geometry, cuts.columns["used"], strict=True) if used and isinstance(g, LineString)
    ]
    layers: Layers = {name: _records(read_layer(town, name)) for name in ("units", "cut_lines")}
    area = shapely.box(*p.area)
    layers["units"] = [(g, row) for g, row in layers["units"] if g.intersection(area).area > SEEN * g.area]
    return figures(compare_units(FoundUnits(outlines, units, lines), *true_borders(layers)))


def _records(layer: Layer) -> list[tuple[object, dict[str, object]]]:
    return [(g, {name: values[k] for name, values in layer.columns.items()}) for k, g in enumerate(layer.geometry)]


def _print(title: str, columns: dict[str, dict[str, float]]) -> None:
    if len(columns) > 1:
        columns["mean"] = {k: float(np.nanmean([c[k] for c in columns.values()])) for k in next(iter(columns.values()))}
    rows = [[k, *(f"{c[k]:.3f}" for c in columns.values()), ASKED.get(k, "")] for k in next(iter(columns.values()))]
    table(title, ["figure", *columns, "asked"], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--given-only", action="store_true", help="split the true outlines alone")
    parser.add_argument("--run", type=Path)
    parser.add_argument("--truth", type=Path)
    asked = parser.parse_args()
    if asked.run is not None:
        _print("Single units", {"run": of_run(asked.run, asked.truth)})
        return
    towns = [drawn_town(s, asked.size, asked.cache) for s in asked.seeds]
    _print("True outlines of blocks", {f"seed {t.seed}": judged(t, given(t)) for t in towns})
    if not asked.given_only:
        _print("Found outlines", {f"seed {t.seed}": judged(t, found_outlines(t)) for t in towns})


if __name__ == "__main__":
    main()
