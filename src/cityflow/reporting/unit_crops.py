"""Crops around single buildings: heights, ortho and photographs, with the outline drawn over them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, Grid, bounds_meet, grown
from cityflow.errors import CityflowError
from cityflow.flow.store import Store
from cityflow.handover.cached_reads import open_pixels
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.survey.surface_source import IMAGES, RASTERS, ZARR
from cityflow.survey.survey import Survey
from cityflow.viewer.picture import Picture, picture
from cityflow.viewer.plan_view import Strokes, draw_plan
from cityflow.viewer.relief import height_range, ortho_pixels, shaded_heights
from cityflow.viewer.report_rows import UnitRow

MARGIN_M, CROP_PX, THUMB_PX, MOST_CELLS = 8.0, 420, 168, 1200
OUTLINE = (255, 226, 60)
VIEWS, VIEW_PX, VIEW_MARGIN = 3, 420, 0.25
DIRECTIONS = ("north", "east", "south", "west")
FLAT_DEG = 20.0
"""Photographs that look down steeper than this show roofs, flatter ones façades, too."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Pixels to draw on, and where they stand."""

    title: str
    grid: Grid
    pixels: ByteArray


@dataclass
class Crops:
    """Cuts crops out of the layers of a run; `tiles` are those whose surface has been made."""

    store: Store
    survey: Survey
    tiles: tuple[Bounds, ...]
    most_px: int = CROP_PX
    _last: tuple[str, list[Ground]] | None = field(default=None, init=False)

    def grounds(self, unit: UnitRow) -> list[Ground]:
        """Heights, and colours where there are some; nothing where the surface under the unit has not been made."""
        if self._last is None or self._last[0] != unit.id:
            self._last = unit.id, self._read(unit)
        return self._last[1]

    def _read(self, unit: UnitRow) -> list[Ground]:
        if not unit.rings or not any(len(r) for r in unit.rings):
            return []
        x, y = unit.rings[0].min(axis=0), unit.rings[0].max(axis=0)
        bounds = grown((float(x[0]), float(x[1]), float(y[0]), float(y[1])), MARGIN_M)
        whole = self.survey.lattice.product_grid
        large = max(bounds[2] - bounds[0], bounds[3] - bounds[1]) > MOST_CELLS * whole.cell
        if large or not any(bounds_meet(t, bounds) for t in self.tiles):
            return []
        coloured = self.survey.reads_own_orthos or (
            self.survey.source.kind == RASTERS and "ortho" in self.survey.catalog.rasters
        )
        names = ("dsm", *(("ortho", "ortho_seen") if coloured else ()))
        grid, found = read_layers(self.store.zarr_store(ZARR), whole, bounds, names)
        return [*self._heights(grid, found["dsm"]), *(self._colours(grid, found) if coloured else ())]

    def _heights(self, grid: Grid, dsm: Float32Array) -> Iterator[Ground]:
        if np.isfinite(dsm).any():
            yield self._fitted("Heights", grid, shaded_heights(dsm, grid.cell, height_range(dsm)))

    def _colours(self, grid: Grid, found: dict[str, Any]) -> Iterator[Ground]:
        if found["ortho_seen"].any():
            yield self._fitted("True ortho", grid, ortho_pixels(np.where(found["ortho_seen"], found["ortho"], np.nan)))

    def _fitted(self, title: str, grid: Grid, pixels: ByteArray) -> Ground:
        """Larger or smaller by a whole factor, to about `most_px`."""
        longest = max(grid.shape)
        if longest > self.most_px:
            step = -(-longest // self.most_px)
            pixels = pixels[::step, ::step]
            return Ground(title, Grid(grid.x_min, grid.y_max, grid.cell * step, *pixels.shape[:2]), pixels)
        times = max(self.most_px // longest, 1)
        larger = np.repeat(np.repeat(pixels, times, axis=0), times, axis=1)
        return Ground(title, Grid(grid.x_min, grid.y_max, grid.cell / times, *larger.shape[:2]), larger)


def outlined(ground: Ground, unit: UnitRow, width: float = 2.0) -> ByteArray:
    """A ground with the unit's outline over it."""
    lines = [shapely.linearrings(r[:, :2]) for r in unit.rings if len(r) > 3]
    return draw_plan(ground.pixels, ground.grid, [Strokes("outline", OUTLINE, width, lines)])


def crop_pictures(crops: Crops, unit: UnitRow) -> Iterator[Picture]:
    """Heights and ortho of a unit, with its outline."""
    for ground in crops.grounds(unit):
        size = ground.grid.cols * ground.grid.cell, ground.grid.rows * ground.grid.cell
        text = f"{size[0]:.0f} × {size[1]:.0f} m around the outline, north is up."
        yield picture(ground.title, text, outlined(ground, unit), (("outline", OUTLINE),))


def thumbnail(crops: Crops, unit: UnitRow) -> Picture | None:
    """The last, most telling ground of a unit: its ortho, else its heights."""
    grounds = crops.grounds(unit)
    return picture(grounds[-1].title, "", outlined(grounds[-1], unit, 1.0)) if grounds else None


def photographs(store: Store, survey: Survey, unit: UnitRow, heights: tuple[float, float]) -> Iterator[Picture]:
    """Parts of the photographs that show a unit best, each from another side; the outline at the height of floor and ridge."""
    if survey.source.kind != IMAGES or not unit.rings:
        return
    polygon = Polygon(unit.rings[0])
    ring = shapely.get_coordinates(shapely.segmentize(polygon.exterior, 2.0))
    solid = np.concatenate([np.column_stack([ring, np.full(len(ring), z)]) for z in heights])
    names = survey.images.showing(polygon.bounds, heights, 60)
    for side, (name, image, uv) in sorted(_best_by_side(survey, names, solid).items())[:VIEWS]:
        path = survey.results.tiled_image(name)
        if path is None:
            continue
        try:
            pixels = _cut_out(store, path, image, uv)
        except (CityflowError, OSError):
            continue
        yield picture(f"Photograph {name}", f"{side}; the outline at the height of floor and ridge.", pixels)


def _best_by_side(
    survey: Survey, names: list[str], solid: FloatArray
) -> dict[str, tuple[str, OrientedImage, FloatArray]]:
    """Side → the image that has the unit nearest to its middle, with the unit's image coordinates; images that cut it off are left out."""
    best: dict[str, tuple[float, str, OrientedImage, FloatArray]] = {}
    for name in names:
        image = survey.images.views[name].image
        uv, depth = image.project(solid)
        if not (depth > 0).all() or not image.holds(uv).all():
            continue
        off = float(np.linalg.norm(uv.mean(axis=0) - [image.camera.width / 2, image.camera.height / 2]))
        side = _side(image)
        if side not in best or (off, name) < best[side][:2]:
            best[side] = off, name, image, uv
    return {side: found[1:] for side, found in best.items()}


def _side(image: OrientedImage) -> str:
    if np.degrees(image.tilt) < FLAT_DEG:
        return "From above"
    towards = np.degrees(np.arctan2(image.axis[0], image.axis[1])) + 180.0
    return f"From the {DIRECTIONS[round(towards / 90.0) % 4]}"


def _cut_out(store: Store, path: str, image: OrientedImage, uv: FloatArray) -> ByteArray:
    """The pixels around (N, 2) image coordinates, of about `VIEW_PX`, with the two rings drawn."""
    low, high = uv.min(axis=0), uv.max(axis=0)
    margin = VIEW_MARGIN * float((high - low).max()) + 8
    low = np.clip(np.floor(low - margin), 0, [image.camera.width - 1, image.camera.height - 1]).astype(int)
    high = np.clip(np.ceil(high + margin), low + 1, [image.camera.width, image.camera.height]).astype(int)
    level = max(int(np.floor(np.log2(max((high - low).max() / VIEW_PX, 1.0)))), 0)
    step = 1 << level
    (c_0, r_0), (c_1, r_1) = low // step, -(-high // step)
    source = open_pixels(store, path)
    window = source.window((int(r_0), min(int(r_1), -(-source.height // step))), (int(c_0), min(int(c_1), -(-source.width // step))), level)  # fmt: skip
    pixels = ortho_pixels(np.moveaxis(np.asarray(window, np.float32), -1, 0))
    grid = Grid(float(c_0), -float(r_0), 1.0, *pixels.shape[:2])
    rings = [shapely.linestrings(half / step * [1.0, -1.0]) for half in np.split(uv, 2)]
    return draw_plan(pixels, grid, [Strokes("outline", OUTLINE, 1.5, rings)])
