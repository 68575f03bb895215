"""Boxes within a part whose points lie off its roof: upper storeys, stair houses, dormers, notches.

Cuts from side to side would make three or four more shapes of the roof around a box, each at its own price. A box is grown from a point off the roof
around its nearest points on the same side of it, as long as a level roof in the box saves more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.planes.plane_labels import OUTLIER
from cityflow.reconstruction.primitive_parts.shape_fits import KINDS, ShapeFit, fit_level, planes_of

OFF_NATS = 2.0
"""A point that costs this much under the roof of the part may be of another one: two sigma; set by hand, as are those below."""
MOST_SEEDS, MOST_FELLOWS = 60, 60
"""Places that are tried, and points around each; bounds time."""
LEAST_POINTS = 2
"""One point may be a chimney or a bird."""


def point_costs(
    fit: ShapeFit, box: FloatArray, uv: FloatArray, z: FloatArray, sigma: float
) -> tuple[FloatArray, BoolArray]:
    """(N,) nats of each point under a shape, and whether it lies above it."""
    planes = planes_of(fit, box)
    height = uv @ planes[:, :2].T + planes[:, 2]
    lowest = np.argmin(height, axis=1)
    off = z - height[np.arange(len(z)), lowest]
    scale = 1.0 + (planes[lowest, :2] ** 2).sum(axis=1)
    return np.minimum(off**2 / (scale * 2 * sigma**2), OUTLIER), off > 0


def islands(
    uv: FloatArray,
    z: FloatArray,
    cost: FloatArray,
    above: BoolArray,
    frame: FloatArray,
    sigma: float,
    number: float,
    most: int,
) -> Iterator[tuple[float, BoolArray, FloatArray]]:
    """The boxes that save most: price (nats), which points are inside, and (4,) the box, infinite where it reaches the side of the part.

    Parameters
    ----------
    uv, z, cost, above : points of the part, their cost under its roof, and whether they lie above it
    frame : (4,) u_min, v_min, u_max, v_max of the part
    """
    off = np.flatnonzero(cost > OFF_NATS)
    if len(off) < LEAST_POINTS:
        return
    seeds = off[np.linspace(0, len(off) - 1, min(len(off), MOST_SEEDS)).round().astype(np.int64)]
    price = 2.0 * math.log(len(z))
    gains, boxes = _grown(uv, z, cost, above, off, seeds, sigma)
    known: set[bytes] = set()
    for k in np.argsort(-gains, kind="stable").tolist():
        if gains[k] <= price + math.log(KINDS) + number or len(known) == most:
            return
        inside = np.all((uv >= boxes[k, :2]) & (uv <= boxes[k, 2:]), axis=1)
        key = np.packbits(inside).tobytes()
        if key not in known and inside.sum() < len(z) - 1:
            known.add(key)
            yield price, inside, _sides(uv, inside, frame)


def _sides(uv: FloatArray, inside: BoolArray, frame: FloatArray) -> FloatArray:
    """Box around points: half the way to the next point beside it, infinite where there is none up to the side of the part."""
    low, high = uv[inside].min(axis=0), uv[inside].max(axis=0)
    spacing = math.sqrt(float(np.prod(np.maximum(frame[2:] - frame[:2], 0.1))) / len(uv))
    box = np.array([-np.inf, -np.inf, np.inf, np.inf])
    others = uv[~inside]
    for axis in (0, 1):
        across = others[:, 1 - axis]
        beside = (across >= low[1 - axis] - spacing / 2) & (across <= high[1 - axis] + spacing / 2)
        w = others[beside, axis]
        if np.any(w < low[axis]):
            box[axis] = (w[w < low[axis]].max() + low[axis]) / 2
        if np.any(w > high[axis]):
            box[2 + axis] = (w[w > high[axis]].min() + high[axis]) / 2
    return box


@njit(cache=True, nogil=True)
def _grown(
    uv: FloatArray, z: FloatArray, cost: FloatArray, above: BoolArray, off: IntArray, seeds: IntArray, sigma: float
) -> tuple[FloatArray, FloatArray]:
    """(S,) nats that the best box around each seed saves under a level roof, and (S, 4) the boxes."""
    gains, boxes = np.zeros(len(seeds)), np.zeros((len(seeds), 4))
    heights = np.empty(len(z))
    for s in range(len(seeds)):
        i = seeds[s]
        away = np.empty(len(off))
        for k in range(len(off)):
            j = off[k]
            away[k] = max(abs(uv[j, 0] - uv[i, 0]), abs(uv[j, 1] - uv[i, 1])) if above[j] == above[i] else np.inf
        box = np.array([uv[i, 0], uv[i, 1], uv[i, 0], uv[i, 1]])
        order = np.argsort(away)
        for k in range(1, min(len(off), MOST_FELLOWS)):
            j = off[order[k]]
            if np.isinf(away[order[k]]):
                break
            box[0], box[1] = min(box[0], uv[j, 0]), min(box[1], uv[j, 1])
            box[2], box[3] = max(box[2], uv[j, 0]), max(box[3], uv[j, 1])
            total, count = 0.0, 0
            for p in range(len(z)):
                if box[0] <= uv[p, 0] <= box[2] and box[1] <= uv[p, 1] <= box[3]:
                    total += cost[p]
                    heights[count] = z[p]
                    count += 1
            if total <= gains[s]:
                continue
            gain = total - fit_level(heights[:count], sigma)[0]
            if gain > gains[s]:
                gains[s] = gain
                boxes[s] = box
    return gains, boxes
