"""Several parts of a city as one that is seen from farther away: fewer blocks, the others painted on the ground, the same numbers of triangles and pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from affine import Affine
from rasterio.features import rasterize

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.coarse import Blocks, Coarse, Picture
from cityflow.core.grid import Bounds
from cityflow.geometry.coarse_ground import coarse_ground, heights_at
from cityflow.io.city_models.coarse_scene import PARTS, PICTURE_PX, PLAN_SHARE, reached, simpler

MOST_BLOCKS = 2000
"""Of one content, the highest; set by hand: 30,000 triangles."""
LOWEST_SHARE = 1 / 2
"""Of the error: lower blocks are painted alone."""
PLAIN = np.array([159, 167, 139], np.uint8)
"""Of ground without an ortho: what `cityflow view` shows of level ground under its light, so that no seam is seen there; set by hand."""
_FINER = 2
"""Pictures are put together at so many times the resolution, and then averaged."""


def for_above(coarse: Coarse) -> Coarse:
    """What a merge above needs of a part: blocks that are low for its error are on the picture alone, and so are those beyond the most."""
    left, highest = _flattened(coarse, LOWEST_SHARE * coarse.error)
    return replace(left, error=max(coarse.error, highest))


def _flattened(coarse: Coarse, least: float) -> tuple[Coarse, float]:
    """All roofs painted, and the highest blocks that are not lower than `least`, metres; and the height of the highest that is left out."""
    height = coarse.blocks.heights[:, 1] - coarse.blocks.heights[:, 0]
    kept = _highest(height, least)
    picture = np.broadcast_to(PLAIN, (PICTURE_PX, PICTURE_PX, 3)) if coarse.picture is None else coarse.picture
    left = np.delete(height, kept)
    found = replace(coarse, picture=_painted(picture, coarse), blocks=coarse.blocks.some(kept))
    return found, round(float(left.max()), 2) if len(left) else 0.0


def _highest(height: FloatArray, least: float) -> IntArray:
    """Numbers of the highest blocks, in their order."""
    order = np.lexsort((np.arange(len(height)), -height))[:MOST_BLOCKS]
    return np.sort(order[height[order] >= least])


def merged(parts: Sequence[Coarse]) -> Coarse:
    """Parts that `for_above` has left, as one."""
    x_0, y_0, x_1, y_1 = zip(*(part.bounds for part in parts), strict=True)
    bounds = min(x_0), min(y_0), max(x_1), max(y_1)
    vertices, triangles = _terrain(parts)
    ground = coarse_ground(vertices, triangles, bounds)
    unlike = np.abs(heights_at(*ground, vertices[:, :2]) - vertices[:, 2])
    longest = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    error = max(longest / PARTS, reached(unlike[np.isfinite(unlike)]), *(part.error for part in parts))
    lowered = [_flattened(part, LOWEST_SHARE * error)[0] for part in parts]
    blocks = Blocks.joined([part.blocks for part in lowered])
    height = blocks.heights[:, 1] - blocks.heights[:, 0]
    kept = _highest(height, 0.0)
    left = np.delete(height, kept)
    error = max(error, float(left.max()) if len(left) else 0.0)
    some = blocks.some(kept)
    plans = tuple(simpler(plan, PLAN_SHARE * error, error**2) for plan in some.plans)
    picture = _mosaic(lowered, bounds)
    return Coarse(bounds, *ground, picture, bounds, replace(some, plans=plans), round(float(error) + 0.005, 2))


def _terrain(parts: Sequence[Coarse]) -> tuple[FloatArray, IntArray]:
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])[:-1]
    triangles = [part.triangles + n for part, n in zip(parts, first, strict=True)]
    return np.concatenate([part.vertices for part in parts]), np.concatenate(triangles)


def _painted(picture: Picture, coarse: Coarse) -> Picture:
    """The picture with the roofs of all blocks, where their middles cover those of pixels."""
    if not len(coarse.blocks):
        return np.array(picture, np.uint8)
    rows, cols = picture.shape[:2]
    x_0, y_0, x_1, y_1 = coarse.extent
    place = Affine((x_1 - x_0) / cols, 0, x_0, 0, (y_0 - y_1) / rows, y_1)
    shapes = [(plan, number) for number, plan in enumerate(coarse.blocks.plans, 1)]
    number = rasterize(shapes, out_shape=(rows, cols), transform=place, dtype="int32")
    found = np.array(picture, np.uint8)
    found[number > 0] = coarse.blocks.colours[number[number > 0] - 1, 0]
    return found


def _mosaic(parts: Sequence[Coarse], bounds: Bounds) -> Picture:
    """Pictures of the parts in one over `bounds`; the mean of all where there is none."""
    x_0, y_0, x_1, y_1 = bounds
    pixel = max(x_1 - x_0, y_1 - y_0) / PICTURE_PX
    cols, rows = (max(round(length / pixel), 1) for length in (x_1 - x_0, y_1 - y_0))
    x = x_0 + (np.arange(_FINER * cols) + 0.5) * (x_1 - x_0) / (_FINER * cols)
    y = y_1 - (np.arange(_FINER * rows) + 0.5) * (y_1 - y_0) / (_FINER * rows)
    whole = np.zeros((len(y), len(x), 3), np.uint8)
    known = np.zeros(whole.shape[:2], bool)
    for part in parts:
        west, south, east, north = part.bounds
        across, down = np.flatnonzero((x >= west) & (x < east)), np.flatnonzero((y >= south) & (y < north))
        whole[np.ix_(down, across)] = _sampled(part, x[across], y[down])
        known[np.ix_(down, across)] = True
    if not known.all() and known.any():
        whole[~known] = np.rint(whole[known].mean(axis=0)).astype(np.uint8)
    return np.asarray(cv2.resize(whole, (cols, rows), interpolation=cv2.INTER_AREA), np.uint8)


def _sampled(part: Coarse, x: FloatArray, y: FloatArray) -> Picture:
    """(len(y), len(x), 3) colours of a part's picture at world x and y."""
    assert part.picture is not None
    rows, cols = part.picture.shape[:2]
    x_0, y_0, x_1, y_1 = part.extent
    col = np.clip(((x - x_0) / (x_1 - x_0) * cols).astype(np.int64), 0, cols - 1)
    row = np.clip(((y_1 - y) / (y_1 - y_0) * rows).astype(np.int64), 0, rows - 1)
    return np.asarray(part.picture[np.ix_(row, col)])
