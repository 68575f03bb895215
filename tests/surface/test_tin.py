from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.geometry.validity import check_surface
from cityflow.surface.constrained import triangulate
from cityflow.surface.sample import sample
from cityflow.surface.tin import Tin, TinParameters, terrain_tin
from cityflow.surface.tin_parts import connected_parts

BOUNDS = (0.0, 0.0, 100.0, 100.0)
GRID = Grid(-2.0, 102.0, 0.5, 208, 408)
HOUSES = [
    Polygon([(20, 20), (32, 24), (30, 33), (18, 29)]),
    Polygon([(32, 24), (44, 28), (42, 37), (30, 33)]),
    Polygon([(60, 60), (75, 60), (75, 80), (68, 80), (68, 70), (60, 70)]),
]


def heights(grid: Grid) -> FloatArray:
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    return np.asarray(3 * np.sin(x / 17) + 2 * np.cos(y / 23) + np.clip((x - 50) / 3, 0, 2))


def area(tin: Tin) -> FloatArray:
    a, b, c = (tin.vertices[tin.triangles[:, i], :2] for i in range(3))
    return np.asarray(((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2)


def test_tin_follows_the_terrain_and_has_the_outlines_as_edges() -> None:
    tin = terrain_tin(GRID, heights(GRID), HOUSES, TinParameters(tolerance_m=0.1), BOUNDS)
    assert area(tin).min() > 0
    assert area(tin).sum() == pytest.approx(100 * 100)
    number = {(x, y): i for i, (x, y) in enumerate(tin.vertices[:, :2].tolist())}
    edges = {frozenset(e) for t in tin.triangles.tolist() for e in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))}
    for house in HOUSES:
        ring = [number[x, y] for x, y in house.exterior.coords]
        assert all(frozenset(pair) in edges for pair in pairwise(ring))
    middle = tin.vertices[tin.triangles].mean(axis=1)
    off = middle[:, 2] - sample(GRID, heights(GRID), middle[:, 0], middle[:, 1])
    assert np.percentile(np.abs(off), 99) < 0.15
    assert len(tin.vertices) < 1500


@pytest.mark.parametrize(("metres", "most"), [(0.6, 0.0), (12.0, 13 * 100.0)])
def test_terrain_along_one_border_only_is_a_strip_or_nothing(metres: float, most: float) -> None:
    """All vertices of the borders stand in one line then."""
    strip = heights(GRID)
    strip[:, GRID.x_centres() > metres] = np.nan
    strip[(GRID.y_centres() > 90) | (GRID.y_centres() < 10)] = np.nan
    tin = terrain_tin(GRID, strip, [], bounds=BOUNDS)
    if not most:
        assert not len(tin.triangles)
    else:
        assert area(tin).min() > 0
        assert 0.5 * metres * 80 < area(tin).sum() < most


def test_footprints_may_be_cut_out() -> None:
    tin = terrain_tin(GRID, heights(GRID), HOUSES, bounds=BOUNDS, cut_out=True)
    assert area(tin).sum() == pytest.approx(100 * 100 - sum(h.area for h in HOUSES))


def test_neighbours_have_the_same_border() -> None:
    z = heights(GRID)
    west = terrain_tin(GRID, z, [], bounds=BOUNDS)
    east = terrain_tin(GRID, z, HOUSES, bounds=(100.0, 0.0, 200.0, 100.0))
    left = west.vertices[west.vertices[:, 0] == 100.0]
    right = east.vertices[east.vertices[:, 0] == 100.0]
    assert len(left) > 3
    np.testing.assert_array_equal(left, right)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_any_segments_that_do_not_cross_become_edges(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 50, (60, 2)).round(2)
    lines: list[shapely.LineString] = []
    for a, b in rng.permutation(60).reshape(-1, 2):
        line = shapely.LineString([xy[a], xy[b]])
        if line.length > 0 and all(line.distance(other) > 0.05 for other in lines):
            lines.append(line)
    found, triangles = triangulate(xy, [shapely.get_coordinates(line) for line in lines])
    number = {(x, y): i for i, (x, y) in enumerate(found.tolist())}
    edges = {frozenset(e) for t in triangles.tolist() for e in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))}
    points = shapely.points(found)
    for line in lines:
        if (shapely.distance(points, line) < 1e-3).sum() == 2:
            assert frozenset(number[c] for c in line.coords) in edges
    hull = shapely.MultiPoint(found).convex_hull.area
    a, b, c = (found[triangles[:, i]] for i in range(3))
    signed = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert signed.min() > 0
    assert signed.sum() == pytest.approx(hull, rel=1e-6)


def with_holes(grid: Grid) -> FloatArray:
    """Terrain that is unknown in a slanted corner, over a lake across the border x = 100, and in single cells."""
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    unknown = (x + 0.7 * y < 25) | (np.hypot(x - 96, y - 50) < 14) | (np.hypot(x - 33, y - 28) < 4)
    unknown[100, 100] = unknown[101, 101] = True
    return np.where(unknown, np.nan, heights(grid))


def test_unknown_terrain_has_no_triangles_and_every_vertex_a_height() -> None:
    z = with_holes(GRID)
    tin = terrain_tin(GRID, z, HOUSES, TinParameters(tolerance_m=0.1), BOUNDS)
    assert np.isfinite(tin.vertices).all()
    assert area(tin).min() > 0
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    inside = (x > 0) & (x < 100) & (y > 0) & (y < 100)
    assert area(tin).sum() == pytest.approx((np.isfinite(z) & inside).sum() * 0.25)
    assert np.unique(tin.triangles).tolist() == list(range(len(tin.vertices)))


def test_neighbours_have_the_same_border_beside_unknown_terrain() -> None:
    z = with_holes(GRID)
    west = terrain_tin(GRID, z, [], bounds=BOUNDS)
    east = terrain_tin(GRID, z, HOUSES, bounds=(100.0, 0.0, 200.0, 100.0))
    left = west.vertices[west.vertices[:, 0] == 100.0]
    right = east.vertices[east.vertices[:, 0] == 100.0]
    assert len(left) > 3
    np.testing.assert_array_equal(left, right)


def test_no_terrain_gives_an_empty_tin() -> None:
    tin = terrain_tin(GRID, np.full(GRID.shape, np.nan), HOUSES, bounds=BOUNDS)
    assert len(tin.vertices) == len(tin.triangles) == 0


def _faults(tin: Tin) -> list[str]:
    parts = connected_parts(tin.vertices, tin.triangles)
    assert sum(len(triangles) for _, triangles in parts) == len(tin.triangles)
    return [str(f) for vertices, triangles in parts for f in check_surface([[vertices[t]] for t in triangles])]


def test_known_areas_that_touch_at_a_corner_share_no_vertex() -> None:
    grid = Grid(0.0, 20.0, 0.5, 40, 40)
    dtm = heights(grid)
    dtm[:20, 20:] = dtm[20:, :20] = np.nan
    tin = terrain_tin(grid, dtm, [])
    assert len(connected_parts(tin.vertices, tin.triangles)) == 2
    assert area(tin).min() > 0
    assert area(tin).sum() == pytest.approx(200, abs=0.1)
    assert _faults(tin) == []


def test_a_terrain_that_touches_itself_around_a_gap_is_a_manifold() -> None:
    grid = Grid(0.0, 20.0, 0.5, 40, 40)
    dtm = heights(grid)
    dtm[10:20, 10:20] = dtm[20:30, 20:30] = np.nan
    tin = terrain_tin(grid, dtm, [])
    assert len(connected_parts(tin.vertices, tin.triangles)) == 1
    assert _faults(tin) == []


def test_walls_that_cross_the_rim_beside_a_corner_leave_no_two_vertices_at_one_place() -> None:
    grid = Grid(0.0, 20.0, 0.5, 40, 40)
    dtm = heights(grid)
    dtm[10:20, 10:20] = np.nan
    corner = 5.0004
    house = Polygon([(corner, 12.0), (8.0, 14.5), (6.0, 17.0), (3.0, 14.5)])
    tin = terrain_tin(grid, dtm, [house])
    assert _faults(tin) == []
    assert area(tin).min() > 0


@pytest.mark.parametrize("seed", range(6))
def test_every_part_of_a_terrain_full_of_gaps_and_houses_keeps_the_rules(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = Grid(0.0, 40.0, 0.5, 80, 80)
    dtm = heights(grid)
    rough = gaussian_filter(rng.normal(size=grid.shape), 3)
    dtm[rough > np.quantile(rough, 0.8)] = np.nan
    houses = []
    for x, y in np.mgrid[-1:4, -1:4].reshape(2, -1).T * 11 + rng.uniform(3, 6, (25, 2)):
        half_x, half_y = rng.uniform(1.5, 3.5, 2)
        house = shapely.affinity.rotate(shapely.box(x - half_x, y - half_y, x + half_x, y + half_y), rng.uniform(0, 90))
        houses.append(shapely.set_precision(house, 1e-4))
    tin = terrain_tin(grid, dtm, houses, None, (0.5, 0.5, 39.5, 39.5))
    assert area(tin).min() > 0
    assert _faults(tin) == []
