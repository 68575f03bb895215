from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.roof_partition import cut_cells
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.volumetric_parts.hull import build_hull
from cityflow.reconstruction.volumetric_parts.hull_columns import standing_columns

FAR = (85_000.0, 447_000.0, 0.0)
Plane = tuple[float, float, float]


def hull_of(lines: list[CutLine], planes: list[Plane], ceilings: dict[int, float], outline: Polygon) -> Polyhedron:
    """Cells in the order of their middles, west to east, then south to north; ceilings by that number."""
    division = Subdivision.of_polygon(outline)
    cut_cells(division, lines, 100)
    order = sorted(
        division.cells, key=lambda n: (round(division.polygon(n).centroid.x, 3), division.polygon(n).centroid.y)
    )
    surface = {cell: k for k, cell in enumerate(order)}
    ceiling = {order[k]: z for k, z in ceilings.items()}
    columns = standing_columns(division, surface, ceiling, np.array(planes), 0.0)
    world = Polygon(np.asarray(outline.exterior.coords)[:-1] + FAR[:2])
    return build_hull(division, columns, 0.0, FAR, world)


def at_x(x: float) -> CutLine:
    return CutLine(1.0, 0.0, x, -100.0, 100.0, 1.0)


def test_part_over_a_void_beside_a_part_on_the_ground() -> None:
    solid = hull_of([at_x(4)], [(0, 0, 9), (0, 0, 9)], {1: 3.0}, box(0, 0, 10, 5))
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(10 * 5 * 9 - 6 * 5 * 3)
    assert len(solid.of_semantic(Semantic.ROOF)) == 2
    (underside,) = solid.of_semantic(Semantic.OUTER_CEILING)
    assert set(solid.ring(underside.rings[0])[:, 2].tolist()) == {3.0}
    (ground,) = solid.of_semantic(Semantic.GROUND)
    assert solid.ring(ground.rings[0])[:, 0].max() == 85_004.0


def test_passage_with_different_roofs_on_both_sides() -> None:
    solid = hull_of([at_x(3), at_x(6)], [(0, 0, 6), (0.1, 0, 8), (0, 0.2, 5)], {1: 3.5}, box(0, 0, 10, 5))
    assert check_polyhedron(solid) == []
    middle = 3 * 5 * (8 + 0.1 * 4.5 - 3.5)
    assert volume(solid) == pytest.approx(3 * 5 * 6 + middle + 4 * 5 * 5.5, rel=1e-6)
    assert len(solid.of_semantic(Semantic.GROUND)) == 2


def test_roof_that_crosses_the_underside_beside_it() -> None:
    """The shed on the ground is lower than the neighbour's underside at one end and higher at the other."""
    solid = hull_of([at_x(4)], [(0, 0.5, 2), (0, 0, 9)], {1: 3.0}, box(0, 0, 10, 5))
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(4 * 5 * 3.25 + 6 * 5 * 6)


def test_too_thin_a_storey_over_a_void_is_filled() -> None:
    solid = hull_of([at_x(4)], [(0, 0, 9), (0, 0, 3.2)], {1: 3.0}, box(0, 0, 10, 5))
    assert check_polyhedron(solid) == []
    assert solid.of_semantic(Semantic.OUTER_CEILING) == ()
    assert volume(solid) == pytest.approx(4 * 5 * 9 + 6 * 5 * 3.2)


def test_outline_with_a_courtyard_keeps_its_vertices() -> None:
    outline = Polygon([(0, 0), (12, 0), (12, 10), (0, 10)], [[(4, 3), (4, 7), (8, 7), (8, 3)]])
    division = Subdivision.of_polygon(outline)
    columns = standing_columns(division, dict.fromkeys(division.cells, 0), {}, np.array([[0, 0, 7.0]]), 0.0)
    shell, hole = (np.asarray(r.coords)[:-1] + FAR[:2] for r in (outline.exterior, *outline.interiors))
    solid = build_hull(division, columns, 0.0, FAR, Polygon(shell, [hole]))
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx((120 - 16) * 7)
    assert {tuple(p) for p in solid.vertices[:, :2].tolist()} == {
        tuple(p) for p in np.concatenate([shell, hole]).tolist()
    }


@pytest.mark.parametrize("seed", range(12))
def test_random_columns_are_closed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lines = [at_x(3.0), at_x(7.0)]
    planes = [(float(a), float(b), float(c)) for a, b, c in rng.uniform((-0.3, -0.3, 7), (0.3, 0.3, 12), (3, 3))]
    ceilings = {int(k): float(z) for k, z in zip(rng.permutation(3)[:1], rng.uniform(2, 4, 1), strict=True)}
    solid = hull_of(lines, planes, ceilings, box(0, 0, 10, 6))
    assert check_polyhedron(solid) == []
    expected = 0.0
    for k, (x0, x1) in enumerate(((0, 3), (3, 7), (7, 10))):
        a, b, c = planes[k]
        expected += (x1 - x0) * 6 * (a * (x0 + x1) / 2 + b * 3 + c - ceilings.get(k, 0.0))
    assert volume(solid) == pytest.approx(expected, rel=1e-4)
