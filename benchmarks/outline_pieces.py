"""Pieces of outlines found in runs over synthetic towns: how far from the true walls do they stand, by what they are known by?

    python benchmarks/outline_pieces.py RUN TRUTH [RUN TRUTH ...] [--no-images]          # TRUTH: what `cityflow synth` made

Outlines are found again, in the surfaces and façades of each run, so that two states of the program can be held against each other without matching. A
piece is a straight edge of at least 1 m that touches no other outline, away from the end of the survey. Its distance is the median of those of places along
it from the nearest true wall: positive outside. Wrongly inside is what stands more than 0.2 m inside the true walls. IoU: of all that was surveyed, its rim
of 1 m left out. Corners: of blocks, touching outlines united, where the boundary turns by more than 20°; a corner is found where one of either kind is
within 0.75 m, each used once; the others are missed, or invented. Gaps: pairs of units of different blocks that stand less than 2.5 m apart, and are found;
parted is a pair in two outlines that do not touch. Cut: true blocks of which two outlines that do not touch have a tenth and 10 m² each. `--no-images`:
gaps are not looked for in images.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from scipy import ndimage
from scipy.optimize import linear_sum_assignment
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.building import Outline
from cityflow.core.grid import Bounds, Grid
from cityflow.evaluation.outlines import corners_of, united_by_adjacency
from cityflow.flow.store import Store
from cityflow.geometry.straight_edges import known_part, wall_edges
from cityflow.handover.wall_point_files import read_walls
from cityflow.io.rasters.surface_dataset import grids_of, read_layers
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.from_heights.regions import cells_polygon
from cityflow.outlines.from_images.photographed import Photographed
from cityflow.outlines.from_walls.wall_lines import WallLineParameters
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.town import Town
from drawn_town import table
from narrow_gaps_images import blocks_cut, owner_of
from texture_world import images_of

SHORTEST_M, STEP_M, RIM_M, END_M, CORNER_M = 1.0, 0.25, 1.0, 2.5, 0.75
OFF_M, INSIDE_M, GAP_M = 0.5, 0.2, 2.5
HEAD = (
    "run", "known by", "pieces", "m", "off m, median", "off > 0.5 m %", "outside > 0.5 m %", "wrongly inside %", "IoU", "missed m²", "beyond m²",
    "corners missed", "corners invented", "corners off m, median and mean", "gaps parted", "cut", "s",
)  # fmt: skip


@dataclass(frozen=True)
class Pieces:
    """(N,) of each piece: whether façades gave it, its length, and how far outside the true wall it stands, metres."""

    by_facade: BoolArray
    length: FloatArray
    off: FloatArray

    def told(self, chosen: BoolArray) -> list[str]:
        off = self.off[chosen]
        shares = (np.abs(off) > OFF_M, off > OFF_M, off < -INSIDE_M)
        percents = [f"{100 * np.mean(s):.1f}" if len(off) else "" for s in shares]
        median = f"{np.median(np.abs(off)):.3f}" if len(off) else ""
        return [f"{len(off)}", f"{self.length[chosen].sum():.0f}", median, *percents]


def seen_in_images(run: Path, truth: Path) -> Photographed:
    """The images of a run over a synthetic survey."""
    group = str(run / "surface.zarr")
    whole = grids_of(group)[0]

    def heights(bounds: Bounds) -> tuple[Grid, Float32Array]:
        grid, layers = read_layers(group, whole, bounds, ["dsm_filled"])
        return grid, layers["dsm_filled"]

    return Photographed(sorted(images_of(truth / "catalog", run), key=lambda c: c.image.name), heights)


def surface_of(run: Path) -> tuple[RegionSurface, FindParameters]:
    """What the stage `outline` of a run has read, of all tiles together, and how finely it was photographed; all else by default."""
    newest = {f.parent.name: f for f in sorted(run.glob("records/outline/*/*.json"))}
    records = [json.loads(f.read_text()) for f in newest.values()]
    walls_found = WallLineParameters.model_validate(records[0]["parameters"]["found"]["walls"])
    paths = sorted({p for r in records for p in r["inputs"] if p.startswith("work/walls/") and (run / p).exists()})
    group = str(run / "surface.zarr" / "overview")
    whole = grids_of(group)
    grid, layers = read_layers(group, whole[0], whole[1].bounds)
    walls = read_walls(Store.open(f"{run}/"), paths, grid.bounds)
    surface = RegionSurface(
        grid, layers["ndsm"], layers["class"], layers["holes"], None, layers["count"], walls, layers["dtm"], highest=False
    )  # fmt: skip
    return surface, FindParameters().model_copy(update={"walls": walls_found, "halo_m": 1000.0})


def pieces_of(outlines: list[Outline], walls: shapely.Geometry, surface: RegionSurface) -> Pieces:
    """Those away from the end of the survey."""
    grid, party, rows = surface.grid, party_edges(outlines), []
    away = ndimage.distance_transform_edt(np.pad(np.isfinite(surface.ndsm), 1))[1:-1, 1:-1] * grid.cell
    for outline in outlines:
        for edge in wall_edges(outline.polygon, party[outline.id]):
            if edge.party or edge.length < SHORTEST_M:
                continue
            count = max(int(np.ceil(edge.length / STEP_M)), 1)
            at = shapely.line_interpolate_point(edge.line, (np.arange(count) + 0.5) / count, normalized=True)
            row, col = grid.indices(*shapely.get_coordinates(at).T)
            judged = away[np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)] > END_M
            if judged.mean() < 0.5:
                continue
            off = shapely.distance(at[judged], walls.boundary) * np.where(
                shapely.contains(walls, at[judged]), -1.0, 1.0
            )
            part = known_part(edge, outline.edges)
            rows.append((part is not None and part.source == "wall", edge.length, float(np.median(off))))
    by_facade, length, off = np.array(rows, np.float64).reshape(-1, 3).T
    return Pieces(by_facade > 0, length, off)


def overlap(outlines: list[Outline], walls: shapely.Geometry, surface: RegionSurface) -> tuple[float, float, float]:
    """IoU of all outlines, what they miss, and what they have beyond, m²."""
    inner = shapely.buffer(cells_polygon(np.isfinite(surface.ndsm), surface.grid), -RIM_M)
    true, found = (shapely.intersection(s, inner) for s in (walls, shapely.union_all([o.polygon for o in outlines])))
    missed, beyond = shapely.difference(true, found).area, shapely.difference(found, true).area
    return shapely.intersection(true, found).area / shapely.union(true, found).area, missed, beyond


def corners_found(outlines: list[Outline], town: Town, surface: RegionSurface) -> list[str]:
    """Corners of blocks away from the end of the survey: missed, invented, and how far the found ones are off."""
    away = ndimage.distance_transform_edt(np.pad(np.isfinite(surface.ndsm), 1))[1:-1, 1:-1] * surface.grid.cell

    def judged(polygons: list[Polygon]) -> FloatArray:
        xy = corners_of(np.array(united_by_adjacency(polygons), dtype=object))
        row, col = surface.grid.indices(*xy.T)
        inside = (row >= 0) & (col >= 0) & (row < surface.grid.rows) & (col < surface.grid.cols)
        inside[inside] = away[row[inside], col[inside]] > END_M
        return xy[inside]

    true, found = judged([u.wall_outline for u in town.units]), judged([o.polygon for o in outlines])
    distance = np.hypot(*(true[:, None] - found[None]).transpose(2, 0, 1))
    t, f = linear_sum_assignment(np.minimum(distance, CORNER_M))
    off = distance[t, f][distance[t, f] < CORNER_M]
    return [
        f"{len(true) - len(off)} of {len(true)}",
        f"{len(found) - len(off)} of {len(found)}",
        f"{np.median(off):.3f}, {np.mean(off):.3f}",
    ]


def gaps_parted(outlines: list[Outline], town: Town) -> str:
    """How many of how many, and the widths of the others in metres."""
    walls = [u.wall_outline for u in town.units]
    block = owner_of(united_by_adjacency(walls), town)
    owner = owner_of(united_by_adjacency([o.polygon for o in outlines]), town)
    first, second = shapely.STRtree(walls).query(walls, predicate="dwithin", distance=GAP_M)
    pairs = [
        (a, b)
        for a, b in zip(first.tolist(), second.tolist(), strict=True)
        if a < b and block[a] != block[b] and min(owner[a], owner[b]) >= 0
    ]
    left = sorted(float(shapely.distance(walls[a], walls[b])) for a, b in pairs if owner[a] == owner[b])
    told = f"{len(pairs) - len(left)} of {len(pairs)}"
    return f"{told}; not {', '.join(f'{w:.2f}' for w in left)}" if left else told


def cut_of(outlines: list[Outline], town: Town) -> int:
    """True blocks that are wrongly parted."""
    true = united_by_adjacency([u.wall_outline for u in town.units])
    return blocks_cut(united_by_adjacency([o.polygon for o in outlines]), true)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("runs", type=Path, nargs="+")
    options.add_argument("--no-images", action="store_true")
    asked = options.parse_args()
    rows, every = [], []
    for run, truth in zip(asked.runs[::2], asked.runs[1::2], strict=True):
        surface, parameters = surface_of(run)
        if not asked.no_images:
            surface = replace(surface, photographed=seen_in_images(run, truth))
        made = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
        town = town_of(made.seed, made.whole_town)
        walls = shapely.union_all([shapely.buffer(u.wall_outline, 0.01) for u in town.units])
        begun = time.process_time()
        outlines = found_walls_in(find_outlines(surface, parameters), seen_in(surface), WallsInParameters())
        seconds = time.process_time() - begun
        found, (iou, missed, beyond) = pieces_of(outlines, walls, surface), overlap(outlines, walls, surface)
        every.append(found)
        rows += _rows(
            str(run),
            found,
            [
                f"{iou:.4f}",
                f"{missed:.1f}",
                f"{beyond:.1f}",
                *corners_found(outlines, town, surface),
                gaps_parted(outlines, town),
                f"{cut_of(outlines, town)}",
                f"{seconds:.1f}",
            ],
        )
    whole = Pieces(*(np.concatenate([getattr(p, f) for p in every]) for f in ("by_facade", "length", "off")))
    table("Pieces of found outlines and true walls", HEAD, [*rows, *_rows("all", whole, [""] * 9)])


def _rows(name: str, found: Pieces, more: list[str]) -> list[list[str]]:
    return [
        [name, "façade", *found.told(found.by_facade), *[""] * 9],
        [name, "rim alone", *found.told(~found.by_facade), *[""] * 9],
        [name, "both", *found.told(found.length > 0), *more],
    ]


if __name__ == "__main__":
    main()
