from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_areas, face_normals, volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition, single_cell
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.assemble import MIN_HEIGHT, assemble
from roof_cases import ORIGIN, edges_are_matched

RECTANGLE = box(0, 0, 12, 8)


def cut_up(outline: Polygon, lines: list[CutLine]) -> Subdivision:
    division = Subdivision.of_polygon(outline)
    for line in lines:
        for number in list(division.cells):
            division.cut(number, line)
    return division


def line_through(x: float, y: float, angle: float) -> CutLine:
    nx, ny = float(np.cos(angle)), float(np.sin(angle))
    return CutLine(nx, ny, nx * x + ny * y, -100.0, 100.0, 1.0)


def partition_of(division: Subdivision, planes: list[int]) -> RoofPartition:
    labels = {n: planes[k % len(planes)] for k, n in enumerate(sorted(division.cells))}
    return RoofPartition.of_subdivision(division, labels)


def true_volume(partition: RoofPartition, coefficients: FloatArray, floor: float) -> float:
    total = 0.0
    for cell in partition.cells:
        polygon, (a, b, c) = partition.polygon(cell), coefficients[cell.plane]
        total += (a * polygon.centroid.x + b * polygon.centroid.y + c - floor) * polygon.area
    return total


def test_one_level_cell_is_a_block() -> None:
    solid = assemble(single_cell(RECTANGLE), np.array([[0, 0, 7.0]]), 1.0, ORIGIN)
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(12 * 8 * 6, abs=1e-6)
    assert len(solid.vertices) == 8
    assert [len(solid.of_semantic(s)) for s in (Semantic.ROOF, Semantic.WALL, Semantic.GROUND)] == [1, 4, 1]
    assert solid.of_semantic(Semantic.ROOF)[0].plane == 0


def test_a_step_makes_one_wall_and_five_outer_ones() -> None:
    division = cut_up(RECTANGLE, [line_through(5, 0, 0)])
    solid = assemble(partition_of(division, [0, 1]), np.array([[0, 0, 5.0], [0, 0, 8.0]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    walls = solid.of_semantic(Semantic.WALL)
    # The long sides are one face each, though two roofs end on them.
    assert sorted(len(w.rings[0]) for w in walls) == [4, 4, 4, 6, 6]


def test_a_courtyard_has_walls_to_it_and_a_hole_in_roof_and_ground() -> None:
    court = Polygon(box(0, 0, 20, 16).exterior.coords, [box(6, 6, 14, 10).exterior.coords])
    solid = assemble(single_cell(court), np.array([[0.1, 0, 7.0]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    assert len(solid.of_semantic(Semantic.WALL)) == 8
    assert [len(f.rings) for f in (*solid.of_semantic(Semantic.ROOF), *solid.of_semantic(Semantic.GROUND))] == [2, 2]
    assert volume(solid) == pytest.approx((20 * 16 - 8 * 4) * (7 + 0.1 * 10), rel=1e-6)


def test_roofs_that_cross_along_an_edge_get_a_vertex_there() -> None:
    division = cut_up(RECTANGLE, [line_through(6, 0, 0)])
    coefficients = np.array([[0, 0.5, 5.0], [0, -0.5, 9.0]])
    solid = assemble(partition_of(division, [0, 1]), coefficients, 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    at_crossing = np.abs(solid.vertices - (ORIGIN[0] + 6, ORIGIN[1] + 4, 7)).max(axis=1) < 1e-3
    assert at_crossing.sum() == 1
    assert volume(solid) == pytest.approx(12 * 8 * 7, rel=1e-6)


@pytest.mark.parametrize("low", [3.0, 5.0])
def test_four_walls_never_meet_in_one_edge(low: float) -> None:
    division = cut_up(RECTANGLE, [line_through(6, 0, 0), line_through(0, 4, np.pi / 2)])
    middle = {n: division.polygon(n).centroid for n in division.cells}
    labels = {n: int((c.x > 6) == (c.y > 4)) for n, c in middle.items()}
    partition = RoofPartition.of_subdivision(division, labels)
    solid = assemble(partition, np.array([[0, 0, low], [0, 0, 8.0]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    assert edges_are_matched(solid)
    assert volume(solid) == pytest.approx(12 * 8 * (low + 8) / 2, rel=1e-3)


def test_heights_that_differ_by_millimetres_make_no_wall() -> None:
    division = cut_up(RECTANGLE, [line_through(5, 0, 0)])
    solid = assemble(partition_of(division, [0, 1]), np.array([[0, 0, 5.0], [0, 0, 5.002]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    assert len(solid.of_semantic(Semantic.WALL)) == 4


def test_a_sliver_of_the_outline_does_not_cost_a_roof_its_plane() -> None:
    """Over the spike the plane of the roof falls below the floor: that part is laid level, the roof stays."""
    spiked = Polygon([(0, 0), (10, 0), (10, 8), (0.3, 8), (0.15, 20), (0, 8)])
    solid = assemble(single_cell(spiked), np.array([[0, -0.7, 9.0]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    roofs = {f.plane: solid.ring(f.rings[0]) - ORIGIN for f in solid.of_semantic(Semantic.ROOF)}
    assert roofs[0][:, 2] == pytest.approx(9.0 - 0.7 * roofs[0][:, 1], abs=0.005)
    assert roofs[0][:, 1].min() == pytest.approx(0)
    assert roofs[0][:, 1].max() > 8
    assert roofs[-1][:, 2] == pytest.approx(MIN_HEIGHT, abs=0.005)


def test_a_roof_below_the_floor_is_laid_level_above_it() -> None:
    division = cut_up(RECTANGLE, [line_through(5, 0, 0)])
    solid = assemble(partition_of(division, [0, 1]), np.array([[1.0, 0, -3.0], [1.0, 0, -3.0]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    lowest = min(solid.ring(f.rings[0])[:, 2].min() for f in solid.of_semantic(Semantic.ROOF))
    assert lowest >= MIN_HEIGHT
    assert -1 in {f.plane for f in solid.of_semantic(Semantic.ROOF)}


def test_outline_vertices_stay_bit_for_bit() -> None:
    world = Polygon([(85000.123, 447000.456), (85012.1231, 447000.4562), (85012.7, 447008.1), (85000.3, 447008.9)])
    local = Polygon(shapely.get_coordinates(world)[:-1] - np.array(ORIGIN[:2]))
    solid = assemble(single_cell(local), np.array([[0, 0, 7.0]]), 0.0, ORIGIN, world)
    plan = {tuple(v) for v in solid.vertices[:, :2].tolist()}
    assert plan == {tuple(v) for v in shapely.get_coordinates(world).tolist()}


def test_vertices_are_multiples_of_a_tenth_of_a_millimetre() -> None:
    division = cut_up(RECTANGLE, [line_through(5.0333333, 1, 0.7)])
    solid = assemble(partition_of(division, [0, 1]), np.array([[0.1234, 0, 5], [0, 0.3333, 8.0]]), 0.0, ORIGIN)
    assert np.array_equal(solid.vertices, np.round(solid.vertices, 4))


TOUCHING = {
    "hole in a corner": Polygon([(0, 0), (10, 0), (10, 8), (0, 8)], [[(0, 0), (1, 3), (3, 1)]]),
    "hole on a side": Polygon([(0, 0), (5, 0), (10, 0), (10, 8), (0, 8)], [[(5, 0), (4, 3), (6, 3)]]),
    "two holes": Polygon(
        box(0, 0, 10, 8).exterior.coords, [box(2, 2, 4, 4).exterior.coords, box(4, 4, 6, 6).exterior.coords]
    ),
}


@pytest.mark.parametrize("name", sorted(TOUCHING))
def test_rings_that_touch_are_pulled_apart(name: str) -> None:
    outline = TOUCHING[name]
    solid = assemble(single_cell(outline), np.array([[0.1, 0, 7.0]]), 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(outline.area * (7 + 0.1 * outline.centroid.x), rel=1e-3)


def test_another_outline_is_refused() -> None:
    with pytest.raises(ValueError, match="not the one"):
        assemble(single_cell(RECTANGLE), np.array([[0, 0, 7.0]]), 0.0, ORIGIN, RECTANGLE)


@st.composite
def outlines(draw: st.DrawFn) -> Polygon:
    n = draw(st.integers(3, 12))
    radii = draw(st.lists(st.floats(4, 12), min_size=n, max_size=n))
    angles = 2 * np.pi * (np.arange(n) + 0.3) / n
    shell = np.round(np.column_stack([np.cos(angles), np.sin(angles)]) * np.array(radii)[:, None], 3)
    hole = draw(st.booleans()) and n > 5
    return Polygon(shell, [box(-1, -1.5, 1.2, 1).exterior.coords] if hole else [])


@st.composite
def roofs(draw: st.DrawFn) -> tuple[Polygon, list[CutLine], FloatArray, list[int]]:
    count = draw(st.integers(0, 6))
    place, angle = st.floats(-5, 5), st.floats(0, np.pi)
    lines = [line_through(draw(place), draw(place), draw(angle)) for _ in range(count)]
    slope, height = st.sampled_from([-1.0, -0.5, 0.0, 0.0, 0.3, 1.0]), st.floats(15, 40)
    planes = [(draw(slope), draw(slope), draw(height)) for _ in range(draw(st.integers(1, 5)))]
    labels = draw(st.lists(st.integers(0, len(planes) - 1), min_size=1, max_size=9))
    return draw(outlines()), lines, np.array(planes), labels


@given(roofs())
@settings(max_examples=120, deadline=None, derandomize=True)
def test_any_partition_and_planes_give_a_valid_solid(
    roof: tuple[Polygon, list[CutLine], FloatArray, list[int]],
) -> None:
    outline, lines, planes, labels = roof
    partition = partition_of(cut_up(outline, lines), labels)
    assert sum(partition.polygon(c).area for c in partition.cells) == pytest.approx(outline.area, rel=1e-9)
    # The partition leaves no cell narrower than a stated width; millimetres would drown in the rounding.
    assume(all(not partition.polygon(c).buffer(-0.02).is_empty for c in partition.cells))
    planes[:, 2] += max(0.0, MIN_HEIGHT + 0.1 - _lowest(partition, planes))
    solid = assemble(partition, planes, 0.0, ORIGIN)
    assert edges_are_matched(solid)
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(true_volume(partition, planes, 0.0), rel=1e-3)
    assert _projected_roof_area(solid) == pytest.approx(outline.area, rel=1e-4)


def _lowest(partition: RoofPartition, planes: FloatArray) -> float:
    heights = [partition.vertices[list(c.rings[0])] @ planes[c.plane, :2] + planes[c.plane, 2] for c in partition.cells]
    return float(np.min(np.concatenate(heights)))


def _projected_roof_area(solid: Polyhedron) -> float:
    roof = [f.semantic is Semantic.ROOF for f in solid.faces]
    return float((face_areas(solid) * face_normals(solid)[:, 2])[roof].sum())
