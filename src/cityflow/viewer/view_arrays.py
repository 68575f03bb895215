"""Points and heights for the browser: plain arrays for the graphics card."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray, IntArray

Json = Any


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

    def as_json(self) -> dict[str, Json]:
        """What the page must know of the file."""
        rows, cols = self.heights.shape
        return {"rows": rows, "cols": cols, "origin": _rounded(self.origin), "right": _rounded(self.right), "down": _rounded(self.down)}  # fmt: skip


def thinned(count: int, most: int) -> IntArray:
    """Positions of `most` of `count` points, chosen at random (a fixed seed): their distances from a model are distributed as those of all are.

    >>> len(thinned(1000, 10)), thinned(3, 10).tolist()
    (10, [0, 1, 2])
    """
    if count <= most:
        return np.arange(count)
    return np.sort(np.random.default_rng(0).choice(count, most, replace=False))


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
    entry = {"count": len(local), "is_coloured": colours is not None, "origin": _rounded(origin.tolist())}
    return b"".join(parts), entry


def _rounded(values: Any) -> list[float]:
    return [round(float(v), 6) for v in values]
