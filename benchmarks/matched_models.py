"""Evidence for the true units of a synthetic survey from what a run matched: its points, façades, surface and ortho, but not its outlines.

python benchmarks/matched_models.py RUN TRUTH [--cache FOLDER]     # then: reconstruct_town.py --points matched --seeds SEED --size SIZE
"""

from __future__ import annotations

import argparse
import json
import pickle
from pathlib import Path

import laspy
import numpy as np
import rasterio
import shapely
from rasterio.windows import from_bounds
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.points import BUILDING, UNCLASSIFIED, PointCloud, concatenate
from cityflow.core.reconstruction import Evidence, HeightRaster, Picture
from cityflow.handover.array_file import decode_arrays
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_units import Unit
from town_models import CACHE, true_model

AROUND_M, MARGIN_M = 2.0, 4.0


def units_inside(truth: Path) -> tuple[int, int, list[Unit], list[Unit]]:
    """Seed and size of a synthetic survey, its units wholly within the area, and all."""
    p = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    area = shapely.box(*p.area)
    units = make_town(p.seed, p.whole_town).units
    return p.seed, round(p.size[0]), [u for u in units if area.contains(u.wall_outline)], list(units)


def read_cloud(run: Path) -> PointCloud:
    clouds = [laspy.read(path) for path in sorted((run / "products" / "points").glob("*.laz"))]
    return concatenate([PointCloud.of(np.asarray(c.xyz), np.asarray(c.classification)) for c in clouds])


def read_walls(run: Path) -> WallPoints:
    """The newest of each tile."""
    parts = []
    for tile in sorted((run / "work" / "walls").iterdir()):
        newest = max(tile.glob("*/walls.cfa"), key=lambda p: p.stat().st_mtime)
        arrays, _ = decode_arrays(newest.read_bytes())
        parts.append(WallPoints(arrays["xyz"], arrays["normal"], arrays["sigma"], arrays["views"]))
    return joined_walls(parts)


def window(path: Path, bounds: Bounds) -> tuple[Grid, np.ndarray]:
    """(bands, rows, cols) of a raster over bounds, no data as NaN where it is one of floats."""
    with rasterio.open(path) as source:
        x_min, y_min, x_max, y_max = (float(v) for v in source.bounds)
        cut = max(bounds[0], x_min), max(bounds[1], y_min), min(bounds[2], x_max), min(bounds[3], y_max)
        w = from_bounds(*cut, source.transform).round_offsets().round_lengths()
        pixels = source.read(window=w)
        cell = source.res[0]
        grid = Grid(x_min + w.col_off * cell, y_max - w.row_off * cell, cell, *pixels.shape[1:])
        if source.nodata is not None and pixels.dtype.kind == "f":
            pixels = np.where(pixels == source.nodata, np.nan, pixels)
    return grid, pixels


def party_of(unit: Unit, units: list[Unit], tree: shapely.STRtree) -> tuple[LineString, ...]:
    lines: list[LineString] = []
    for k in np.sort(tree.query(unit.wall_outline, predicate="dwithin", distance=1e-6)):
        if units[k].id != unit.id:
            common = shapely.line_merge(shapely.intersection(unit.wall_outline, units[k].wall_outline))
            lines += [p for p in shapely.get_parts(common) if isinstance(p, LineString) and p.length > 0]
    return tuple(lines)


def _floor(dtm: FloatArray) -> float:
    return float(np.floor(np.nanmin(dtm) * 100)) / 100


def make(run: Path, truth: Path, cache: Path) -> None:
    seed, size, units, everything = units_inside(truth)
    cloud, walls = read_cloud(run), read_walls(run)
    houses = cloud.of_class(BUILDING, UNCLASSIFIED)
    tree = shapely.STRtree([u.wall_outline for u in everything])
    folder = cache / f"s{seed}_{size}_matched"
    folder.mkdir(parents=True, exist_ok=True)
    for unit in units:
        outline = unit.wall_outline
        near = grown((*outline.bounds,), AROUND_M)
        part = houses.within(near)
        x, y = part.xyz[:, 0], part.xyz[:, 1]
        roof = part.take(shapely.contains_xy(outline, x, y)).of_class(BUILDING)
        around = part.take(shapely.contains_xy(shapely.buffer(outline, AROUND_M), x, y))
        wide = grown((*outline.bounds,), MARGIN_M)
        grid, dsm = window(run / "products" / "dsm.vrt", wide)
        _, dtm = window(run / "products" / "dtm.vrt", wide)
        ortho_grid, ortho = window(run / "products" / "ortho.vrt", wide)
        evidence = Evidence(
            unit.id, outline, roof, _floor(dtm), (), (), around, walls.within(near),
            HeightRaster(grid, dsm[0].astype(np.float64), dtm[0].astype(np.float64)),
            (Picture(ortho_grid, ortho[:3], True, "ortho"),), party_of(unit, everything, tree),
        )  # fmt: skip
        (folder / f"{unit.id}.pkl").write_bytes(pickle.dumps((evidence, true_model(unit)), protocol=5))
    (folder / "index.json").write_text(json.dumps([(u.id, u.shape) for u in units]))
    print(f"{len(units)} units in {folder}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--cache", type=Path, default=CACHE)
    asked = parser.parse_args()
    make(asked.run, asked.truth, asked.cache)


if __name__ == "__main__":
    main()
