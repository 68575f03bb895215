"""Points and heights as a browser takes them in: plain arrays that go to the graphics card as they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray, IntArray

Json = Any
FINEST_M = 0.1
"""Edge of the cells of which one point is kept, at the finest; doubled until the points are few enough."""


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Heights on a regular grid in the page's frame.

    Attributes
    ----------
    heights : (rows, cols) float32, metres, NaN unknown
    origin : east and north of the first cell's middle
    right, down : east and north from a cell to the next one in its row, and in its column
    """

    heights: Float32Array
    origin: tuple[float, float]
    right: tuple[float, float]
    down: tuple[float, float]

    def said(self) -> dict[str, Json]:
        """What the page must know of the file."""
        rows, cols = self.heights.shape
        return {"rows": rows, "cols": cols, "origin": _rounded(self.origin), "right": _rounded(self.right), "down": _rounded(self.down)}  # fmt: skip


def thinned(xyz: FloatArray, most: int) -> IntArray:
    """Positions of at most `most` of (N, 3) points, evenly spread: the first one of each cell of a lattice in space.

    >>> thinned(np.array([[0.0, 0, 0], [0.01, 0, 0], [5.0, 0, 0]]), 2).tolist()
    [0, 2]
    """
    if len(xyz) <= most:
        return np.arange(len(xyz))
    low, cell = xyz.min(axis=0), FINEST_M
    chosen = np.arange(len(xyz))
    while len(chosen) > most:
        # cells of twice the edge hold whole cells of before, so the points kept are among those kept before
        steps = ((xyz[chosen] - low) / cell).astype(np.int64)
        _, first = np.unique((steps[:, 0] << 42) | (steps[:, 1] << 21) | steps[:, 2], return_index=True)
        chosen, cell = chosen[np.sort(first)], 2 * cell
    return chosen


def encode_points(local: FloatArray, colours: ByteArray | None, classes: ByteArray) -> tuple[bytes, dict[str, Json]]:
    """A tile's points, and what the page must know of them.

    Parameters
    ----------
    local : (N, 3) metres in the page's frame
    colours : (N, 3) as screens show them, or None

    Returns
    -------
    float32 positions about an origin, then colours where there are some, then classes
    """
    origin = np.round(local.mean(axis=0), 1) if len(local) else np.zeros(3)
    parts = [(local - origin).astype("<f4").tobytes()]
    if colours is not None:
        parts.append(np.ascontiguousarray(colours, np.uint8).tobytes())
    parts.append(np.ascontiguousarray(classes, np.uint8).tobytes())
    said = {"count": len(local), "is_coloured": colours is not None, "origin": _rounded(origin.tolist())}
    return b"".join(parts), said


def _rounded(values: Any) -> list[float]:
    return [round(float(v), 6) for v in values]
