"""Vegetation in surfaces from images: green (or bright in the near infrared) and rough, since there are no multiple returns.

The window that tells roughness is as wide as a porch: small roofs beside high walls are rough all over, and grey roofs are of a doubtful colour. In the
surface at its full resolution such roofs are even (`even_patches.py`). Crowns that matching has smoothed are even, too, but green. Colours are those of
one level: a lawn makes no roof beside it green.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import binary_dilation, binary_opening, distance_transform_edt, label

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.surface.vegetation import local_residual

NEAR_INFRARED_BANDS = 4
"""Red, green, blue and near infrared."""

WINDOW_M = 1.5
"""Window of residuals and colours, metres: three cells of a working grid; set by hand, as is the next."""
VERY_ROUGH_M = 0.6
"""What has a doubtful colour is foliage from this RMS off the local plane on, metres."""
REACH_M = 0.8
"""Foliage goes on this far into green cells, metres; set by hand, as are the next two."""
ROUGH_M = 0.12
"""What is green is foliage from this RMS off the local plane on, metres."""
AREA_M2 = 2.0
"""Smaller patches are no crowns, m²."""
LEVEL_M = 0.75
"""What differs more in height is another thing, of another colour, metres; set by hand."""


class ColourVegetationParameters(Parameters):
    """What counts as foliage in a surface from images."""

    least_height_m: float = Field(1.5, ge=0, le=20, description="vegetation is at least this high, metres")
    ndvi: float = Field(
        0.2, ge=-1, le=1, description="normalised difference vegetation index of foliage, where there is near infrared"
    )
    excess_green: float = Field(0.06, ge=-1, le=2, description="2g - r - b of foliage, with r + g + b = 1")

    @property
    def halo_m(self) -> float:
        """A patch's area is judged within this distance, metres: beyond, it is large enough."""
        return 25.0


def colour_vegetation(
    heights: tuple[FloatArray, FloatArray],
    colour: NDArray[np.float32] | None,
    grid: Grid,
    parameters: ColourVegetationParameters,
    even: BoolArray | None = None,
) -> BoolArray:
    """(rows, cols) True on vegetation.

    Parameters
    ----------
    heights : filled DSM and DTM, (rows, cols) metres, NaN outside the survey
    colour : (rows, cols, bands) mean colour of the surface: red, green, blue and, with 4 bands, near infrared; NaN where unknown; None where
        the images are grey
    even : (rows, cols) True on patches that are even at full resolution: roofs, unless they are green; None: not known
    """
    p = parameters
    dsm, dtm = heights
    with np.errstate(invalid="ignore"):
        high = dsm - dtm > p.least_height_m
    size = 2 * round(WINDOW_M / grid.cell / 2) + 1
    surface = np.where(np.isnan(dsm), dtm, dsm)
    rough = local_residual(surface, max(size, 3))
    green = greenness(colour, surface, p, size)
    doubtful = high & (green > -1) & _wide(rough > VERY_ROUGH_M, grid)
    if even is not None:
        doubtful &= ~even
    seeds = high & (green > 0) & (rough > ROUGH_M) | doubtful
    kept = _large(binary_opening(seeds, np.ones((2, 2), bool)), grid)
    reach = max(round(REACH_M / grid.cell), 1)
    return np.asarray(binary_dilation(kept, iterations=reach, mask=high & (green > 0) | kept))


def greenness(
    colour: NDArray[np.float32] | None, heights: FloatArray, p: ColourVegetationParameters, size: int
) -> FloatArray:
    """(rows, cols) 1 at twice the threshold of the index, 0 at the threshold, -1 or below for what is clearly not green.

    Both indices are ratios, so exposure does not change them; over the part of a window that has one level they are ratios of sums, for the colours of
    single dark cells are noise. Where the colour is unknown, or grey throughout, -0.5.
    """
    if colour is None:
        return np.full(heights.shape, -0.5)
    c = colour.astype(np.float64)
    if c.shape[-1] >= NEAR_INFRARED_BANDS:
        upper, lower, limit = c[..., 3] - c[..., 0], c[..., 3] + c[..., 0], p.ndvi
    else:
        upper, lower, limit = 2 * c[..., 1] - c[..., 0] - c[..., 2], c[..., :3].sum(axis=-1), p.excess_green
    known = np.isfinite(upper) & (lower > 0)
    above, below = _sums_of_level(np.where(known, upper, 0.0), np.where(known, lower, 0.0), heights, size // 2)
    return np.where(below > 0, (above / np.maximum(below, 1e-9) - limit) / max(abs(limit), 0.02), -0.5)


def _sums_of_level(
    upper: FloatArray, lower: FloatArray, heights: FloatArray, reach: int
) -> tuple[FloatArray, FloatArray]:
    """(rows, cols) sums of two values over the cells of a window, `reach` cells to each side, that are as high as its middle."""
    rows, cols = heights.shape
    wide = [np.pad(v, reach) for v in (upper, lower)]
    level = np.pad(heights, reach, constant_values=np.nan)
    sums = np.zeros((2, rows, cols))
    for i in range(2 * reach + 1):
        for j in range(2 * reach + 1):
            part = slice(i, i + rows), slice(j, j + cols)
            with np.errstate(invalid="ignore"):
                same = np.abs(level[part] - heights) < LEVEL_M
            for total, values in zip(sums, wide, strict=True):
                total += np.where(same, values[part], 0.0)
    return sums[0], sums[1]


def _wide(rough: BoolArray, grid: Grid) -> BoolArray:
    """Rough patches wider than the strip of rough windows along a wall."""
    half = round((WINDOW_M / 2 + 0.9) / grid.cell)
    core = distance_transform_edt(np.pad(rough, 1, mode="edge"))[1:-1, 1:-1] > half
    return np.asarray(binary_dilation(core, iterations=half, mask=rough))


def _large(mask: BoolArray, grid: Grid) -> BoolArray:
    labels, count = label(mask, np.ones((3, 3), bool))
    large = np.bincount(labels.ravel(), minlength=count + 1) * grid.cell**2 >= AREA_M2
    large[0] = False
    return np.asarray(large[labels])
