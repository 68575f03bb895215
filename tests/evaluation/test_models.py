"""Models against the truth: right ones, and ones that are wrong in one known way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from shapely import LineString, Polygon, box

from cityflow.core.building import EdgeOverhang, Face, Polyhedron, RoofPlane, Semantic
from cityflow.core.roof_type_names import RoofType
from cityflow.evaluation.models import Model, ModelErrors, TrueModel, compare_model
from cityflow.evaluation.models_planes import slivers, whole_planes
from cityflow.evaluation.models_points import match_points, outline_corners
from cityflow.evaluation.models_ridges import true_ridge_ends
from cityflow.evaluation.models_surface import distances_to_model
from cityflow.evaluation.models_table import ASKED, summary

EAVE, RIDGE, LENGTH, DEPTH = 5.0, 8.0, 10.0, 8.0
WALLS = box(0, 0, LENGTH, DEPTH)
SLOPE = (RIDGE - EAVE) / (DEPTH / 2)
FRONT = box(-0.5, -0.5, LENGTH + 0.5, DEPTH / 2), RoofPlane(0.0, SLOPE, EAVE, (0.0, 0.0))
BACK = box(-0.5, DEPTH / 2, LENGTH + 0.5, DEPTH + 0.5), RoofPlane(0.0, -SLOPE, EAVE + SLOPE * DEPTH, (0.0, 0.0))
TRUTH = TrueModel("u", "gable", WALLS, box(-0.5, -0.5, 10.5, 8.5), (FRONT, BACK), (RoofType.GABLE,))
ALL_ROUND = tuple(EdgeOverhang(LineString(pair), 0.5) for pair in pairwise(WALLS.exterior.coords))


def house(lift: float = 0.0, ridge_end: float = 0.0, wide: float = 0.0) -> Polyhedron:
    """A gable over the walls: all of it too high by `lift`, its ridge too short by `ridge_end`, its eastern wall too far out by `wide`."""
    x = LENGTH + wide
    low = [(0, 0, 0), (x, 0, 0), (x, DEPTH, 0), (0, DEPTH, 0)]
    high = [(a, b, EAVE + lift) for a, b, _ in low]
    top = [(ridge_end, DEPTH / 2, RIDGE + lift), (x - ridge_end, DEPTH / 2, RIDGE + lift)]
    roof = [Face(((4, 5, 9, 8),), Semantic.ROOF, 0), Face(((6, 7, 8, 9),), Semantic.ROOF, 1)]
    walls = [Face(((0, 1, 5, 4),), Semantic.WALL), Face(((2, 3, 7, 6),), Semantic.WALL)]
    if ridge_end:
        roof += [Face(((5, 6, 9),), Semantic.ROOF, 2), Face(((7, 4, 8),), Semantic.ROOF, 3)]
        walls += [Face(((1, 2, 6, 5),), Semantic.WALL), Face(((3, 0, 4, 7),), Semantic.WALL)]
    else:
        walls += [Face(((1, 2, 6, 9, 5),), Semantic.WALL), Face(((3, 0, 4, 8, 7),), Semantic.WALL)]
    faces = [*roof, *walls, Face(((3, 2, 1, 0),), Semantic.GROUND)]
    return Polyhedron(np.array([*low, *high, *top], np.float64), tuple(faces))


def judged(solid: Polyhedron | None, **more: object) -> ModelErrors:
    return compare_model(TRUTH, Model(solid, **({"roof_type": "gable"} | more)))  # type: ignore[arg-type]


def test_the_truth_itself_is_right() -> None:
    e = judged(house(), overhangs=ALL_ROUND, claimed_rmse_m=0.05)
    assert (e.true_planes, e.planes, e.planes_right, e.type_right, e.fault) == (2, 2, True, True, "")
    assert e.surface.within == 1.0
    assert e.surface.area_m2 == pytest.approx(80)
    assert max(e.surface.rmse_m, e.surface.rmse_3d_m) < 1e-6
    assert (len(e.ridge_ends.distances), e.ridge_ends.missed, e.ridge_ends.invented) == (2, 0, 0)
    assert e.ridge_ends.distances.max() < 1e-6
    assert (len(e.corners.distances), e.corners.missed, e.corners.invented) == (4, 0, 0)
    assert e.overhangs.true_m == pytest.approx(np.full(4, 0.5), abs=1e-6)
    assert np.abs(e.overhangs.errors_m).max() < 1e-6
    assert e.claims
    assert e.keeps_claim


def test_a_roof_too_high_is_not_within_reach_and_breaks_its_claim() -> None:
    e = judged(house(lift=0.2), claimed_rmse_m=0.05)
    assert e.surface.within == 0.0
    assert e.surface.rmse_m == pytest.approx(0.2)
    assert e.surface.rmse_3d_m == pytest.approx(0.2 * np.cos(np.arctan(SLOPE)), rel=0.05)
    assert e.ridge_ends.distances == pytest.approx([0.2, 0.2])
    assert e.claims
    assert not e.keeps_claim


def test_an_invented_tower_breaks_the_claim_though_the_true_roof_is_there() -> None:
    """Places of the true roof below the tower's foot are near its walls; the tower's top is near nothing."""
    solid = house()
    square = np.array([(4, 1), (5, 1), (5, 2), (4, 2)], np.float64)
    low = np.column_stack([square, EAVE + SLOPE * square[:, 1]])
    corners = np.concatenate([solid.vertices, low, np.column_stack([square, np.full(4, 15.0)])])
    n = len(solid.vertices)
    sides = [Face(((n + k, n + (k + 1) % 4, n + 4 + (k + 1) % 4, n + 4 + k),), Semantic.WALL) for k in range(4)]
    tower = Polyhedron(corners, (*solid.faces, *sides, Face((tuple(range(n + 4, n + 8)),), Semantic.ROOF)))
    e = judged(tower, claimed_rmse_m=0.05)
    assert e.surface.rmse_3d_m > 0.5
    assert not e.keeps_claim


def test_a_hip_in_the_place_of_a_gable() -> None:
    e = judged(house(ridge_end=1.0), roof_type="hip")
    assert (e.planes, e.planes_right, e.type_right) == (4, False, False)
    assert e.ridge_ends.distances == pytest.approx([1.0, 1.0])
    assert 0.8 < e.surface.within < 0.95


def test_ridge_ends_far_off_are_missed_and_invented() -> None:
    e = judged(house(ridge_end=2.5))
    assert (len(e.ridge_ends.distances), e.ridge_ends.missed, e.ridge_ends.invented) == (0, 2, 2)


def test_a_wall_too_far_out_moves_corners_but_not_the_ridge_end_at_the_true_gable() -> None:
    e = judged(house(wide=0.3))
    assert e.corners.distances == pytest.approx([0, 0, 0.3, 0.3], abs=1e-9)
    assert e.ridge_ends.distances.max() < 1e-6


def test_without_a_solid_nothing_is_right() -> None:
    e = judged(None)
    assert (e.planes, e.type_right, e.fault, e.surface.within) == (0, False, "no solid", 0.0)
    assert (e.ridge_ends.missed, e.corners.missed) == (2, 4)


def test_a_solid_with_a_hole_has_a_fault() -> None:
    solid = house()
    assert judged(Polyhedron(solid.vertices, solid.faces[1:])).fault


def test_overhang_is_missed_half_found_and_invented() -> None:
    bare = compare_model(TRUTH, Model(house()))
    assert bare.overhangs.errors_m == pytest.approx(np.full(4, -0.5), abs=1e-6)
    front = EdgeOverhang(LineString([(0, 0), (5, 0)]), 0.4), EdgeOverhang(LineString([(5, 0), (10, 0)]), 0.6)
    some = compare_model(TRUTH, Model(house(), overhangs=front))
    assert sorted(some.overhangs.errors_m) == pytest.approx([-0.5, -0.5, -0.5, 0.0], abs=1e-6)
    none = TrueModel("u", "gable", WALLS, WALLS, (FRONT, BACK), (RoofType.GABLE,))
    wrong = compare_model(none, Model(house(), overhangs=front[:1]))
    assert (len(wrong.overhangs.true_m), len(wrong.overhangs.bare_m), wrong.overhangs.invented) == (0, 4, 1)


def test_overhang_on_one_side_only() -> None:
    one = TrueModel("u", "gable", WALLS, box(0, -0.7, LENGTH, DEPTH), (FRONT, BACK), (RoofType.GABLE,))
    e = compare_model(one, Model(house()))
    assert e.overhangs.true_m == pytest.approx([0.7], abs=1e-6)
    assert len(e.overhangs.bare_m) == 3


def test_planes_that_hang_together_are_one_and_small_ones_none() -> None:
    level = RoofPlane(0.0, 0.0, 6.0, (0.0, 0.0))
    higher = RoofPlane(0.0, 0.0, 7.0, (0.0, 0.0))
    cut = [(box(0, 0, 5, 8), level), (box(5, 0, 10, 8), level)]
    apart = [(box(0, 0, 4, 8), level), (box(6, 0, 10, 8), level), (box(4, 0, 6, 8), higher)]
    small = [(box(0, 0, 10, 8), level), (box(2, 2, 3.4, 3.4), higher)]
    assert [len(whole_planes(s, WALLS)) for s in (cut, apart, small)] == [1, 3, 1]


def test_a_horn_is_a_sliver_and_a_small_dormer_none() -> None:
    level = RoofPlane(0.0, 0.0, 6.0, (0.0, 0.0))
    assert slivers([(box(0, 0, 2, 0.05), level), (box(0, 0, 0.6, 0.6), level), FRONT]) == 1
    assert judged(house()).slivers == 0


def test_a_chimney_on_the_ridge_does_not_cut_it() -> None:
    chimney = box(4, 3.7, 4.6, 4.3)
    cut = tuple((p.difference(chimney), plane) for p, plane in (FRONT, BACK))
    ends = true_ridge_ends([*cut, (chimney, RoofPlane(0.0, 0.0, 9.0, (0.0, 0.0)))], WALLS)
    assert sorted(ends[:, 0]) == pytest.approx([0, 10])


def test_valleys_and_steps_are_no_ridges() -> None:
    up, down = RoofPlane(0.0, SLOPE, 5.0, (0.0, 4.0)), RoofPlane(0.0, -SLOPE, 5.0, (0.0, 4.0))
    assert len(true_ridge_ends([(FRONT[0], down), (BACK[0], up)], WALLS)) == 0
    lower = RoofPlane(0.0, -SLOPE, BACK[1].height - 2.0, (0.0, 0.0))
    assert len(true_ridge_ends([FRONT, (BACK[0], lower)], WALLS)) == 0


def test_points_match_one_to_one() -> None:
    matched = match_points(np.array([[0.0, 0], [1, 0]]), np.array([[0.1, 0], [0.2, 0], [9, 9]]))
    assert matched.distances == pytest.approx([0.1, 0.8])
    assert (matched.missed, matched.invented) == (0, 1)


def test_vertices_on_straight_edges_are_no_corners() -> None:
    assert len(outline_corners(Polygon([(0, 0), (5, 0), (10, 0), (10, 8), (0, 8)]))) == 4


def test_distances_in_space_agree_with_dense_samples() -> None:
    """Against the nearest of many places on the faces."""
    rng = np.random.default_rng(3)
    solid = house()
    places = rng.uniform((-1, -1, 2), (11, 9, 9), (60, 3))
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 150), np.linspace(0, 1, 150)))
    z = EAVE + SLOPE * DEPTH / 2 - np.abs(v * DEPTH - DEPTH / 2) * SLOPE
    roof = np.column_stack([u * LENGTH, v * DEPTH, z])
    gables = [np.column_stack([np.full(len(u), x), v * DEPTH, u * z]) for x in (0.0, LENGTH)]
    sides = [np.column_stack([u * LENGTH, np.full(len(u), y), v * EAVE]) for y in (0.0, DEPTH)]
    dense = np.concatenate([roof, *gables, *sides])
    nearest = np.array([np.linalg.norm(dense - p, axis=1).min() for p in places])
    assert distances_to_model(solid, places) == pytest.approx(nearest, abs=0.06)


def test_the_table_counts_by_area_and_names_what_is_asked() -> None:
    column = summary([(judged(house()), 0.1), (judged(house(lift=0.2), claimed_rmse_m=0.05), 0.3)], 0.08)
    assert column["units"] == "2"
    assert column["area within 0.15 m"] == "50.0 %"
    assert column["claims kept"] == "0.0 %"
    assert column["ridge ends matched, missed, invented"] == "4, 0, 0"
    assert column["overhang within 2 GSD"] == "0.0 %"
    assert column["s worst"] == "0.300"
    assert set(ASKED) <= set(column)
