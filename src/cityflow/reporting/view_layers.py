"""The layers of the page that shows a run: points, surface, outlines without a model; cut lines: `view_cuts`."""

from __future__ import annotations

import io
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.building import Status
from cityflow.core.grid import Bounds, Grid, Tile, tile_at
from cityflow.core.points import NOISE
from cityflow.errors import CatalogError, RunError
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.io.points.las_header import opened
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.reporting.view_frame import PageFrame
from cityflow.runs.current import CurrentRecords
from cityflow.stages import ingest, surface
from cityflow.survey.survey import Survey
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.view_arrays import Relief, encode_points, thinned

Json = Any
MOST_POINTS_OF_TILE = 300_000
MOST_POINTS = 12_000_000
"""Of the whole city: 190 MB. In a larger city every tile has fewer of them."""
MOST_RELIEF_CELLS = 200
"""Along the edge of a tile."""
MOST_CELLS = 8_000_000
"""Of the whole city. In a larger one every tile has fewer of them."""
POINTS_VERSION, RELIEF_VERSION = 3, 1
FAILED_HEIGHT_M = 6.0


@dataclass(frozen=True, slots=True)
class TileSource:
    """What a layer of a ground tile is made from: files in RUN, and a digest that changes with them."""

    tile: str
    paths: tuple[str, ...]
    digest: str


def point_sources(survey: Survey, records: CurrentRecords) -> list[TileSource]:
    """Points of every ground tile: those from images with their classes, else the survey's own, by the cells of their index."""
    found: dict[str, dict[str, str]] = defaultdict(dict)
    for record in records.of(surface.NAME):
        found[record.unit] |= {p: d for p, d in record.outputs.items() if p.startswith("products/points/")}
    if not any(found.values()):
        for record in records.of(ingest.NAME):
            for path, digest in record.outputs.items():
                tile = _tile_of_piece(path, survey)
                if tile in survey.lattice.tiles:
                    found[tile][path] = digest
    most = _most_points(len(found))
    return [
        TileSource(t, tuple(sorted(files)), digest_of([POINTS_VERSION, most, dict(files)]))
        for t, files in sorted(found.items()) if files
    ]  # fmt: skip


def _tile_of_piece(path: str, survey: Survey) -> str:
    """The ground tile that holds the middle of a cell of the index; empty for any other file."""
    stem = path.rsplit("/", 1)[-1].removesuffix(".laz")
    col, _, row = stem.partition("_")
    if not path.endswith(".laz") or not all(part.lstrip("-").isdigit() for part in (col, row)):
        return ""
    x_min, y_min, x_max, y_max = Tile(int(col), int(row), survey.parameters.tiles.index_cell_m).bounds
    return tile_at((x_min + x_max) / 2, (y_min + y_max) / 2, survey.parameters.tiles.tile_m).name


def _most_points(tiles: int) -> int:
    return min(MOST_POINTS_OF_TILE, MOST_POINTS // max(tiles, 1))


def points_of(store: Store, source: TileSource, tiles: int, frame: PageFrame) -> tuple[bytes | None, Json]:
    """A tile's points as the page reads them, without noise, thinned out where they are many, and what is said of them.

    A tile whose files somebody has damaged or removed since has none: the page does without them.
    """
    try:
        clouds = [_cloud(data, path) for path, data in store.read_many(source.paths)]
    except (OSError, CatalogError):
        return None, {"count": 0, "of": 0, "noise": 0}
    classes = np.concatenate([c[2] for c in clouds])
    kept = ~np.isin(classes, NOISE)
    classes, xyz = classes[kept], np.concatenate([c[0] for c in clouds])[kept]
    colours = [c[1] for c in clouds if c[1] is not None]
    chosen = thinned(len(xyz), _most_points(tiles))
    coloured = np.concatenate(colours)[kept][chosen] if len(colours) == len(clouds) else None
    local = frame.local(xyz[chosen])
    data, entry = encode_points(local, coloured, classes[chosen])
    box = [*local[:, :2].min(axis=0), *local[:, :2].max(axis=0)] if len(local) else [0.0] * 4
    return data, {**entry, "of": len(xyz), "noise": int((~kept).sum()), "box": [round(float(v), 2) for v in box]}


def _cloud(data: bytes, name: str) -> tuple[FloatArray, ByteArray | None, ByteArray]:
    """Places, colours where there are some, and classes of a file's points."""
    with opened(io.BytesIO(data), name) as reader:
        points = reader.read()
    xyz = np.column_stack([points.x, points.y, points.z]).astype(np.float64)
    names = set(points.point_format.dimension_names)
    rgb = None
    if {"red", "green", "blue"} <= names:
        wide = np.column_stack([points.red, points.green, points.blue]).astype(np.uint16)
        rgb = (wide >> 8).astype(np.uint8)
    return xyz, rgb, np.asarray(points.classification, np.uint8)


def relief_sources(records: CurrentRecords) -> list[TileSource]:
    """The surface of every ground tile that has one."""
    good = [r for r in records.of(surface.NAME) if r.status in (Status.DONE, Status.DEGRADED)]
    most = most_relief_cells(len(good))
    return [TileSource(r.unit, (), digest_of([RELIEF_VERSION, most, r.result.get("digest", r.digest)])) for r in good]


def most_relief_cells(tiles: int) -> int:
    """Along the edge of a tile, of so many tiles.

    >>> most_relief_cells(10), most_relief_cells(2000)
    (200, 63)
    """
    return min(MOST_RELIEF_CELLS, math.isqrt(MOST_CELLS // max(tiles, 1)))


def surface_over(store: Store, survey: Survey, bounds: Bounds) -> tuple[Grid, FloatArray] | None:
    """Heights of the surface without holes, (rows, cols) world metres, NaN where nothing is known; None where there is no surface."""
    try:
        grid, layers = read_layers(store.zarr_store(survey.source.zarr), survey.lattice.grid, bounds, ("dsm_filled",))
    except (OSError, RunError):
        return None
    return grid, np.asarray(layers["dsm_filled"], np.float64)


def relief_of(store: Store, survey: Survey, tile: str, most: int, frame: PageFrame) -> Relief | None:
    """A tile's surface on at most `most` cells along its edge, and one row and column of its neighbours, so that tiles meet; None where nothing is known."""
    x_min, y_min, x_max, y_max = survey.lattice.tiles[tile].bounds
    step = max(1, -(-round((x_max - x_min) / survey.lattice.cell_m) // most))
    reach = step * survey.lattice.cell_m
    bounds: Bounds = (x_min, y_min - reach, x_max + reach, y_max)
    grid, layers = read_layers(store.zarr_store(survey.source.zarr), survey.lattice.grid, bounds, ("dsm_filled",))
    heights = np.asarray(layers["dsm_filled"], np.float64)[::step, ::step]
    if not np.isfinite(heights).any():
        return None
    return _relief(heights, grid, step, frame)


def _relief(heights: FloatArray, grid: Grid, step: int, frame: PageFrame) -> Relief:
    x, y = grid.x_centres()[::step], grid.y_centres()[::step]
    xx, yy = np.meshgrid(x, y)
    known = np.isfinite(heights)
    up = np.full(heights.shape, np.nan)
    up[known] = frame.local(np.column_stack([xx[known], yy[known], heights[known]]))[:, 2]
    middle = float(np.nanmedian(heights))
    corner, across, below = (
        frame.plan(np.array(p), middle)[0, :2] for p in ((x[0], y[0]), (x[-1], y[0]), (x[0], y[-1]))
    )
    right, down = (across - corner) / max(len(x) - 1, 1), (below - corner) / max(len(y) - 1, 1)
    as_pair = [(float(v[0]), float(v[1])) for v in (corner, right, down)]
    return Relief(up.astype("<f4"), *as_pair)


def failures(rows: Sequence[UnitRow], ground: float, frame: PageFrame) -> list[dict[str, Json]]:
    """Shapes of the outlines that have no model of their own."""
    found = []
    for unit in rows:
        if unit.status in (Status.FAILED, Status.REFUSED) and unit.rings:
            rings = [frame.plan(ring[:-1], ground) for ring in unit.rings if len(ring) > 3]
            if rings:
                base = float(rings[0][:, 2].mean())
                found.append({
                    "id": unit.id, "status": str(unit.status), "reason": unit.reason, "base": round(base, 2), "height": FAILED_HEIGHT_M,
                    "rings": [np.round(r[:, :2], 2).tolist() for r in rings],
                })  # fmt: skip
    return found
