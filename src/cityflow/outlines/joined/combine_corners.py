"""Corners of a footprint that its evidence does not pay for: a minimum cut prices borders by their length, but no corners.

A corner must gain in area, or in what the border costs, what it costs itself, as in the choice between outlines of a roof.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.outlines.from_heights.generalise import CORNER_COST_M2
from cityflow.outlines.from_heights.refit import meeting
from cityflow.outlines.joined.combine_evidence import costs_along, extended_cost, seen_cost
from cityflow.outlines.joined.combine_faces import running_sums, signed_integral
from cityflow.outlines.joined.combine_lines import Pieces

_LONGEST = 2.0
"""An edge becomes at most so many times as long: the direction of a short one is not known well enough for more; set by hand, as is the next."""
_STRAIGHT = np.cos(np.radians(8.0))
"""An edge prolongs another if it turns less."""
_LEAST_M2 = 1e-6


@dataclass(frozen=True, slots=True)
class _Change:
    """Some vertices of a ring, the first and the last of which stay, and what they would become."""

    first: int
    old: FloatArray
    new: FloatArray


@dataclass(frozen=True, slots=True)
class _Evidence:
    running: FloatArray
    cell: float
    pieces: Pieces
    tree: shapely.STRtree

    def gained(self, change: _Change) -> float:
        """By how much evidence and the price of corners together prefer the change, m²; it never takes a wall that was seen."""
        old, new = _edges(change.old), _edges(change.new)
        before, after = costs_along(old, self.pieces, self.tree), costs_along(new, self.pieces, self.tree)
        if (before[1:-1] <= seen_cost() * np.hypot(*(old[1:-1, 1] - old[1:-1, 0]).T)).any():
            return -np.inf
        # What prolongs an edge costs what prolonged edges of roofs do, wherever it runs.
        for k in (0, -1):
            was, now = old[k, 1] - old[k, 0], new[k, 1] - new[k, 0]
            if _cosine(was, now) > _STRAIGHT:
                beyond = max(float(np.hypot(*now) - np.hypot(*was)), 0.0)
                after[k] = min(after[k], before[k] + extended_cost() * beyond)
        area = signed_integral(new, self.running, self.cell) - signed_integral(old, self.running, self.cell)
        return float(area + before.sum() - after.sum() + CORNER_COST_M2 * (len(old) - len(new)))


def with_fewer_corners(polygon: Polygon, gain: FloatArray, cell: float, pieces: Pieces) -> Polygon:
    """The polygon without corners that are not worth their price, the dearest gone first; as it was where that spoils it.

    A kink becomes straight, a corner that is cut off becomes one again, and of two edges that a step parts one goes on.

    Parameters
    ----------
    polygon : metres; the lower left corner of the raster is the origin
    gain : (rows, cols) m² per m² of calling a place building, row 0 at the bottom
    cell : metres
    pieces : candidate lines, along which a border costs less
    """
    known = _Evidence(running_sums(gain), cell, pieces, shapely.STRtree(shapely.linestrings(pieces.ends)))
    oriented = shapely.orient_polygons(polygon, exterior_cw=False)
    rings = [_simpler(shapely.get_coordinates(r)[:-1], known) for r in (oriented.exterior, *oriented.interiors)]
    result = Polygon(rings[0], rings[1:])
    return result if result.is_valid and result.area > 0 else polygon


def _simpler(ring: FloatArray, known: _Evidence) -> FloatArray:
    worth: dict[bytes, float] = {}
    while len(ring) > 4:
        best, most, its_key = None, _LEAST_M2, b""
        for change in _changes(ring):
            key = change.old.tobytes() + change.new.tobytes()
            if key not in worth:
                worth[key] = known.gained(change)
            if worth[key] > most:
                best, most, its_key = change, worth[key], key
        if best is None:
            break
        changed = np.concatenate([best.new, np.roll(ring, -best.first, axis=0)[len(best.old) :]])
        if Polygon(changed).is_valid:
            ring = changed
        else:
            worth[its_key] = -np.inf
    return ring


def _changes(ring: FloatArray) -> Iterator[_Change]:
    n = len(ring)
    for k in range(n):
        for count in range(3, min(n - 1, 5) + 1):
            chain = ring[np.arange(k, k + count) % n]
            if count == 3 and _cosine(chain[1] - chain[0], chain[2] - chain[1]) > _STRAIGHT:
                yield _Change(k, chain, chain[[0, -1]])
            elif count > 3 and (corner := _corner(chain)) is not None:
                yield _Change(k, chain, np.array([chain[0], corner, chain[-1]]))


def _corner(chain: FloatArray) -> FloatArray | None:
    """(2,) where the first and the last edge meet, cut or prolonged by no more than their own length; None where they do not."""
    a, b, c, d = chain[[0, 1, -2, -1]]
    corner = meeting(a, b, c, d)
    if corner is None:
        return None
    shares = ((corner - a) @ (b - a) / ((b - a) @ (b - a)), (corner - d) @ (c - d) / ((c - d) @ (c - d)))
    return corner if min(shares) > 0 and max(shares) <= _LONGEST else None


def _edges(chain: FloatArray) -> FloatArray:
    return np.stack([chain[:-1], chain[1:]], axis=1)


def _cosine(a: FloatArray, b: FloatArray) -> float:
    return float(a @ b) / max(float(np.hypot(*a) * np.hypot(*b)), 1e-12)
