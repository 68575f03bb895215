from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon

from cityflow.reconstruction.solids.ring_tracing import (
    group_rings,
    halves,
    inside_rings,
    ring_area,
    ring_edges,
    trace_rings,
)

#  4 5 6 7 is a square hole in the square 0 1 2 3; 8 9 10 touches the outer square in vertex 0's corner
XY = [
    (0.0, 0.0),
    (9.0, 0.0),
    (9.0, 9.0),
    (0.0, 9.0),
    (3.0, 3.0),
    (3.0, 6.0),
    (6.0, 6.0),
    (6.0, 3.0),
    (2.0, 1.0),
    (1.0, 2.0),
]
OUTER, HOLE = [0, 1, 2, 3], [4, 5, 6, 7]


def test_area_is_positive_counter_clockwise() -> None:
    assert ring_area(OUTER, XY) == pytest.approx(81)
    assert ring_area(HOLE, XY) == pytest.approx(-9)


def test_rings_come_back_from_shuffled_edges() -> None:
    edges = [*ring_edges(HOLE), *ring_edges(OUTER)][::-1]
    assert {frozenset(ring) for ring in trace_rings(edges, XY)} == {frozenset(OUTER), frozenset(HOLE)}


def test_hole_joins_its_exterior() -> None:
    assert group_rings([HOLE, OUTER], XY) == [[OUTER, HOLE]]


def test_hole_that_touches_the_exterior_becomes_a_ring_of_its_own() -> None:
    touching = [0, 9, 8]  # clockwise, shares vertex 0
    rings = trace_rings([*ring_edges(OUTER), *ring_edges(touching)], XY)
    assert sorted(len(ring) for ring in rings) == [3, 4]
    assert sum(ring_area(ring, XY) for ring in rings) == pytest.approx(81 - 1.5)
    assert [len(cell) for cell in group_rings(rings, XY)] == [2]


def test_two_areas_that_touch_in_a_vertex_are_two_rings() -> None:
    xy = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)]
    rings = trace_rings([*ring_edges([0, 1, 2, 3]), *ring_edges([2, 4, 5, 6])], xy)
    assert [ring_area(ring, xy) for ring in rings] == pytest.approx([1, 1])


def test_point_in_hole_is_outside() -> None:
    assert inside_rings(1, 1, [OUTER, HOLE], XY)
    assert not inside_rings(4, 4, [OUTER, HOLE], XY)


@pytest.mark.parametrize("seed", range(20))
def test_halves_are_what_tracing_finds(seed: int) -> None:
    """All chords of a star-shaped ring: those within it part it as tracing does, the others are left to tracing."""
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0, 2 * np.pi, 9))
    xy = list(zip(*(rng.uniform(2, 9, 9) * np.array([np.cos(turn), np.sin(turn)])).tolist(), strict=True))
    ring, within = list(np.roll(np.arange(9), seed).tolist()), 0
    for chord in itertools.permutations(range(9), 2):
        line = LineString([xy[v] for v in chord])
        pair = halves(ring, chord, xy)
        if shapely.covers(Polygon(xy), line) and abs(chord[0] - chord[1]) not in (1, 8):
            within += 1
            assert pair is not None
        if pair is not None:
            traced = group_rings(trace_rings([*ring_edges(ring), chord, chord[::-1]], xy), xy)
            assert [[half] for half in pair] == traced
    assert within
