"""Heights, colours and classes of a raster as pixels: relief shaded from the north-west."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, Float32Array
from cityflow.core.points import (
    BRIDGE,
    BUILDING,
    GROUND,
    HIGH_VEGETATION,
    LOW_VEGETATION,
    MEDIUM_VEGETATION,
    UNCLASSIFIED,
    WATER,
)
from cityflow.geometry.hill_shade import hill_shade

NOTHING = (203, 206, 208)
"""Colour where there is no data; it stands out on a light page and on a dark one."""

HEIGHT_COLOURS = ((78, 116, 118), (132, 162, 126), (206, 200, 150), (197, 143, 100), (170, 96, 84), (238, 228, 222))
"""From low to high."""

CLASS_COLOURS: Mapping[int, tuple[str, tuple[int, int, int]]] = {
    GROUND: ("ground", (202, 190, 166)),
    BUILDING: ("building", (190, 74, 66)),
    HIGH_VEGETATION: ("high vegetation", (72, 128, 76)),
    LOW_VEGETATION: ("low vegetation", (168, 196, 132)),
    MEDIUM_VEGETATION: ("medium vegetation", (118, 164, 104)),
    WATER: ("water", (84, 142, 190)),
    BRIDGE: ("bridge", (142, 112, 160)),
    UNCLASSIFIED: ("other", (150, 150, 150)),
}

UNKNOWN_CLASS = 0
"""Of cells that no task has written."""

LOWEST_SHARE, HIGHEST_SHARE = 0.01, 0.99
"""Heights beyond these quantiles have the colours of the ends: one chimney or one outlier shall not take all colours."""


def height_range(heights: Float32Array) -> tuple[float, float]:
    """Metres that the lowest and the highest colour stand for. Raises ValueError where no height is known."""
    known = heights[np.isfinite(heights)]
    if not known.size:
        raise ValueError("no height is known")
    low, high = (float(np.quantile(known, q)) for q in (LOWEST_SHARE, HIGHEST_SHARE))
    return low, max(high, low + 1.0)


def height_key(limits: tuple[float, float]) -> tuple[tuple[str, tuple[int, int, int]], ...]:
    """Heights with their colours, from low to high.

    >>> [text for text, _ in height_key((0.0, 10.0))]
    ['0 m', '2 m', '4 m', '6 m', '8 m', '10 m']
    """
    metres = np.linspace(*limits, len(HEIGHT_COLOURS)).tolist()
    digits = 0 if limits[1] - limits[0] >= len(HEIGHT_COLOURS) - 1 else 1
    return tuple(
        (f"{round(z, digits) + 0.0:.{digits}f} m".replace("-", "−"), colour)
        for z, colour in zip(metres, HEIGHT_COLOURS, strict=True)
    )


def shaded_heights(heights: Float32Array, cell: float, limits: tuple[float, float]) -> ByteArray:
    """(rows, cols, 3) colours of heights (metres, NaN unknown) between `limits`, shaded; `cell` in metres."""
    low, high = limits
    share = np.clip((np.nan_to_num(heights, nan=low) - low) / (high - low), 0, 1) * (len(HEIGHT_COLOURS) - 1)
    stops = np.arange(len(HEIGHT_COLOURS))
    colour = np.stack([np.interp(share, stops, band) for band in np.array(HEIGHT_COLOURS, float).T], axis=-1)
    return painted(colour * hill_shade(heights, cell)[..., None], np.isfinite(heights))


def class_colours(klass: NDArray[np.uint8]) -> ByteArray:
    """(3, rows, cols) colours of ASPRS classes."""
    table = np.full((256, 3), CLASS_COLOURS[UNCLASSIFIED][1], np.uint8)
    for number, (_, colour) in CLASS_COLOURS.items():
        table[number] = colour
    return np.ascontiguousarray(np.moveaxis(table[klass], -1, 0))


def class_key(found: Iterable[int]) -> tuple[tuple[str, tuple[int, int, int]], ...]:
    """Names and colours of classes, each colour once.

    >>> class_key([2, 40])
    (('ground', (202, 190, 166)), ('other', (150, 150, 150)))
    """
    known = {c if c in CLASS_COLOURS else UNCLASSIFIED for c in found}
    return tuple(entry for number, entry in CLASS_COLOURS.items() if number in known)


def painted(colour: NDArray[np.floating], known: NDArray[np.bool_]) -> ByteArray:
    """(rows, cols, 3) bytes, `NOTHING` where nothing is known."""
    bytes_of = np.clip(np.rint(np.nan_to_num(colour)), 0, 255).astype(np.uint8)
    return np.where(known[..., None], bytes_of, np.array(NOTHING, np.uint8))


def ortho_pixels(ortho: Float32Array) -> ByteArray:
    """(rows, cols, 3) bytes of (bands, rows, cols) means, NaN unknown: what is darker or brighter than most is cut, colours stay as they are.

    One band is shown grey; of more than three the first three are shown.
    """
    known = np.isfinite(ortho[0])
    colour = np.moveaxis(ortho[:3] if len(ortho) >= 3 else np.repeat(ortho[:1], 3, axis=0), 0, -1)
    if not known.any():
        return painted(colour, known)
    low, high = (float(np.quantile(colour[known], q)) for q in (0.002, 0.998))
    return painted((colour - low) * (255 / max(high - low, 1e-6)), known)
