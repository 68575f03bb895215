"""Segments placed by hand, and the slices that they must be counted in."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import ORTHO, Segments
from cityflow.splitting.strips.axis_strips import AxisStrip, axis_strips
from cityflow.splitting.strips.slices import SliceEvidence, points_on_segments, slice_evidence

EAVES_M, GROUND_M = 8.0, 2.0


def _segments(*ends: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Segments:
    start, end = np.array([e[0] for e in ends], float), np.array([e[1] for e in ends], float)
    n = len(ends)
    return Segments(start, end, np.zeros(n, np.int64), np.full(n, ORTHO, np.uint8), ("nadir",))


def _piece() -> AxisStrip:
    return axis_strips(box(0, 0, 30, 10), (0.0, 90.0), 0.16, 4.5)[0]


def _evidence(segments: Segments) -> tuple[FloatArray, SliceEvidence]:
    strip = _piece()
    heights = np.full(len(strip.stations), EAVES_M)
    found = slice_evidence(strip, points_on_segments(segments, 0.08), (heights, heights), GROUND_M)
    return strip.stations, found


def test_points_are_evenly_spaced_and_know_how_their_segment_stands() -> None:
    points = points_on_segments(_segments(((0, 0, 0), (0, 0, 1)), ((5, 5, 1), (7, 5, 1))), 0.1)
    assert points.upright.tolist() == [True] * 11 + [False] * 21
    assert np.allclose(np.diff(points.xyz[11:, 0]), 0.1)
    assert np.allclose(points.xyz[[0, 10]], [[0, 0, 0], [0, 0, 1]])


def test_upright_segment_over_the_whole_height_fills_its_slice_alone() -> None:
    stations, found = _evidence(_segments(((12.0, 0.0, GROUND_M), (12.0, 0.0, EAVES_M))))
    k = int(np.argmin(np.abs(stations - 12.0)))
    assert found.vertical[k, 0] == pytest.approx(1.0)
    assert found.vertical[:, 1].max() == 0
    assert np.all(found.vertical[np.abs(stations - 12.0) > 0.4] == 0)


def test_window_edge_covers_its_part_of_the_height() -> None:
    stations, found = _evidence(_segments(((12.0, 0.0, 3.0), (12.0, 0.0, 4.5))))
    k = int(np.argmin(np.abs(stations - 12.0)))
    assert found.vertical[k, 0] == pytest.approx(1.5 / 6.0, abs=0.06)


def test_segment_across_the_roof_counts_as_sloped_by_its_length() -> None:
    stations, found = _evidence(_segments(((20.0, 0.0, 8.0), (20.0, 5.0, 11.0))))
    k = int(np.argmin(np.abs(stations - 20.0)))
    assert found.sloped[k] == pytest.approx(0.5, abs=0.06)
    assert found.vertical.max() == 0


def test_ridge_along_the_row_lies_in_no_slice() -> None:
    _, found = _evidence(_segments(((2.0, 5.0, 11.0), (28.0, 5.0, 11.0))))
    assert found.sloped.max() == 0


def test_no_segments() -> None:
    _, found = _evidence(_segments(((100.0, 100.0, 0.0), (101.0, 100.0, 0.0))))
    assert found.sloped.sum() == 0
    assert found.sloped.max() == found.vertical.max() == 0
