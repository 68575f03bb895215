"""Reference layers for the evaluation of outlines and units: of the run's GeoPackage and of any vector file, in the run's CRS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.grid import Grid
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError, RunError
from cityflow.io.fetch import local_file
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.io.tables.vector import Layer, read_layer, read_polygons, to_reference
from cityflow.runs.prepare import Prepared

OUTLINES_FILE = "products/outlines.gpkg"
ACCEPTED = "used"
BLOCK_M, HALF = 4.0, 0.5


@dataclass(frozen=True)
class RunLayers:
    """Layers that a run has left of its outlines.

    Attributes
    ----------
    outlines, units : polygons, world metres;  lines : of the cuts that were accepted
    window : what the run covers
    notes : what a reader of figures should know
    """

    outlines: tuple[Polygon, ...]
    units: tuple[Polygon, ...]
    lines: tuple[LineString, ...]
    window: BaseGeometry
    notes: tuple[str, ...]


def run_layers(run: Prepared) -> RunLayers:
    """Read ``products/outlines.gpkg``.

    Raises
    ------
    RunError
        The run has not written it, or has found nothing.
    """
    if not run.store.exists(OUTLINES_FILE):
        raise RunError(f"no {OUTLINES_FILE} here yet", where=run.store.root, remedy="run the workflow to its end first")
    import pyogrio

    with run.store.local_copy(OUTLINES_FILE) as path:
        names = [str(row[0]) for row in pyogrio.list_layers(path)]
        outlines = _polygons(read_layer(path, "outlines")) if "outlines" in names else ()
        units = _polygons(read_layer(path, "units")) if "units" in names else ()
        lines = _accepted(read_layer(path, "cut_lines")) if "cut_lines" in names else ()
    if not outlines and not units:
        raise RunError(
            "the run has no outlines", where=f"{run.store.root}/{OUTLINES_FILE}", remedy="see cityflow status"
        )
    notes = () if "cut_lines" in names else ("the run has no layer cut_lines: nothing was split",)
    return RunLayers(outlines or units, units or outlines, lines, _window(run), notes)


def _polygons(layer: Layer) -> tuple[Polygon, ...]:
    return tuple(p for p in shapely.get_parts(layer.geometry) if isinstance(p, Polygon) and p.area > 0)


def _accepted(layer: Layer) -> tuple[LineString, ...]:
    chosen = layer.columns.get(ACCEPTED) or [True] * len(layer.geometry)
    kept = layer.geometry[np.array([value is None or bool(value) for value in chosen], bool)]
    return tuple(p for p in shapely.get_parts(kept) if isinstance(p, LineString) and p.length > 0)


def _window(run: Prepared) -> BaseGeometry:
    """Where the run has terrain, in blocks of some metres, within the area that it was limited to: what lies beyond was not surveyed."""
    survey = run.source().survey
    store, grid = run.store.zarr_store(survey.source.zarr), survey.lattice.grid
    if not run.store.exists(f"{survey.source.zarr}/zarr.json"):
        return shapely.union_all([shapely.box(*t.bounds) for t in survey.lattice.tiles.values()])
    blocks = [
        b for t in survey.lattice.tiles.values() for b in _known_blocks(*read_layers(store, grid, t.bounds, ("dtm",)))
    ]
    known = shapely.union_all(np.array(blocks, dtype=object)) if blocks else shapely.Polygon()
    return known if run.area.shape is None else shapely.intersection(known, run.area.shape)


def _known_blocks(grid: Grid, layers: Mapping[str, np.ndarray]) -> Iterator[Polygon]:
    """Blocks of cells of which more than half are known, those side by side as one."""
    n = max(1, round(BLOCK_M / grid.cell))
    for row in range(0, grid.rows, n):
        known = [
            np.isfinite(layers["dtm"][row : row + n, col : col + n]).mean() > HALF for col in range(0, grid.cols, n)
        ]
        edges = np.flatnonzero(np.diff([False, *known, False]))
        top, bottom = grid.y_max - row * grid.cell, grid.y_max - min(row + n, grid.rows) * grid.cell
        for start, end in edges.reshape(-1, 2).tolist():
            left, right = (grid.x_min + min(k * n, grid.cols) * grid.cell for k in (start, end))
            yield shapely.box(left, bottom, right, top)


@dataclass(frozen=True)
class ReferenceFile:
    """A vector file of what is true.

    Attributes
    ----------
    path : local or remote;  layer : the one that the user names, or empty
    target : CRS of the run
    """

    path: str
    layer: str
    target: Reference

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Layers with geometries."""
        import pyogrio

        with local_file(self.path) as path:
            return tuple(str(row[0]) for row in pyogrio.list_layers(path) if row[1] is not None)

    def polygons(self, likely: Sequence[str]) -> tuple[list[Polygon], list[str]]:
        """Valid polygons of the layer named, else of the first of the `likely` ones that is there; and notes.

        Raises
        ------
        CatalogError
            No such layer, no polygon in it, or coordinates that cannot be those of its CRS.
        """
        chosen = self.layer or next((name for name in likely if name in self.names), "")
        found = read_polygons(self.path, self.target, chosen or None)
        valid = shapely.get_parts(shapely.make_valid(np.array(found, dtype=object)))
        mended = int((~shapely.is_valid(np.array(found, dtype=object))).sum())
        notes = [f"{Path(self.path).name}, layer {chosen}"] if chosen and not self.layer else []
        notes += [f"{mended} invalid polygons of the reference were mended"] if mended else []
        return [p for p in valid if isinstance(p, Polygon) and p.area > 0], notes

    def lines(self, layer: str) -> list[tuple[LineString, dict[str, Any]]]:
        """Lines with their attributes; empty where the file has no such layer."""
        if layer not in self.names:
            return []
        source = read_layer(self.path, layer)
        geometry = to_reference(source, self.target)[0]
        return [
            (line, {name: values[k] for name, values in source.columns.items()})
            for k, line in enumerate(geometry)
            if isinstance(line, LineString) and line.length > 0
        ]


def within(shapes: Sequence[Polygon], window: BaseGeometry, reference: ReferenceFile) -> list[Polygon]:
    """What of the reference reaches into the run's area, whole: a building that the survey's edge cuts is found as far as it was surveyed.

    Raises
    ------
    CatalogError
        Nothing does.
    """
    every = np.array(list(shapes), dtype=object)
    kept = every[shapely.area(shapely.intersection(every, window)) > 0] if len(every) else every
    if not len(kept):
        extent = "nothing" if not len(every) else _extent(shapely.total_bounds(every))
        raise CatalogError(
            f"no polygon of the reference stands in the run's area: it holds {extent}, the run {_extent(window.bounds)}",
            where=reference.path, remedy="check its CRS, its layer and the run's area",
        )  # fmt: skip
    return list(kept)


def _extent(b: Any) -> str:
    return f"{b[0]:.0f} … {b[2]:.0f}, {b[1]:.0f} … {b[3]:.0f}"
