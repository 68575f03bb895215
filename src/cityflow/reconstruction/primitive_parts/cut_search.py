"""Which straight cuts part an outline into the shapes that describe its points most briefly.

Each cut runs from side to side of the part that it cuts, along an axis of the outline. All places between neighbouring points are tried, and first
the sides of the outline prolonged. A cut costs the logarithm of the number of places that it was chosen from.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.primitive_parts.islands import islands, point_costs
from cityflow.reconstruction.primitive_parts.shape_fits import KINDS, ShapeFit, fit_part

WIDTHS = (3,)
"""So many of the best cuts of the whole are followed; of its parts, the best; set by hand."""
DEEPEST, MOST_PARTS, MOST_PLACES = 12, 300, 32
"""Cuts in cuts; parts that are looked at; places that are tried along an axis; set by hand."""
LEAST_POINTS, LEAST_WIDTH_M = 2, 0.8
"""Parts with fewer points, or narrower (m), are none; set by hand."""
ISLANDS = 2
"""So many boxes are tried in a part; set by hand."""


@dataclass(frozen=True, slots=True)
class Cut:
    """A cut across an axis, somewhere between two places (metres; the same where it is exact), and what stands on both sides."""

    axis: int
    gap: tuple[float, float]
    lower: Part
    upper: Part

    @property
    def middle(self) -> float:
        return (self.gap[0] + self.gap[1]) / 2

    @property
    def numbers(self) -> int:
        return 1


@dataclass(frozen=True, slots=True)
class Island:
    """A box within a part, what stands in it (`lower`) and around it (`upper`).

    Attributes
    ----------
    box : (4,) float64, u_min, v_min, u_max, v_max, metres; infinite where it reaches the side of the part
    """

    box: FloatArray
    lower: Part
    upper: Part

    @property
    def numbers(self) -> int:
        return int(np.isfinite(self.box).sum())

    def holds(self, uv: FloatArray) -> BoolArray:
        """(N,) whether places are in it."""
        return np.asarray(np.all((uv >= self.box[:2]) & (uv <= self.box[2:]), axis=-1))


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the outline: one shape, or a cut and what is on both sides of it.

    Attributes
    ----------
    cost : nats, with all below
    box : (4,) u_min, v_min, u_max, v_max
    fit : its shape as one
    cut : a cut or a box, where more shapes are cheaper
    """

    cost: float
    box: FloatArray
    fit: ShapeFit
    cut: Cut | Island | None = None

    def leaves(self) -> Iterator[Part]:
        if self.cut is None:
            yield self
        else:
            yield from self.cut.lower.leaves()
            yield from self.cut.upper.leaves()

    @property
    def numbers(self) -> int:
        """That describe it, with all below."""
        return (
            self.fit.numbers if self.cut is None else self.cut.numbers + self.cut.lower.numbers + self.cut.upper.numbers
        )


@dataclass
class CutSearch:
    """The search over one outline.

    Parameters
    ----------
    uv : (N, 2) float64, places of the points along the axes of the outline, metres;  z : (N,) float64, metres
    lines : for each axis, where the outline's own sides run across it
    limits : metres, lowest and highest that a shape may reach
    sigma : metres, scatter of the points of one roof;  number : nats that each number costs
    """

    uv: FloatArray
    z: FloatArray
    lines: tuple[FloatArray, FloatArray]
    limits: tuple[float, float]
    sigma: float
    number: float
    known: dict[tuple[bytes, bytes], Part] = field(default_factory=dict)
    looked_at: int = 0

    def best(self, points: IntArray, ring: FloatArray, depth: int = 0) -> Part:
        """The cheapest tree over the points within a ring (uv, metres)."""
        box = np.concatenate([ring.min(axis=0), ring.max(axis=0)])
        key = points.tobytes(), np.round(box, 3).tobytes()
        if key in self.known:
            return self.known[key]
        fit = fit_part(self.uv[points], self.z[points], box, self.limits, self.sigma, self.number)
        best = Part(fit.cost, box, fit)
        least = 2 * (math.log(KINDS) + self.number) + math.log(2.0)
        if depth < DEEPEST and fit.cost > least and self.looked_at < MOST_PARTS:
            self.looked_at += 1
            for price, axis, low, high in self._promising(points, ring, WIDTHS[depth] if depth < len(WIDTHS) else 1):
                if price + least - math.log(2.0) >= best.cost:
                    continue
                place = (low + high) / 2
                below = self.uv[points, axis] <= place
                lower = self.best(points[below], clipped(ring, axis, place, True), depth + 1)
                upper = self.best(points[~below], clipped(ring, axis, place, False), depth + 1)
                cost = price + lower.cost + upper.cost
                if cost < best.cost - 1e-9:
                    best = Part(cost, box, fit, Cut(axis, (low, high), lower, upper))
            best = self._with_islands(points, ring, best, depth)
        self.known[key] = best
        return best

    def _with_islands(self, points: IntArray, ring: FloatArray, best: Part, depth: int) -> Part:
        """The best part, or one with a box in it that is cheaper."""
        uv, z, box = self.uv[points], self.z[points], best.box
        cost, above = point_costs(best.fit, box, uv, z, self.sigma)
        for price, inside, sides in islands(uv, z, cost, above, box, self.sigma, self.number, ISLANDS):
            low, high = np.maximum(sides[:2], box[:2]), np.minimum(sides[2:], box[2:])
            corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
            lower = self.best(points[inside], corners, depth + 1)
            upper = self.best(points[~inside], ring, depth + 1)
            total = price + lower.cost + upper.cost
            if total < best.cost - 1e-9:
                best = Part(total, box, best.fit, Island(sides, lower, upper))
        return best

    def _promising(self, points: IntArray, ring: FloatArray, most: int) -> list[tuple[float, int, float, float]]:
        """The cuts with the best shapes on both sides: price, axis, and the places between which they may lie."""
        found: list[tuple[float, float, int, float, float]] = []
        uv, z = self.uv[points], self.z[points]
        for axis in (0, 1):
            for price, gaps in self._places(uv[:, axis], axis, ring):
                costs = cut_costs(uv, z, ring, axis, gaps.mean(axis=1), self.limits, self.sigma, self.number)
                found += [(c + price, price, axis, *g) for c, g in zip(costs.tolist(), gaps.tolist(), strict=True)]
        return [f[1:] for f in sorted(found)[:most]]

    def _places(self, w: FloatArray, axis: int, ring: FloatArray) -> Iterator[tuple[float, FloatArray]]:
        """Price and (K, 2) places of cuts: on the outline's own lines, and between points."""
        first, last = ring[:, axis].min() + LEAST_WIDTH_M, ring[:, axis].max() - LEAST_WIDTH_M
        own = self.lines[axis]
        own = own[(own > first) & (own < last)]
        if len(own):
            yield math.log(2.0) + math.log(len(own)), np.column_stack([own, own])
        ordered = np.sort(w)
        gaps = np.column_stack([ordered[:-1], ordered[1:]])
        middle = gaps.mean(axis=1)
        gaps = gaps[(middle > first) & (middle < last) & (gaps[:, 1] - gaps[:, 0] > 0.02)]
        if len(gaps) > MOST_PLACES:
            gaps = gaps[np.linspace(0, len(gaps) - 1, MOST_PLACES).round().astype(np.int64)]
        if len(gaps):
            yield math.log(2.0) + math.log(len(gaps)), gaps


@njit(cache=True, nogil=True)
def clipped(ring: FloatArray, axis: int, place: float, below: bool) -> FloatArray:
    """The part of a ring on one side of a line across an axis; parts that fall apart stay joined by edges on the line."""
    out = np.empty((2 * len(ring) + 2, 2))
    count = 0
    for i in range(len(ring)):
        a, b = ring[i], ring[(i + 1) % len(ring)]
        inside = a[axis] <= place if below else a[axis] >= place
        if inside:
            out[count] = a
            count += 1
        if (a[axis] - place) * (b[axis] - place) < 0:
            t = (place - a[axis]) / (b[axis] - a[axis])
            out[count] = a + t * (b - a)
            count += 1
    return out[:count].copy()


@njit(cache=True, nogil=True)
def cut_costs(
    uv: FloatArray,
    z: FloatArray,
    ring: FloatArray,
    axis: int,
    places: FloatArray,
    limits: tuple[float, float],
    sigma: float,
    number: float,
) -> FloatArray:
    """(K,) nats of the best single shapes on both sides of cuts; infinite where a side has too few points."""
    out = np.full(len(places), np.inf)
    for k in range(len(places)):
        below = uv[:, axis] <= places[k]
        few = min(below.sum(), len(z) - below.sum())
        if few < LEAST_POINTS:
            continue
        total = 0.0
        for side in (True, False):
            part = clipped(ring, axis, places[k], side)
            if len(part) < 3:
                total = np.inf
                break
            box = np.array([part[:, 0].min(), part[:, 1].min(), part[:, 0].max(), part[:, 1].max()])
            mine = below if side else ~below
            total += fit_part(uv[mine], z[mine], box, limits, sigma, number).cost
        out[k] = total
    return out
