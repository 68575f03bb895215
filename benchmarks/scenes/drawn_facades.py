"""Rectified façades drawn straight from a made layout, with the errors of images, and where their windows are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.synthetic.town_facades import DOOR, WINDOW
from scenes.facade_errors import (
    FINE_M,
    ImageErrors,
    crowns_before,
    hidden_rows,
    leaf_colours,
    photographed,
    shadow_on,
    smooth_noise,
)

STYLES = ("plain", "frames", "muntins", "shutters", "blinds", "double", "bright frames")
WallStyle = Literal["plain", "frames", "muntins", "shutters", "blinds", "double", "bright frames", "blank", "glass"]


@dataclass(frozen=True, slots=True, eq=False)
class DrawnFacade:
    """A façade as its rectified texture shows it.

    Attributes
    ----------
    pixels : (rows, cols, 3) uint8;  seen : (rows, cols) bool, false where interpolated
    cell_m : size of its cells
    size_m : width and height of the wall; the picture's upper left corner is the wall's
    openings : (W, 5) left, right, bottom, top in metres from the lower left corner, `WINDOW` or `DOOR`
    visible : (W,) share of each that neither a tree nor an interpolated part hides
    storeys : rows of windows
    """

    pixels: NDArray[np.uint8]
    seen: BoolArray
    cell_m: float
    size_m: tuple[float, float]
    openings: FloatArray
    visible: FloatArray
    storeys: int


def draw_facade(style: WallStyle, errors: ImageErrors, rng: np.random.Generator) -> DrawnFacade:
    """One façade with windows of one style; ``blank`` has none, ``glass`` is panes from end to end."""
    layout = layout_of(style, rng)
    return pictured_facade(layout, _painted(layout, style, rng), errors, rng)


def pictured_facade(layout: Layout, fine: Float32Array, errors: ImageErrors, rng: np.random.Generator) -> DrawnFacade:
    """What a picture shows of a painted façade, (rows, cols, 3) on cells of `FINE_M`, 0 to 255."""
    crowns = crowns_before((int(fine.shape[0]), int(fine.shape[1])), errors.trees, rng)
    if errors.shadow:
        fine = np.asarray(fine * shadow_on(crowns.shape, rng)[..., None], np.float32)
    fine = np.where(crowns[..., None], leaf_colours(crowns.shape, rng), fine).astype(np.float32)
    fine, shift = _misplaced(fine, errors, rng)
    pixels = photographed(fine, errors, rng)
    hidden = hidden_rows(fine.shape[0], errors)
    free = ~crowns
    free[hidden] = False
    seen: BoolArray = np.ones((len(pixels), len(pixels[0])), bool)
    seen[hidden_rows(len(pixels), errors, errors.gsd_m)] = False
    pixels[~seen] = pixels[seen].mean(axis=0) if seen.any() else 128
    visible = np.array([window_part(free, layout.size_m[1], o).mean() for o in layout.openings])
    visible = visible * layout.whole if layout.whole is not None else visible
    openings = layout.openings.copy()
    for o in openings:
        dx, dy = window_part(shift, layout.size_m[1], o).reshape(-1, 2).mean(axis=0)
        o[:4] += FINE_M * np.array([dx, dx, -dy, -dy])
    return DrawnFacade(pixels, seen, errors.gsd_m, layout.size_m, openings, visible, layout.storeys)


def _misplaced(fine: Float32Array, errors: ImageErrors, rng: np.random.Generator) -> tuple[Float32Array, Float32Array]:
    """The façade as a rectification with errors shows it, and by how many cells (rows, cols, 2: across, down) everything is moved."""
    rows, cols = fine.shape[:2]
    shift = np.zeros((rows, cols, 2), np.float32)
    if errors.wave_px == 0 and errors.turn_deg == 0:
        return fine, shift
    y, x = np.mgrid[:rows, :cols].astype(np.float32)
    turn = np.radians(errors.turn_deg)
    shift[..., 0], shift[..., 1] = -turn * (y - rows / 2), turn * (x - cols / 2)
    step = errors.wave_px * errors.gsd_m / FINE_M
    for axis in range(2):
        phase, length = rng.uniform(0, 6.28, 2), rng.uniform(6, 15, 2) / FINE_M
        shift[..., axis] += step * np.sin(x * 6.28 / length[0] + phase[0]) * np.sin(y * 6.28 / length[1] + phase[1])
    moved = cv2.remap(
        np.asarray(fine, np.float32), x - shift[..., 0], y - shift[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )  # fmt: skip
    return np.asarray(moved), shift


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Size of a wall, its openings as in `DrawnFacade`, its rows of windows, and, (W,), the share of each opening that nothing built stands before."""

    size_m: tuple[float, float]
    openings: FloatArray
    storeys: int
    whole: FloatArray | None = None


def layout_of(style: WallStyle, rng: np.random.Generator) -> Layout:
    """Rows and columns, a few of them blank, and a door in front of every second façade."""
    storeys, storey = int(rng.integers(1, 6)), rng.uniform(2.6, 3.6)
    columns, pitch = int(rng.integers(1, 8)), rng.uniform(1.7, 3.4)
    width, height = rng.uniform(0.6, 1.9), rng.uniform(0.7, 2.0)
    width = min(width, pitch / 2 - 0.2 if style == "shutters" else pitch - 0.5)
    if style == "double":
        width = min(rng.uniform(1.4, 1.9), pitch - 0.5)
    margin, sill = rng.uniform(0.5, 1.2), rng.uniform(0.8, 1.1)
    size = (round(columns * pitch + 2 * margin, 2), round(storeys * storey + rng.uniform(0.3, 1.2), 2))
    if style in ("blank", "glass"):
        return Layout(size, np.empty((0, 5)), 0)
    centres = margin + (np.arange(columns) + 0.5) * pitch
    rows = [
        [c - width / 2, c + width / 2, k * storey + sill, k * storey + sill + height, WINDOW]
        for k in range(storeys) for c in centres if rng.random() > 0.06 or columns * storeys < 4
    ]  # fmt: skip
    if rng.random() < 0.5:
        c = float(centres[rng.integers(columns)])
        rows = [r for r in rows if abs((r[0] + r[1]) / 2 - c) > 0.01 or r[2] > 2.4]
        rows.append([c - 0.5, c + 0.5, 0.05, 2.15, DOOR])
    openings = np.array(rows).reshape(-1, 5)
    windows = openings[openings[:, 4] == WINDOW]
    return Layout(size, openings, len(np.unique(np.rint((windows[:, 2] - sill) / storey))))


def window_part(raster: NDArray[Any], height_m: float, opening: FloatArray) -> NDArray[Any]:
    """View of what of a raster on cells of `FINE_M` is in an opening."""
    left, right, bottom, top = opening[:4]
    at = [max(round(v / FINE_M), 0) for v in (height_m - top, height_m - bottom, left, right)]
    return raster[at[0] : at[1], at[2] : at[3]]


def _painted(layout: Layout, style: WallStyle, rng: np.random.Generator) -> Float32Array:
    """(rows, cols, 3) float32 of 0 to 255, the façade as it is."""
    rows, cols = (round(v / FINE_M) for v in layout.size_m[::-1])
    image = wall_surface(rows, cols, style, rng)
    if style == "glass":
        return _glass(image, rng)
    frame, shutter = rng.uniform(200, 245) * np.ones(3), rng.choice([[60, 90, 60], [110, 50, 40], [70, 80, 110]])
    pane = rng.uniform(25, 75) * np.array([0.95, 1.0, 1.08])
    sills = bool(rng.random() < 0.5)
    for o in layout.openings:
        part = window_part(image, layout.size_m[1], o)
        if o[4] == DOOR:
            part[:] = rng.choice([[84, 54, 36], [40, 66, 52], [52, 58, 84], [120, 40, 36]])
            continue
        if style == "shutters":
            _shutters(image, layout.size_m[1], o, np.asarray(shutter, float))
        _fitting(part, style, frame, pane * rng.uniform(0.75, 1.3), rng)
        if sills and style != "blinds":
            ledge = window_part(image, layout.size_m[1], np.array([o[0] - 0.06, o[1] + 0.06, o[2] - 0.09, o[2]]))
            ledge[:] = 0.4 * ledge + 0.6 * 215
    return image


def wall_surface(rows: int, cols: int, style: WallStyle, rng: np.random.Generator) -> Float32Array:
    """Plaster or brick with stains, darker where light things are wanted on it, and a shade under the eaves."""
    brick = rng.random() < 0.45
    dark = style in ("blinds", "bright frames")
    tone = rng.uniform(55, 95) if dark else rng.uniform(120, 235)
    tint = np.array([1.25, 0.9, 0.75]) if brick else 1 + rng.uniform(-0.08, 0.08, 3)
    if brick and not dark:
        tone = rng.uniform(95, 150)
    factor = 1 + rng.uniform(0.01, 0.04) * smooth_noise(rows, cols, 0.6, rng)
    if brick:
        factor *= (
            1 + 0.07 * rng.standard_normal((rows // 4 + 1, cols // 12 + 1)).repeat(4, 0).repeat(12, 1)[:rows, :cols]
        )
    eaves = round(rng.uniform(0, 0.5) / FINE_M)
    factor[:eaves] *= rng.uniform(0.45, 0.8)
    factor *= np.linspace(1 + rng.uniform(-0.1, 0.1), 1, cols)[None, :]
    return np.asarray(factor[..., None] * (tone * tint), np.float32)


def _fitting(
    part: Float32Array, style: WallStyle, frame: FloatArray, pane: FloatArray, rng: np.random.Generator
) -> None:
    """What fills a window: glass with what it mirrors, curtains, frame, bars, or a blind."""
    rows, cols = part.shape[:2]
    if style == "blinds":
        part[:] = rng.uniform(185, 235) * (1 - 0.08 * (np.arange(rows) // 4 % 2))[:, None, None]
        return
    part[:] = pane * np.linspace(rng.uniform(0.9, 1.5), 1.0, rows)[:, None, None]
    if rng.random() < 0.2:
        part[rows // 2 :] += 35
    w = max(round(0.06 / FINE_M), 1)
    if style in ("frames", "muntins", "double", "bright frames"):
        part[:w] = part[-w:] = frame
        part[:, :w] = part[:, -w:] = frame
    if style in ("muntins", "double", "bright frames"):
        middle = cols // 2
        part[:, middle - w // 2 - 1 : middle + w // 2 + 1] = frame
    if style == "muntins":
        row = round(rows * 0.35)
        part[row - 1 : row + 2] = frame


def _shutters(image: Float32Array, height_m: float, o: FloatArray, colour: FloatArray) -> None:
    wide = (o[1] - o[0]) / 2
    for left in (o[0] - wide, o[1]):
        window_part(image, height_m, np.array([left, left + wide, o[2], o[3]]))[:] = colour


def _glass(image: Float32Array, rng: np.random.Generator) -> Float32Array:
    """Panes from end to end, thin bars between, and what they mirror."""
    rows, cols = image.shape[:2]
    sky = 110 + 45 * smooth_noise(rows, cols, 2.0, rng)
    glass = sky[..., None] * np.array([0.85, 0.95, 1.1])
    glass[np.arange(rows) % round(rng.uniform(1.2, 1.8) / FINE_M) < 3] = 70
    glass[:, np.arange(cols) % round(rng.uniform(0.9, 1.5) / FINE_M) < 3] = 70
    return np.asarray(glass, np.float32)
