"""Rasters along an axis strip: its roof from above, and both of its façades."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.splitting import FrameRasters
from cityflow.splitting.scores.medians import middle_of_known
from cityflow.splitting.strips.axis_strips import AxisStrip

FACADE_BAND_M = (1.2, 0.6)
"""Façade points stand at most this far outside of and inside the end of a chord."""
CONTEXT_M = 4.0
"""How far beyond the ends of a strip one looks: the neighbour of its first or last unit may stand round a corner."""
EAVES_CLEAR_M = 0.25
"""What is nearer to the eaves' height may be roof."""
DRAWN_SLOPE_DEG = 50.0
"""Surfaces of an oblique local frame steeper than this in the world are façade."""


@dataclass(frozen=True, slots=True)
class RoofRaster:
    """The nadir rasters resampled into u, v.

    Attributes
    ----------
    u, v : (U,), (V,) centres of the cells, metres
    height : (U, V) float32, world metres; NaN where unknown or outside the chords
    colour : (U, V, C) float32, levels of 0 to 255; NaN where not seen; C = 0 without an ortho
    around : (U, V, C) the same without regard to the chords: ground beside the house too
    inside : (U, V) cells between the ends of the chords and within the outline
    """

    u: FloatArray
    v: FloatArray
    height: Float32Array
    colour: Float32Array
    around: Float32Array
    inside: BoolArray


@dataclass(frozen=True, slots=True)
class FacadeRaster:
    """One façade in one local frame, laid out in u and height.

    Attributes
    ----------
    side : 0 at the lower end of the chords, 1 at the upper
    frame : number among the local frames that it was looked for in
    u, z : (U,), (Z,) centres of the cells, metres; z above the ground
    colour : (U, Z, C) float32, levels of 0 to 255, NaN where not seen
    """

    side: int
    frame: int
    u: FloatArray
    z: FloatArray
    colour: Float32Array


def levels(ortho: NDArray[np.uint8] | NDArray[np.uint16]) -> Float32Array:
    """Of any depth → 0 to 255."""
    scale = 1.0 if ortho.dtype == np.uint8 else 255.0 / max(float(np.percentile(ortho, 99.5)), 1.0)
    return np.asarray(ortho, np.float32) * np.float32(scale)


def roof_raster(strip: AxisStrip, outline: Polygon, nadir: FrameRasters) -> RoofRaster:
    """Roof over a strip, and up to 4 m beyond its ends between the prolonged ends of its chords, within the outline."""
    cell = float(np.clip(nadir.grid.cell, 0.08, 0.5))
    u = np.arange(strip.stations[0] - CONTEXT_M, strip.stations[-1] + CONTEXT_M, cell)
    v = cell * np.arange(np.floor((strip.low.min() - 2.0) / cell), np.ceil((strip.high.max() + 2.0) / cell))
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    xy = strip.to_world(uv.reshape(-1, 2))
    frame = nadir.frame.from_world(np.column_stack([xy, np.zeros(len(xy))]))
    col = ((frame[:, 0] - nadir.grid.x_min) / nadir.grid.cell - 0.5).reshape(uv.shape[:2]).astype(np.float32)
    row = ((nadir.grid.y_max - frame[:, 1]) / nadir.grid.cell - 0.5).reshape(uv.shape[:2]).astype(np.float32)
    nan = float("nan")
    in_frame = cv2.remap(nadir.dsm, col, row, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=(nan,) * 4)
    height = np.asarray(in_frame + nadir.frame.to_world(np.zeros((1, 3)))[0, 2], np.float32)
    k = np.clip(np.searchsorted(strip.stations, u), 0, len(strip.stations) - 1)
    outside = (v[None, :] < strip.low[k][:, None]) | (v[None, :] > strip.high[k][:, None])
    outside |= ~uv_mask(strip, outline, u, v)
    around = _colours(nadir, col, row)
    colour = np.where(outside[..., None], np.float32(nan), around)
    return RoofRaster(u, v, np.where(outside, np.float32(nan), height), colour, around, ~outside)


def uv_mask(strip: AxisStrip, outline: Polygon, u: FloatArray, v: FloatArray) -> BoolArray:
    """(U, V) cells of a regular grid in u, v whose centres lie inside the outline."""
    cell = float(u[1] - u[0])
    mask = np.zeros((len(v), len(u)), np.uint8)
    for ring, value in ((outline.exterior, 1), *((r, 0) for r in outline.interiors)):
        uv = strip.to_uv(shapely.get_coordinates(ring)[:, :2])
        corners = np.column_stack([(uv[:, 0] - u[0]) / cell, (uv[:, 1] - v[0]) / cell])
        cv2.fillPoly(mask, [np.round(corners * 16).astype(np.int32)], value, lineType=cv2.LINE_8, shift=4)
    return np.asarray(mask.T > 0)


def _colours(raster: FrameRasters, col: Float32Array, row: Float32Array) -> Float32Array:
    if raster.ortho is None:
        return np.empty((*col.shape, 0), np.float32)
    bands = [
        cv2.remap(band, col, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(float("nan"),) * 4)
        for band in levels(raster.ortho)
    ]
    result = np.stack(bands, axis=-1).astype(np.float32)
    if raster.seen is not None:
        seen = cv2.remap(raster.seen.astype(np.uint8), col, row, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
        result[seen == 0] = np.nan
    return result


def eaves(strip: AxisStrip, roof: RoofRaster) -> tuple[FloatArray, FloatArray]:
    """(S,) height of the roof just inside the lower and the upper end of each chord, world metres; NaN where unknown."""
    at = np.clip(np.round((strip.stations - roof.u[0]) / (roof.u[1] - roof.u[0])).astype(np.int64), 0, len(roof.u) - 1)
    cell = roof.v[1] - roof.v[0]
    result = []
    for end, inward in ((strip.low, 1.0), (strip.high, -1.0)):
        reach = np.arange(0.15, 0.75, max(cell, 0.1))
        v = end[:, None] + inward * reach[None, :]
        col = np.clip(np.round((v - roof.v[0]) / cell).astype(np.int64), 0, len(roof.v) - 1)
        result.append(middle_of_known(roof.height[at[:, None], col].T).astype(np.float64))
    return result[0], result[1]


@dataclass(frozen=True, slots=True)
class Cells:
    """Every seen cell of a local frame near the outline, in the world: (N, 3) metres and (N, C) colours."""

    xyz: FloatArray
    colour: Float32Array


def facade_cells(obliques: Sequence[FrameRasters]) -> list[Cells]:
    """Of each oblique local frame the cells on steep surfaces that its ortho shows, in the world."""
    result = []
    for raster in obliques:
        if raster.ortho is None or raster.frame.name == "nadir":
            continue
        known = np.isfinite(raster.dsm) if raster.seen is None else np.isfinite(raster.dsm) & raster.seen
        known = known & _upright(raster)
        row, col = np.nonzero(known)
        grid = raster.grid
        x, y = grid.x_min + (col + 0.5) * grid.cell, grid.y_max - (row + 0.5) * grid.cell
        xyz = raster.frame.to_world(np.column_stack([x, y, raster.dsm[row, col]]))
        result.append(Cells(xyz, levels(raster.ortho)[:, row, col].T))
    return result


def _upright(raster: FrameRasters) -> BoolArray:
    """Cells whose smoothed surface is a façade in the world."""
    dsm = cv2.medianBlur(np.nan_to_num(raster.dsm, nan=-1e4).astype(np.float32), 5)
    gx = cv2.Sobel(dsm, cv2.CV_32F, 1, 0, ksize=3) / (8 * raster.grid.cell)
    gy = -cv2.Sobel(dsm, cv2.CV_32F, 0, 1, ksize=3) / (8 * raster.grid.cell)
    normal = np.stack([-gx, -gy, np.ones_like(gx)], axis=-1) / np.sqrt(gx**2 + gy**2 + 1)[..., None]
    up = normal @ raster.frame.frame_from_world[:, 2]
    return np.asarray(np.abs(up) < np.cos(np.radians(DRAWN_SLOPE_DEG)))


def facade_rasters(
    strip: AxisStrip, frames: Sequence[Cells], heights: tuple[FloatArray, FloatArray], ground: float, cell_m: float
) -> list[FacadeRaster]:
    """Both façades of a strip in every local frame that shows them.

    Parameters
    ----------
    heights : as `eaves` gives them
    cell_m : of the rasters, metres
    """
    facades = []
    for number, cells in enumerate(frames):
        uv = strip.to_uv(cells.xyz[:, :2])
        for side in (0, 1):
            facade = _facade_raster(strip, uv, cells, side, number, heights[side], ground, cell_m)
            if facade is not None:
                facades.append(facade)
    return facades


def _facade_raster(
    strip: AxisStrip, uv: FloatArray, cells: Cells, side: int, frame: int, top: FloatArray, ground: float, cell: float
) -> FacadeRaster | None:
    step = float(strip.stations[1] - strip.stations[0])
    reach = int(np.ceil(CONTEXT_M / step))
    k = np.round((uv[:, 0] - strip.stations[0]) / step).astype(np.int64)
    near = (k >= -reach) & (k < len(strip.stations) + reach)
    k = np.clip(k, 0, len(strip.stations) - 1)
    end = strip.low if side == 0 else strip.high
    outwards = (uv[near, 1] - end[k[near]]) * (-1.0 if side == 0 else 1.0)
    z = cells.xyz[near, 2] - ground
    limit = np.where(np.isfinite(top), top, np.nanmax(top) if np.isfinite(top).any() else ground + 40.0) - ground
    band = (outwards < FACADE_BAND_M[0]) & (outwards > -FACADE_BAND_M[1])
    near[near] = band & (z > 0.3) & (z < limit[k[near]] - EAVES_CLEAR_M)
    if int(near.sum()) < 50:
        return None
    u_0 = strip.stations[0] - step / 2 - reach * step
    col = np.floor((uv[near, 0] - u_0) / cell).astype(np.int64)
    row = np.floor((cells.xyz[near, 2] - ground) / cell).astype(np.int64)
    shape = int(col.max()) + 1, int(row.max()) + 1
    shape = max(shape[0], int(np.ceil((len(strip.stations) + 2 * reach) * step / cell))), shape[1]
    flat = col * shape[1] + row
    number = np.bincount(flat, minlength=shape[0] * shape[1])
    with np.errstate(invalid="ignore"):
        bands = [
            np.bincount(flat, cells.colour[near, c], shape[0] * shape[1]) / number for c in range(cells.colour.shape[1])
        ]
    colour = np.stack(bands, axis=-1).reshape(*shape, -1).astype(np.float32)
    u, z = (np.asarray(o + (np.arange(n) + 0.5) * cell, np.float64) for o, n in zip((u_0, 0.0), shape, strict=True))
    return FacadeRaster(side, frame, u, z, colour)
