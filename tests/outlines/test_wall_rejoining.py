"""Which segments are asked whether they are one wall: all that can be."""

from __future__ import annotations

import numpy as np

from cityflow.outlines.from_walls.wall_curves import Fit
from cityflow.outlines.from_walls.wall_normals import DIRECTIONS, _voted
from cityflow.outlines.from_walls.wall_rejoining import MergeRules, _direction, _gap, _Left
from cityflow.outlines.from_walls.wall_segments import WallSegment

RULES = MergeRules(turn=0.17, offset=0.3, blind=0.9, gap=4.0)


def segment(middle: tuple[float, float], degrees: float, length: float) -> WallSegment:
    angle = np.radians(degrees)
    axis = np.array([np.cos(angle), np.sin(angle)])
    fit = Fit(np.array(middle), axis, np.array([axis[1], -axis[0]]), 0.0, 0.0, 0.0, 0.05, 0.01, 50)
    return WallSegment(np.arange(3), fit, False, -length / 2, length / 2, 1.0, True)


def test_every_segment_of_one_line_is_asked() -> None:
    rng = np.random.default_rng(1)
    segments = [
        segment((float(x), float(y)), float(turn + rng.normal(0, 4)), float(length))
        for x, y, turn, length in zip(
            rng.uniform(0, 20, 300), rng.integers(0, 4, 300) * 5.0 + rng.normal(0, 0.1, 300), rng.choice([0, 90, 180, 270], 300),
            rng.uniform(0.5, 8, 300), strict=True,
        )
    ]  # fmt: skip
    left, found = _Left(list(segments)), 0
    for one in segments[:60]:
        way = _direction(one)
        asked = left.alike(one, RULES)
        for k, other in enumerate(segments):
            theirs = _direction(other)
            turned = abs(way[0] * theirs[1] - way[1] * theirs[0]) > RULES.turn or way @ theirs <= 0
            if not turned and _gap(one, other, RULES) is not None:
                assert k in asked
                found += 1
        assert len(asked) < 100
    assert found > 60


def test_what_is_taken_away_is_not_asked() -> None:
    left = _Left([segment((0.0, 0.0), 0.0, 6.0), segment((5.0, 0.0), 0.0, 3.0), segment((9.0, 0.1), 1.0, 2.0)])
    first = left.without(0)
    assert left.alike(first, RULES) == [0, 1]
    assert left.without(0).length == 3.0
    assert left.alike(first, RULES) == [0]
    left.without(0)
    assert left.alike(first, RULES) == []


def test_votes_for_all_directions_at_once_are_those_one_by_one() -> None:
    rng = np.random.default_rng(2)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    votes, band = np.stack([np.cos(angles), np.sin(angles)]), 0.12
    for _ in range(20):
        turn = rng.uniform(0, np.pi)
        along, across = rng.uniform(-0.5, 0.5, 60), rng.normal(0, 0.05, 60)
        x, y = along * np.cos(turn) - across * np.sin(turn), along * np.sin(turn) + across * np.cos(turn)
        column = np.column_stack([x, y, rng.integers(1, 9, 60)])
        totals = np.empty(DIRECTIONS)
        found = _voted(column, votes, band, totals)
        expected = [
            sum(p * max(0.0, 1.0 - (a * x + b * y) ** 2 / (4 * band * band)) for x, y, p in column) for a, b in votes.T
        ]
        assert np.allclose(totals, expected)
        assert found == tuple(votes[:, int(np.argmax(expected))])
