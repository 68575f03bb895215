"""Straight edges of outlines, ring by ring."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.geometry.straight_edges import wall_edges, wall_rings

YARD = Polygon(
    [(0, 0), (10, 0), (20, 0), (20, 20), (0, 20)], [[(6, 6), (6, 14), (14, 14), (14, 6)], [(2, 2), (2, 4), (4, 4)]]
)


def test_each_ring_is_closed_by_its_edges() -> None:
    rings = wall_rings(YARD, [LineString([(10, 0), (20, 0)])])
    assert [len(r) for r in rings] == [5, 4, 3]
    for ring in rings:
        for edge, following in zip(ring, [*ring[1:], ring[0]], strict=True):
            assert np.array_equal(edge.xy[-1], following.xy[0])
            inside = (edge.xy[0] + edge.xy[-1]) / 2 - 0.01 * edge.outward
            assert YARD.contains(shapely.Point(inside))
    assert [e.party for e in rings[0]].count(True) == 1


def test_all_edges_are_those_of_the_rings_in_turn() -> None:
    flat = [edge.xy.tolist() for ring in wall_rings(YARD, ()) for edge in ring]
    assert [edge.xy.tolist() for edge in wall_edges(YARD, ())] == flat
    assert len(flat) == 4 + 4 + 3
