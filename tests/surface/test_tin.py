"""The terrain TIN: its error bound, walls among its edges, no cracks between tiles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
from scipy.interpolate import LinearNDInterpolator

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.core.grid import Grid
from cityflow.outlines.noding import node_outlines
from cityflow.surface.tin import Tin, TinParameters, terrain_tin

BOUNDS = (1000.0, 2000.0, 1100.0, 2100.0)


def hills(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(0.03 * (x - 1000) + 2 * np.sin(x / 17) * np.cos(y / 23) + 1.5 / (1 + np.exp(-(y - 2050) / 2)))


def dtm_over(bounds: tuple[float, float, float, float]) -> tuple[Grid, FloatArray]:
    grid = Grid.covering((bounds[0] - 5, bounds[1] - 5, bounds[2] + 5, bounds[3] + 5), 0.5)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    return grid, hills(x, y)


def terrace(seed: int, n: int = 6) -> list[shapely.Polygon]:
    rng = np.random.default_rng(seed)
    angle, width = rng.uniform(0, np.pi / 2), 6.0
    houses = [shapely.box(i * width, 0, (i + 1) * width, 9 + (i % 2)) for i in range(n)]
    turned = [shapely.affinity.rotate(h, angle, (0, 0), use_radians=True) for h in houses]
    moved = [shapely.affinity.translate(h, 1035, 2030) for h in turned]
    return [o.polygon for o in node_outlines([Outline(str(i), h) for i, h in enumerate(moved)])]


def edges(tin: Tin) -> set[tuple[int, int]]:
    t = tin.triangles
    pairs = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    return {(int(a), int(b)) for a, b in pairs}


@pytest.mark.parametrize("tolerance", [0.05, 0.15, 0.5])
def test_no_point_of_the_dtm_is_further_away_than_the_tolerance(tolerance: float) -> None:
    grid, dtm = dtm_over(BOUNDS)
    tin = terrain_tin(grid, dtm, BOUNDS, [], TinParameters(tolerance_m=tolerance))
    x, y = np.meshgrid(np.arange(1001.0, 1100.0), np.arange(2001.0, 2100.0))
    surface = _interpolated(tin, x, y)
    assert np.max(np.abs(surface - hills(x, y))) <= tolerance + 0.01
    assert len(tin.triangles) < 2 * 100 * 100 / 4


def _interpolated(tin: Tin, x: FloatArray, y: FloatArray) -> FloatArray:
    origin = tin.vertices[0, :2]
    return np.asarray(
        LinearNDInterpolator(tin.vertices[:, :2] - origin, tin.vertices[:, 2])(x - origin[0], y - origin[1])
    )


def test_triangles_cover_the_tile_once_and_look_up() -> None:
    grid, dtm = dtm_over(BOUNDS)
    tin = terrain_tin(grid, dtm, BOUNDS, terrace(3), TinParameters())
    a, b, c = (tin.vertices[tin.triangles[:, k], :2] for k in range(3))
    areas = ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])) / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(100 * 100, abs=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_walls_are_edges_of_the_terrain(seed: int) -> None:
    grid, dtm = dtm_over(BOUNDS)
    houses = terrace(seed)
    tin = terrain_tin(grid, dtm, BOUNDS, houses, TinParameters())
    at = {(x, y): i for i, (x, y, _) in enumerate(tin.vertices.tolist())}
    found = edges(tin)
    for house in houses:
        ring = [tuple(p) for p in np.round(shapely.get_coordinates(house.exterior), 4).tolist()]
        for p, q in itertools.pairwise(ring):
            assert abs(tin.vertices[at[p], 2] - hills(*map(np.asarray, p))) < 0.01
            chain = sorted(
                i for (x, y), i in at.items() if shapely.LineString([p, q]).distance(shapely.Point(x, y)) < 2e-4
            )
            chain.sort(key=lambda i: np.hypot(*(tin.vertices[i, :2] - p)))
            assert all((min(i, k), max(i, k)) in found for i, k in itertools.pairwise(chain))


def test_neighbouring_tiles_meet_without_a_crack() -> None:
    east = (1100.0, 2000.0, 1200.0, 2100.0)
    house = [shapely.box(1095.3, 2040.2, 1104.7, 2051.9)]
    tins = [terrain_tin(*dtm_over(b), b, house, TinParameters()) for b in (BOUNDS, east)]
    borders = [{tuple(v) for v in t.vertices[t.vertices[:, 0] == 1100.0].tolist()} for t in tins]
    assert borders[0] == borders[1]
    assert len(borders[0]) > 4


def test_no_triangle_where_there_is_no_height() -> None:
    grid, dtm = dtm_over(BOUNDS)
    dtm[:, : grid.cols // 2] = np.nan
    tin = terrain_tin(grid, dtm, BOUNDS, [], TinParameters())
    assert np.isfinite(tin.vertices).all()
    assert tin.vertices[:, 0].min() > 1045
    assert len(terrain_tin(grid, np.full(grid.shape, np.nan), BOUNDS, [], TinParameters()).triangles) == 0
