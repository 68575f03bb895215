from __future__ import annotations

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely import Point, Polygon

from cityflow.geometry.polygon_triangulation import triangulate_polygon

Array = NDArray[np.float64]


def rings_of(polygon: Polygon) -> list[Array]:
    polygon = shapely.geometry.polygon.orient(polygon)
    return [np.array(r.coords)[:-1] for r in (polygon.exterior, *polygon.interiors)]


def random_polygon(rng: np.random.Generator) -> Polygon:
    """A star with holes, some of its edges cut by vertices in their middle."""
    count = int(rng.integers(5, 60))
    angles, radii = np.sort(rng.uniform(0, 2 * np.pi, count)), rng.uniform(5, 10, count)
    polygon = Polygon(np.c_[radii * np.cos(angles), radii * np.sin(angles)]).buffer(0)
    for _ in range(int(rng.integers(0, 5))):
        hole = Point(rng.uniform(-6, 6, 2)).buffer(rng.uniform(0.3, 1.5), quad_segs=2)
        polygon = polygon.difference(hole) if polygon.contains(hole) else polygon
    largest = max(getattr(polygon, "geoms", [polygon]), key=lambda p: p.area)
    return largest.segmentize(rng.uniform(0.5, 4)) if rng.random() < 0.5 else largest


def signed_areas(rings: list[Array], triangles: NDArray[np.int64]) -> Array:
    a, b, c = np.moveaxis(np.concatenate(rings)[triangles], 1, 0)
    areas: Array = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    return areas


@pytest.mark.parametrize("seed", range(40))
def test_triangles_fill_the_polygon_once_and_use_every_corner(seed: int) -> None:
    polygon = random_polygon(np.random.default_rng(seed))
    rings = [np.round(r, 4) for r in rings_of(polygon)]
    triangles = triangulate_polygon(rings)
    areas = signed_areas(rings, triangles)
    assert len(triangles) == sum(map(len, rings)) - 2 + 2 * (len(rings) - 1)
    assert areas.sum() == pytest.approx(Polygon(rings[0], rings[1:]).area, abs=1e-9)
    assert areas.min() > -1e-9
    assert set(triangles.ravel()) == set(range(sum(map(len, rings))))


@pytest.mark.parametrize("seed", range(10))
def test_no_corner_lies_in_the_circle_of_a_triangle_that_sees_it(seed: int) -> None:
    """Delaunay inside a convex polygon: every circumcircle is empty."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 10, (40, 2))
    ring = rings_of(shapely.MultiPoint(points).convex_hull)[0]
    for triangle in triangulate_polygon([ring]):
        a, b, c = ring[triangle]
        system = 2 * np.array([b - a, c - a])
        centre = np.linalg.solve(system, [b @ b - a @ a, c @ c - a @ a])
        gaps = np.linalg.norm(ring - centre, axis=1) - np.linalg.norm(a - centre)
        assert gaps.min() > -1e-6


@pytest.mark.parametrize("bulge", [0.0, 5e-5, -5e-5])
def test_collinear_vertices_leave_no_slivers(bulge: float) -> None:
    bottom = [(x, -bulge if 0 < x < 9 else 0.0) for x in range(10)]
    ring = np.array([*bottom, (9, 6), (0, 6)], np.float64)
    triangles = triangulate_polygon([ring])
    assert len(triangles) == 10
    assert signed_areas([ring], triangles).min() > 1


def test_hole_that_touches_the_exterior_in_a_vertex() -> None:
    square = np.array([(0, 0), (5, 0), (10, 0), (10, 10), (0, 10)], np.float64)
    hole = np.array([(5, 0), (4, 3), (6, 3)], np.float64)
    areas = signed_areas([square, hole], triangulate_polygon([square, hole]))
    assert areas.sum() == pytest.approx(100 - 3)
    assert areas.min() >= 0
