"""Corners within a straight edge go, all others become vertices."""

from __future__ import annotations

import numpy as np

from cityflow.core.building import Semantic
from cityflow.reconstruction.solids.corner_faces import CornerFace, Place, leaves_line, numbered
from cityflow.reconstruction.solids.wall_merging import Corner

PLAN = {0: (0.0, 0.0), 1: (4.0, 0.0), 2: (4.0, 3.0), 3: (0.0, 3.0), 4: (2.0, 0.0)}


def _place(corner: Corner) -> Place:
    return *PLAN[corner[0]], 5.0 * corner[1]


def _is_needed(corner: Corner, around: set[Corner]) -> bool:
    return len(around) != 2 or leaves_line(_place(corner), [_place(c) for c in sorted(around)], 1e-4)


def test_a_corner_on_a_straight_edge_is_left_out() -> None:
    floor = [(0, 0), (4, 0), (1, 0), (2, 0), (3, 0)]
    made = numbered(
        [CornerFace([floor], Semantic.GROUND), CornerFace([floor[::-1]], Semantic.ROOF, 7)], _place, _is_needed
    )
    assert made.vertices.tolist() == [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]]
    assert [(f.rings, f.semantic, f.plane) for f in made.faces] == [
        (((0, 1, 2, 3),), Semantic.GROUND, -1), (((3, 2, 1, 0),), Semantic.ROOF, 7),
    ]  # fmt: skip


def test_a_corner_where_a_third_edge_ends_stays() -> None:
    floor, wall = [(0, 0), (4, 0), (1, 0), (2, 0), (3, 0)], [(4, 0), (4, 1), (1, 1), (1, 0)]
    made = numbered([CornerFace([floor], Semantic.GROUND), CornerFace([wall], Semantic.WALL)], _place, _is_needed)
    assert (2.0, 0.0, 0.0) in map(tuple, np.asarray(made.vertices))


def test_distances_from_a_line_are_metres_whatever_its_length() -> None:
    for length in (1.0, 10.0):
        ends = [(0.0, 0.0, 0.0), (length, 0.0, 0.0)]
        assert not leaves_line((0.5, 0.0009, 0.0), ends, 1e-3)
        assert leaves_line((0.5, 0.0011, 0.0), ends, 1e-3)
