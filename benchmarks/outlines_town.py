"""Outlines found from walls and roofs against the truth of synthetic towns.

    python benchmarks/outlines_town.py [--seeds 7 11 13] [--size 200] [--cache FOLDER]     # drawn evidence: no matching
    python benchmarks/outlines_town.py --run RUN --truth FOLDER                            # a run over what cityflow synth made

Drawn evidence is what a good matcher would leave, drawn from the truth (`scenes/drawn_frames.py`). Judged against blocks: units that touch are one
outline. A façade is visible where 2.5 m of its height are seen from one of the tilted directions.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, grown
from cityflow.evaluation.outlines import compare_outlines, united_by_adjacency
from cityflow.evaluation.wall_completeness import edges_of, length_found, stretches_of
from cityflow.io.orientation.colmap import read_colmap
from cityflow.io.tables.vector import read_layer
from cityflow.orientation.look_directions import LookParameters, look_directions, looking, worth_a_frame
from cityflow.outlines.find_outlines import FindParameters, find_outlines
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.town import Town
from drawn_town import GSD_M, SEEDS, drawn_town, seen_walls, table

MOST_UNSEEN_TILT = 0.2
EDGE_M = 2.0
"""Walls so near to the edge of a survey are not judged: it may cut them."""
ASKED = {
    "completeness": "≥ 95 %", "correctness": "≥ 95 %", "IoU mean": "≥ 0.92", "corner median m": "≤ 0.15", "visible length": "≥ 97 %",
}  # fmt: skip


def figures(
    found: Sequence[Polygon], true: Sequence[Polygon], town: Town, views: Sequence[FloatArray], area: Bounds
) -> dict[str, float]:
    """What is asked of outlines; `found` and `true` as they come, united here."""
    blocks, truth = united_by_adjacency(found), united_by_adjacency(true)
    a = compare_outlines(blocks, truth, window=shapely.box(*area))
    walls = stretches_of(edges_of(truth))
    low, high = np.array(grown(area, -EDGE_M)).reshape(2, 2)
    walls = walls.take(np.all((walls.xy > low) & (walls.xy < high), axis=1))
    visible = seen_walls(town, walls, views, area)
    return {
        "true": a.true, "found": a.found, "completeness": a.completeness, "correctness": a.correctness,
        "IoU mean": a.iou_mean, "IoU joined": a.iou_joined_mean, "corner median m": a.corner_median_m,
        "corner mean m": a.corner_mean_m, "boundary median m": a.boundary_m,
        "visible length": length_found(blocks, walls.take(visible), 3 * GSD_M), "all length": length_found(blocks, walls, 3 * GSD_M),
        "visible share": float(walls.length[visible].sum() / walls.length.sum()),
    }  # fmt: skip


def of_seed(seed: int, size: int, cache: Path | None) -> dict[str, float]:
    made = drawn_town(seed, size, cache)
    start = time.process_time()
    walls = made.wall_points(WallPointParameters())
    between = time.process_time()
    surface = made.region_surface(walls)
    found = found_walls_in(find_outlines(surface, FindParameters()), seen_in(surface), WallsInParameters())
    end = time.process_time()
    views = [looking(f.frame) for f in made.frames[1:]]
    true = [g for g, _ in made.truth["blocks"]]
    result = figures([o.polygon for o in found], true, made.town, views, made.town.bounds)
    if cache is not None:
        _keep(cache / f"outlines_s{seed}_{size}.json", [o.polygon for o in found])
    return result | {
        "walls s": between - start,
        "outlines s": end - between,
        "s per outline": (end - between) / max(len(found), 1),
    }


def _keep(path: Path, polygons: Sequence[Polygon]) -> None:
    path.write_text(json.dumps([shapely.to_wkt(p, rounding_precision=-1) for p in polygons]))


def of_run(run: Path, truth: Path) -> dict[str, float]:
    """A run over a synthetic survey, inside its area."""
    p = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    images = read_colmap(truth / "truth" / "orientation").images
    look = LookParameters()
    views = [looking(f) for f in look_directions(images) if worth_a_frame(f, look)]
    tilted = [v for v in views if np.hypot(v[0], v[1]) > MOST_UNSEEN_TILT]
    found = read_layer(run / "products" / "outlines.gpkg", "outlines").geometry
    true = read_layer(truth / "truth" / "town.gpkg", "blocks").geometry
    return figures(list(found), list(true), town_of(p.seed, p.whole_town), tilted, p.area)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--run", type=Path)
    parser.add_argument("--truth", type=Path)
    asked = parser.parse_args()
    if asked.run is not None:
        columns = {"run": of_run(asked.run, asked.truth)}
    else:
        columns = {f"seed {s}": of_seed(s, asked.size, asked.cache) for s in asked.seeds}
        columns["mean"] = {k: float(np.mean([c[k] for c in columns.values()])) for k in next(iter(columns.values()))}
    rows = [[k, *(f"{c[k]:.3f}" for c in columns.values()), ASKED.get(k, "")] for k in next(iter(columns.values()))]
    table("Outlines", ["figure", *columns, "asked"], rows)


if __name__ == "__main__":
    main()
