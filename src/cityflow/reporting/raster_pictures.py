"""Pictures of the rasters of a run, read tile by tile into one small picture each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.building import Status
from cityflow.core.grid import Bounds, Grid
from cityflow.flow.row import Row
from cityflow.flow.store import Store
from cityflow.geometry.hill_shade import hill_shade
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.runs.current import CurrentRecords
from cityflow.stages import frame, ortho, surface
from cityflow.survey.surface_source import FRAMES, IMAGES, OVERVIEW, RASTERS, ZARR
from cityflow.survey.survey import Survey
from cityflow.viewer.mosaic import Mosaic, known_window
from cityflow.viewer.picture import MOST_PIXELS, Picture, picture
from cityflow.viewer.relief import (
    UNKNOWN_CLASS,
    class_colours,
    class_key,
    height_key,
    height_range,
    ortho_pixels,
    painted,
    shaded_heights,
)
from cityflow.viewer.relief_gaps import without_specks

MOST_FRAMES, FRAME_PIXELS = 4, 700
MOST_TILES = 256
"""In a picture of rasters: of a larger city those around its densest spot, since every tile is read."""
RELIEF_PIXELS, LEVEL_GREY = 700, 200.0
"""Longest side of the relief below the map of buildings, about; and its level ground, of 255."""
Layers = dict[str, NDArray[Any]]
Raster = tuple[Grid, Float32Array]
"""Grid, and (bands, rows, cols) values; NaN unknown."""


@dataclass(frozen=True, slots=True)
class Part:
    """Layers of a run that stand on one grid, and the tiles of it that have been made."""

    store: Store
    zarr: str
    grid: Grid
    tiles: tuple[Bounds, ...]

    @property
    def extent(self) -> Grid:
        """The grid over the tiles that have been made."""
        low, high = [min(t[i] for t in self.tiles) for i in (0, 1)], [max(t[i] for t in self.tiles) for i in (2, 3)]
        return Grid.covering((low[0], low[1], high[0], high[1]), self.grid.cell)

    def mosaic(
        self,
        layers: Sequence[str],
        choose: Callable[[Layers], tuple[NDArray[Any], BoolArray]],
        bands: int = 1,
        most: int = MOST_PIXELS,
    ) -> Raster:
        """Means of what `choose` makes of the layers of each tile; one tile is in memory at a time."""
        made = Mosaic(self.extent, most, bands)
        for bounds in self.tiles:
            window, found = read_layers(self.store.zarr_store(self.zarr), self.grid, bounds, layers)
            made.add(window, *choose(found))
        return made.grid, made.mean()


@dataclass(frozen=True, slots=True)
class CityRasters:
    """Heights, colours of classes with the classes found and, of images, the ortho of the tiles that have been made."""

    dsm: Raster
    dtm: Raster
    classes: Raster
    found: tuple[int, ...]
    ortho: Raster | None

    @property
    def background(self) -> Raster:
        """The ortho; where there is none, the surface."""
        return self.dsm if self.ortho is None else self.ortho

    @property
    def known(self) -> Bounds:
        """Around the known cells of the background."""
        grid, values = self.background
        rows, cols = known_window(np.isfinite(values[0]))
        x, y, cell = grid.x_min, grid.y_max, grid.cell
        return x + cols.start * cell, y - rows.stop * cell, x + cols.stop * cell, y - rows.start * cell

    def pictures(self) -> Iterator[Picture]:
        """Surface, true ortho, classes and terrain, as far as they are known."""
        yield from _heights("Surface (DSM)", "Highest surface, small gaps filled; light from the north-west", self.dsm)
        if self.ortho is not None and np.isfinite(self.ortho[1]).any():
            yield _coloured("True ortho", "Colours of the steepest views", self.ortho)
        if np.isfinite(self.classes[1]).any():
            values = self.classes[1]
            pixels = painted(np.moveaxis(values, 0, -1), np.isfinite(values[0]))
            yield _shown("Classes", "What each cell is", self.classes, pixels, class_key(self.found))
        yield from _heights("Terrain (DTM)", "Without buildings and vegetation", self.dtm)

    def relief(self) -> Picture | None:
        """The surface in grey, light from the north-west, with its bounds; None where no height is known."""
        grid, (values,) = self.dsm
        known = np.isfinite(values)
        if not known.any():
            return None
        rows, cols = known_window(known)
        step = -(-max(rows.stop - rows.start, cols.stop - cols.start) // RELIEF_PIXELS)
        grey = painted(np.repeat(LEVEL_GREY * hill_shade(values, grid.cell)[..., None], 3, axis=-1), known)[rows, cols]
        high, wide = (n // step for n in grey.shape[:2])
        part = grey[: high * step, : wide * step].reshape(high, step, wide, step, 3).mean(axis=(1, 3))
        x, y, cell = grid.x_min + cols.start * grid.cell, grid.y_max - rows.start * grid.cell, step * grid.cell
        found = picture("Relief", "", np.rint(part).astype(np.uint8))
        return replace(found, bounds=(x, y - high * cell, x + wide * cell, y))


def city_rasters(
    store: Store, survey: Survey, records: CurrentRecords, spot: FloatArray | None = None
) -> CityRasters | None:
    """None where no tile has a surface yet; of a large city what is around a spot (x, y)."""
    made, coloured = (_around(tiles_made(survey, records.rows(s)), spot) for s in (surface.NAME, ortho.NAME))
    if survey.source.kind == RASTERS and "ortho" in survey.catalog.rasters:
        coloured = made
    if not made:
        return None
    part = _fitting(store, survey, made)
    colours, found = None, set[int]()
    if coloured:
        fine = Part(store, ZARR, survey.lattice.product_grid, coloured)
        colours = fine.mosaic(["ortho", "ortho_seen"], _colours, survey.ortho_kind[0])
    return CityRasters(
        part.mosaic(["dsm_filled"], lambda f: _finite(f["dsm_filled"])),
        part.mosaic(["dtm"], lambda f: _finite(f["dtm"])),
        part.mosaic(["class", "dsm_filled"], partial(_class_colours, found=found), bands=3),
        tuple(sorted(found)),
        colours,
    )


def tiles_made(survey: Survey, rows: Iterable[Row]) -> tuple[Bounds, ...]:
    """Bounds of the ground tiles whose task left a result."""
    good = sorted(r.unit for r in rows if r.status in (Status.DONE, Status.DEGRADED))
    return tuple(survey.lattice.tiles[name].bounds for name in good if name in survey.lattice.tiles)


def _around(tiles: tuple[Bounds, ...], spot: FloatArray | None) -> tuple[Bounds, ...]:
    """The nearest to a spot, or to the middle of all, as many as are shown."""
    if len(tiles) <= MOST_TILES:
        return tiles
    bounds = np.array(tiles)
    middles = (bounds[:, :2] + bounds[:, 2:]) / 2
    away = np.hypot(*(middles - (middles.mean(axis=0) if spot is None else spot)).T)
    return tuple(tiles[k] for k in sorted(np.argsort(away, kind="stable")[:MOST_TILES].tolist()))


def _fitting(store: Store, survey: Survey, made: tuple[Bounds, ...]) -> Part:
    """The coarser copy of a surface from images where it has pixels enough, else the fine one."""
    working = Part(store, survey.source.zarr, survey.lattice.grid, made)
    if survey.source.zarr == OVERVIEW and max(working.extent.shape) < MOST_PIXELS:
        return Part(store, ZARR, survey.lattice.product_grid, made)
    return working


def frame_pictures(store: Store, survey: Survey, records: CurrentRecords) -> Iterator[Picture]:
    """The true oblique orthos of the frames of most images."""
    if survey.source.kind != IMAGES:
        return
    done = {r.unit for r in records.of(frame.NAME) if r.result.get("points")}
    for shown in survey.images.tilted.frames[:MOST_FRAMES]:
        tiles = tuple(
            f.tile.bounds
            for unit, f in survey.images.tilted.tiles.items()
            if unit in done and f.frame.name == shown.name
        )
        if not tiles:
            continue
        part = Part(store, f"{FRAMES}/{shown.name}", survey.images.tilted.grid(shown), tiles)
        raster = part.mosaic(["ortho", "ortho_seen"], _colours, survey.images.bands, FRAME_PIXELS)
        if np.isfinite(raster[1]).any():
            text = f"The city as seen by the {len(shown.images)} images that look there, without perspective"
            yield _coloured(f"True oblique ortho: {shown.name.replace('_', ' ')}°", text, raster)


def _finite(values: NDArray[Any]) -> tuple[NDArray[Any], BoolArray]:
    return values[None], np.isfinite(values)


def _colours(found: Layers) -> tuple[NDArray[Any], BoolArray]:
    return found["ortho"], found["ortho_seen"]


def _class_colours(layers: Layers, found: set[int]) -> tuple[NDArray[Any], BoolArray]:
    """Colours of the classes, which are noted in `found`."""
    known = (layers["class"] != UNKNOWN_CLASS) & np.isfinite(layers["dsm_filled"])
    found.update(np.unique(layers["class"][known]).tolist())
    return class_colours(layers["class"]), known


def _heights(title: str, text: str, raster: Raster) -> Iterator[Picture]:
    grid, (values,) = raster
    if np.isfinite(values).any():
        limits = height_range(values)
        yield _shown(title, text, raster, shaded_heights(values, grid.cell, limits), height_key(limits))


def _coloured(title: str, text: str, raster: Raster) -> Picture:
    """An ortho without specks where no image sees a cell; large gaps stay."""
    grid, values = raster
    whole = without_specks(values)
    gaps = ", small gaps filled from around" if np.isfinite(whole[0]).sum() > np.isfinite(values[0]).sum() else ""
    return _shown(title, text + gaps, (grid, whole), ortho_pixels(whole))


def _shown(
    title: str, text: str, raster: Raster, pixels: ByteArray, key: tuple[tuple[str, tuple[int, int, int]], ...] = ()
) -> Picture:
    """The part of a raster in which something is known."""
    grid, values = raster
    part = pixels[known_window(np.isfinite(values[0]))]
    return picture(
        title,
        f"{text}. {part.shape[1] * grid.cell:,.0f} × {part.shape[0] * grid.cell:,.0f} m, {grid.cell:.2g} m a pixel.",
        part,
        key,
    )
