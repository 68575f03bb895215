"""Lines through found outlines along which images may show a gap, with their figures; the weights that tell gaps from others, fitted and cross-validated.

    python benchmarks/image_gaps.py RUN TRUTH [RUN TRUTH ...] [--told 20]          # TRUTH: what `cityflow synth` made

A place is the best of the lines within 1.5 m. It is a gap where 60 % of its line lie between two units of different blocks that stand less than 2.5 m apart
in one outline, as found without images. cv: the probability by weights that are fitted to the other runs.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from scipy.optimize import minimize

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.evaluation.outlines import united_by_adjacency
from cityflow.outlines.find_outlines import find_outlines
from cityflow.outlines.from_heights.footprint_roofs import orientations_of
from cityflow.outlines.from_heights.regions import building_regions
from cityflow.outlines.from_images.disagreement import CELL_M
from cityflow.outlines.from_images.image_seams import WEIGHTS, Profile, figures_of, image_lines, roof_cells
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.town import Town
from drawn_town import table
from narrow_gaps_images import owner_of
from outline_pieces import GAP_M, seen_in_images, surface_of

PLACE_M, ALONG, SHRINKAGE = 1.5, 0.6, 0.05


class Place(NamedTuple):
    """A run, the true width of the gap there (0: none), the middle of the line in metres, and its profile."""

    run: str
    width: float
    at: tuple[float, float]
    profile: Profile


def places_of(run: Path, truth: Path) -> list[Place]:
    """All of a run, the likeliest first."""
    surface, parameters = surface_of(run)
    made = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    town = town_of(made.seed, made.whole_town)
    strips = list(_strips(town, [o.polygon for o in find_outlines(surface, parameters)]))
    seen, found = seen_in_images(run, truth), list[Place]()
    begun, regions = time.process_time(), building_regions(surface, parameters.regions)
    for region in regions:
        grid, roof = roof_cells(region.mask, region.grid)
        directions = [d for o in orientations_of(region) for d in (-o, np.pi / 2 - o)]
        for line in image_lines(roof, seen.heights(grid), grid, directions, seen.images):
            seam = line.lattice.seam(*line.at, 0.0)
            way = shapely.LineString([_world(grid, seam.start), _world(grid, seam.end)])
            width = next((w for s, w in strips if shapely.intersection(way, s).length > ALONG * way.length), 0.0)
            found.append(Place(str(run), width, (way.centroid.x, way.centroid.y), line.profile))
    print(
        f"{run}: {1e3 * (time.process_time() - begun) / max(len(regions), 1):.0f} ms a region, {len(regions)} regions",
        flush=True,
    )
    kept = list[Place]()
    for p in sorted(found, key=lambda p: -p.profile.probability):
        if all(np.hypot(p.at[0] - q.at[0], p.at[1] - q.at[1]) > PLACE_M for q in kept) and not (
            p.width and p.width in [q.width for q in kept]
        ):
            kept.append(p)
    return kept


def _world(grid: Grid, at: FloatArray) -> tuple[float, float]:
    return grid.x_min + float(at[0]) * CELL_M, grid.y_max - float(at[1]) * CELL_M


def _strips(town: Town, found: list[shapely.Polygon]) -> Iterator[tuple[shapely.Geometry, float]]:
    """The ground between units of different blocks that lie in one outline, and its width."""
    walls = [u.wall_outline for u in town.units]
    block, owner = owner_of(united_by_adjacency(walls), town), owner_of(united_by_adjacency(found), town)
    first, second = shapely.STRtree(walls).query(walls, predicate="dwithin", distance=GAP_M)
    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        if a < b and block[a] != block[b] and owner[a] == owner[b] >= 0:
            width = float(shapely.distance(walls[a], walls[b]))
            reach = 0.75 * width + 0.3
            near = shapely.intersection(shapely.buffer(walls[a], reach), shapely.buffer(walls[b], reach))
            yield shapely.minimum_rotated_rectangle(near), width


def fitted(figures: FloatArray, gap: FloatArray) -> FloatArray:
    """Weights of (N, 4) figures."""

    def cost(w: FloatArray) -> float:
        return float(np.log1p(np.exp(-(2.0 * gap - 1.0) * (figures @ w))).sum() + SHRINKAGE * (w[1:] ** 2).sum())

    return np.asarray(minimize(cost, np.zeros(figures.shape[1])).x)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("runs", type=Path, nargs="+")
    options.add_argument("--told", type=int, default=20)
    asked = options.parse_args()
    places = [p for run, truth in zip(asked.runs[::2], asked.runs[1::2], strict=True) for p in places_of(run, truth)]
    figures = np.array([figures_of(p.profile) for p in places])
    gap, run = np.array([float(p.width > 0.0) for p in places]), np.array([p.run for p in places])
    held = np.zeros(len(places))
    for r in np.unique(run):
        held[run == r] = 1.0 / (1.0 + np.exp(-figures[run == r] @ fitted(figures[run != r], gap[run != r])))
    print(
        f"{len(places)} places, {int(gap.sum())} gaps; weights {np.round(fitted(figures, gap), 2).tolist()}, in use {WEIGHTS}"
    )
    rows = [
        [p.run, f"{p.width:.2f}" if p.width else "", f"{p.at[0]:.0f}, {p.at[1]:.0f}", f"{p.profile.probability:.2f}", f"{cv:.2f}",
         f"{p.profile.inside:.3f}", f"{p.profile.beside:.3f}", f"{p.profile.step_m:.1f}"]
        for p, cv in sorted(zip(places, held, strict=True), key=lambda row: -row[0].profile.probability)[: asked.told]
    ]  # fmt: skip
    table("Likeliest places", ["run", "true gap m", "place", "probability", "cv", "inside", "beside", "step m"], rows)


if __name__ == "__main__":
    main()
