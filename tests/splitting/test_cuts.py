"""Places of borders worked out by hand, and lines that end where walls begin."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon, box

from cityflow.splitting.borders.border_position import edge_position
from cityflow.splitting.cuts.cut_chords import line_at, off_corners
from cityflow.splitting.cuts.cuts import maxima
from cityflow.splitting.scores.medians import medians_beside
from cityflow.splitting.strips.axis_strips import axis_strips


@pytest.mark.parametrize("true", [5.0, 5.03, 5.08, 4.91])
def test_edge_is_found_to_a_fraction_of_a_column(true: float) -> None:
    cell = 0.2
    u = np.asarray((np.arange(50) + 0.5) * cell, np.float64)
    before = np.clip((true - (u - cell / 2)) / cell, 0, 1)
    share = np.repeat((0.5 - before)[:, None], 20, axis=1)
    share[::7, 3] = np.nan
    assert edge_position(share, u, 5.3) == pytest.approx(true, abs=0.01)


def test_minority_of_rows_does_not_move_an_edge() -> None:
    u = np.asarray((np.arange(50) + 0.5) * 0.2, np.float64)
    share = np.where(u[:, None] < 5.0, -0.5, 0.5) * np.ones((1, 20))
    share[:, :6] = np.where(u[:, None] < 5.8, -0.5, 0.5)
    assert edge_position(share, u, 5.2) == pytest.approx(5.0, abs=0.01)


def test_nothing_known_has_no_edge() -> None:
    u = np.asarray((np.arange(50) + 0.5) * 0.2, np.float64)
    assert edge_position(np.full((50, 5), np.nan), u, 5.0) is None
    assert edge_position(np.full((50, 5), 0.5), u, 5.0) is None


def test_maximum_of_a_plateau_is_its_middle() -> None:
    stations = np.arange(0, 20, 0.16)
    values = np.where(np.abs(stations - 8.0) < 0.5, 5.0, 0.0) + np.where(np.abs(stations - 14.0) < 0.1, 7.0, 0.0)
    first, second = maxima(values, stations, 1.8)[:2]
    assert stations[first] == pytest.approx(14.0, abs=0.16)
    assert stations[second] == pytest.approx(8.0, abs=0.2)


def test_line_runs_through_a_jog_of_the_outline() -> None:
    outline = Polygon([(0, 0), (12, 0), (12, 1), (30, 1), (30, 10), (0, 10)])
    strip = axis_strips(outline, (0.0, 90.0), 0.16, 4.5)[0]
    line = line_at(strip, outline, float(strip.to_uv(np.array([12.1, 5.0]))[0]))
    assert line is not None
    ends = shapely.get_coordinates(line)
    assert np.allclose(sorted(ends[:, 0]), [12, 12], atol=1e-6)
    assert min(ends[:, 1]) in (pytest.approx(0.0), pytest.approx(1.0))
    assert max(ends[:, 1]) == pytest.approx(10)


def test_line_at_a_corner_of_a_ring_ends_at_the_courtyard() -> None:
    ring = box(0, 0, 60, 50).difference(box(11, 11, 49, 39))
    strip = next(p for p in axis_strips(ring, (0.0, 90.0), 0.16, 4.5) if p.aspect_deg < 1 and p.low.mean() < 5)
    u = float(strip.to_uv(np.array([10.9, 5.0]))[0])
    line = line_at(strip, ring, u)
    assert line is not None
    assert line.length == pytest.approx(11, abs=0.01)
    assert line.distance(shapely.Point(11, 11)) == pytest.approx(0, abs=1e-6)


def test_ends_on_corners_move_onto_a_wall() -> None:
    outline = Polygon([(0, 0), (12, 0), (12, 1), (30, 1), (30, 10), (0, 10)])
    moved = off_corners(LineString([(12, 1), (12, 10)]), outline)
    start = shapely.get_coordinates(moved)[0]
    assert outline.boundary.distance(shapely.Point(start)) < 1e-9
    assert np.hypot(*(start - [12, 1])) == pytest.approx(0.01)


def test_block_medians_are_numpy_s() -> None:
    image = np.random.default_rng(1).integers(0, 255, (40, 30, 3)).astype(np.float32)
    found = medians_beside(image, np.array([[4, 21]]), np.array([0, 10, 30]), 0.1)[0]
    assert found.shape == (2, 3)
    assert found[1, 2] == pytest.approx(np.median(image[4:21, 10:30, 2]), abs=1.5)
    assert np.isnan(
        medians_beside(np.full((4, 4, 1), np.nan, np.float32), np.array([[0, 4]]), np.array([0, 4]), 0.1)
    ).all()
