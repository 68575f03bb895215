"""Lines, categories, decomposition, shapes and models of roof types, by cases worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box
from shapely.affinity import rotate

from cityflow.core.grid import Grid
from cityflow.core.reconstruction import Picture
from cityflow.core.roof_type_names import RoofType
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.roof_types_parts.decomposition import DecompositionParameters, layouts
from cityflow.reconstruction.roof_types_parts.heights import HeightCells, RoofLevels, step_of
from cityflow.reconstruction.roof_types_parts.line_categories import Category, categorise
from cityflow.reconstruction.roof_types_parts.ortho_shift import rim_shift
from cityflow.reconstruction.roof_types_parts.outline_sides import fills, is_round, sides_of, whole_quad
from cityflow.reconstruction.roof_types_parts.regular_outline import RegularParameters, Rim, regular_outline
from cityflow.reconstruction.roof_types_parts.roof_lines import (
    LineParameters,
    RoofLines,
    merged,
    picture_lines,
    turn_between,
    without_duplicates,
)
from cityflow.reconstruction.roof_types_parts.roof_model import PlacedSkeleton, partition_of, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import fitted_heights, line_gain, misfit, noise_of
from cityflow.reconstruction.roof_types_parts.skeletons import (
    D0,
    R2,
    R3,
    S2,
    S3,
    Quad,
    Skeleton,
    ridge_heights,
    ridge_shape,
    skeleton_edges,
)
from cityflow.reconstruction.solids.assemble import assemble

NOWHERE = np.empty((0, 3))
LINES = LineParameters()


def lines(*ends: tuple[float, float, float, float]) -> RoofLines:
    return RoofLines(np.array(ends).reshape(-1, 2, 2), np.zeros(len(ends), np.int64))


def quad_of(outline: Polygon) -> Quad:
    return whole_quad(outline, sides_of(outline, 0.3))


def test_fragments_of_a_ridge_are_joined_and_others_not() -> None:
    joined = merged(lines((0, 0, 4, 0.1), (4.8, 0.1, 9, 0.0), (4.8, 1.5, 4.9, 5.0)))
    assert sorted(np.round(joined.length).tolist()) == [4.0, 9.0]


def test_gaps_and_turns_beyond_the_limits_stay() -> None:
    assert len(merged(lines((0, 0, 4, 0), (5.3, 0, 9, 0)))) == 2
    assert len(merged(lines((0, 0, 4, 0), (4.5, 0, 8, 0.8)))) == 2


def test_shorter_parallels_within_a_metre_go() -> None:
    kept = without_duplicates(lines((0, 0, 9, 0), (1, 0.7, 5, 0.7), (1, 1.2, 5, 1.2), (12, 0.5, 15, 0.5)))
    assert sorted(kept.length.tolist()) == [3.0, 4.0, 9.0]


def test_an_edge_in_a_picture_is_found_where_it_is() -> None:
    pixels = np.full((3, 60, 80), 90, np.uint8)
    pixels[:, 30:] = 150
    found = picture_lines(Picture(Grid(100.0, 215.0, 0.25, 60, 80), pixels), 0, box(104, 203, 116, 212), LINES)
    assert len(found) >= 1
    longest = found.ends[int(np.argmax(found.length))]
    assert np.allclose(longest[:, 1], 207.5, atol=0.1)
    assert found.length.max() > 11


def test_categories_of_a_hip_roof() -> None:
    found = lines((4, 4, 8, 4), (0.2, 0.2, 4, 4), (0, 0.3, 12, 0.3), (5, 1, 6.5, 3.2))
    z = np.array([[9.0, 9.0], [5.1, 9.0], [5.0, 5.2], [6.0, 6.0]])
    kinds = categorise(found, z, box(0, 0, 12, 8), RoofLevels(9.0, 5.0))
    assert kinds.category[:3].tolist() == [Category.RIDGE, Category.HIP, Category.EAVE]
    level_line_longer_than_allowed = kinds.category[3]
    assert level_line_longer_than_allowed == Category.OTHER


def test_without_heights_only_eaves_and_short_hips_are_told() -> None:
    found = lines((4, 4, 8, 4), (0.2, 0.2, 4, 4), (0, 0.3, 12, 0.3), (2, 2, 3.4, 3.4))
    kinds = categorise(found, np.full((4, 2), np.nan), box(0, 0, 12, 8), RoofLevels(9.0, 5.0))
    assert kinds.category.tolist() == [Category.OTHER, Category.OTHER, Category.EAVE, Category.HIP]


def test_valleys_lead_back_along_their_ridge() -> None:
    wing_ridge, valley = (6, 12, 6, 5), (6, 5, 8, 7.5)
    z = np.array([[8.0, 8.0], [8.0, 6.0]])
    outline = Polygon([(0, 0), (12, 0), (12, 7.5), (8, 7.5), (8, 14), (4, 14), (4, 7.5), (0, 7.5)])
    kinds = categorise(lines(wing_ridge, valley), z, outline, RoofLevels(8.5, 5.0))
    assert kinds.category.tolist() == [Category.RIDGE, Category.VALLEY]


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 180), st.floats(6, 20), st.floats(5, 12))
def test_a_turned_rectangle_is_one_part(angle: float, length: float, width: float) -> None:
    outline = rotate(box(0, 0, length, width), angle, origin=(3, 4))
    quad = quad_of(outline)
    assert fills(outline, quad) > 0.999
    assert sorted([quad.length, quad.width]) == pytest.approx(sorted([length, width]), abs=1e-6)


def test_an_l_has_a_main_part_and_a_wing() -> None:
    outline = rotate(Polygon([(0, 0), (16, 0), (16, 14), (10, 14), (10, 8), (0, 8)]), 25, origin=(0, 0))
    found = layouts(outline, sides_of(outline, 0.3), DecompositionParameters())
    assert len(found) == 2
    first = found[0]
    assert first.main.width * first.main.length == pytest.approx(128.0, rel=1e-3)
    assert [round(w.polygon.area) for w in first.wings] == [36]
    assert first.rest < 1e-3


def test_a_t_and_a_u() -> None:
    t = Polygon([(0, 0), (16, 0), (16, 8), (11, 8), (11, 13), (5, 13), (5, 8), (0, 8)])
    u = Polygon([(0, 0), (20, 0), (20, 16), (13, 16), (13, 7), (7, 7), (7, 16), (0, 16)])
    for outline, wings in ((t, 1), (u, 2)):
        found = layouts(outline, sides_of(outline, 0.3), DecompositionParameters())
        assert wings in [len(layout.wings) for layout in found]


def test_shape_of_a_hip_and_of_a_half_hip() -> None:
    quad = quad_of(box(0, 0, 12, 8))
    quad = quad if quad.length > quad.width else quad.turned()
    hip = ridge_shape(quad)
    hip[[R2, R3]], hip[[S2, S3]] = 4.0, 0.0
    xy = np.array([[6.0, 4.0], [4.0, 4.0], [2.0, 4.0], [6.0, 0.0], [0.0, 0.0], [6.0, 2.0]])
    assert ridge_heights(hip, quad.distances(xy)) == pytest.approx([1, 1, 0.5, 0, 0, 0.5])
    half = ridge_shape(quad)
    half[[R2, R3]], half[[S2, S3]] = 2.0, 0.5
    assert ridge_heights(half, quad.distances(np.array([[0.0, 4.0], [2.0, 4.0], [0.0, 1.0]]))) == pytest.approx(
        [0.5, 1, 0.25]
    )
    edges = skeleton_edges(hip, quad.sides)
    ridge = np.sort(edges[0].reshape(2, 2)[:, 0])
    assert ridge == pytest.approx([4.0, 8.0])
    assert len(edges) == 5


def around(roof: Polygon, cell: float = 0.5) -> HeightCells:
    """Cells of a level roof 6 m above its ground, a few metres around it."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(-4, 18, cell), np.arange(-4, 14, cell)))
    z = np.where(shapely.contains_xy(roof, x, y), 6.0, 0.0)
    return HeightCells(np.column_stack([x, y]), np.arange(len(x)), z, np.full(len(x), 0.3), cell)


def test_disturbed_sides_go_back_to_where_heights_fall() -> None:
    truth = box(0, 0, 14, 9)
    drawn = Polygon([(-0.6, -0.3), (14.5, 0.5), (13.6, 8.6), (0.4, 9.3)])
    found = regular_outline(drawn, sides_of(drawn, 0.3), Rim(around(truth), lines()), RegularParameters())
    assert found.symmetric_difference(truth).area < 0.5 * drawn.symmetric_difference(truth).area
    angles = sides_of(found, 0.1).angle % (math.pi / 2)
    assert np.ptp(np.cos(4 * angles)) < 1e-4


def test_lines_tell_of_sides_where_heights_do_not() -> None:
    drawn, nothing = Polygon([(-0.6, 0.7), (14.5, -0.3), (14.9, 9.8), (0.4, 9.3)]), around(box(-9, -9, 30, 30))
    rim = np.asarray(box(0, 0, 14, 9).exterior.coords)
    seen = RoofLines(np.stack([rim[:-1], rim[1:]], axis=1), np.zeros(4, np.int64))
    found = regular_outline(drawn, sides_of(drawn, 0.3), Rim(nothing, seen), RegularParameters())
    assert found.symmetric_difference(box(0, 0, 14, 9)).area < 0.3 * drawn.symmetric_difference(box(0, 0, 14, 9)).area


def test_regular_and_trusted_outlines_stay() -> None:
    elsewhere = Rim(around(box(1, 1, 14, 9)), lines())
    regular, skewed = box(0, 0, 14, 9), Polygon([(0, 0), (14, 0), (20, 9), (0, 9)])
    drawn = Polygon([(-0.6, 0.7), (14.5, -0.3), (14.9, 9.8), (0.4, 9.3)])
    assert regular_outline(regular, sides_of(regular, 0.3), elsewhere, RegularParameters()) is regular
    assert regular_outline(drawn, sides_of(drawn, 0.3), elsewhere, RegularParameters(outline_m=0)) is drawn
    kept = regular_outline(skewed, sides_of(skewed, 0.3), Rim(around(skewed), lines()), RegularParameters())
    slanting = turn_between(sides_of(kept, 0.1).angle, math.atan2(9, 6))
    assert float(slanting.min()) < 1e-4


def test_discs_drawn_badly_are_discs_again_and_dense_rectangles_are_none() -> None:
    rng = np.random.default_rng(5)
    turn = np.arange(24) * math.pi / 12
    drawn = Polygon(6 * np.column_stack([np.cos(turn), np.sin(turn)]) + rng.normal(0, 0.5, (24, 2)))
    found = regular_outline(drawn, sides_of(drawn, 0.3), Rim(around(drawn), lines()), RegularParameters())
    assert is_round(found, sides_of(found, 0.05))
    assert abs(math.sqrt(found.area / math.pi) - 6) < 0.3
    dense = shapely.segmentize(box(0, 0, 9, 9), 1.5)
    kept = regular_outline(dense, sides_of(dense, 0.3), Rim(around(dense), lines()), RegularParameters())
    assert not is_round(kept, sides_of(kept, 0.05))


def test_robust_fit_is_not_drawn_by_a_chimney() -> None:
    rng = np.random.default_rng(0)
    t = rng.uniform(0, 1, 100)
    z = 5 + 3 * t + rng.normal(0, 0.1, 100)
    z[:6] += 4
    _, eave, rise = fitted_heights(t, z, np.ones(100), 0.1, np.nan, 0.0)
    assert eave == pytest.approx(5, abs=0.1)
    assert rise == pytest.approx(3, abs=0.15)


def test_lines_speak_for_edges_along_them_only() -> None:
    edge = np.array([[0.0, 0.0, 8.0, 0.0]])
    assert line_gain(edge, np.array([[0.0, 0.1, 8.0, 0.1]])) > 0
    assert line_gain(edge, np.array([[0.0, 3.0, 8.0, 3.0]])) < 0
    assert line_gain(edge, np.array([[4.0, -4.0, 4.0, 4.0]])) < 0


def test_displacement_of_a_rim_and_its_overhang_are_told_apart() -> None:
    outline = box(0, 0, 12, 8)
    rim, shift = box(-0.4, -0.4, 12.4, 8.4), np.array([0.7, -0.35])
    ring = np.asarray(rim.exterior.coords)
    found = RoofLines(np.stack([ring[:-1], ring[1:]], axis=1) + shift, np.zeros(4, np.int64))
    assert rim_shift(found, sides_of(outline, 0.3)) == pytest.approx(shift, abs=0.1)


def test_round_outlines_are_known() -> None:
    disc = shapely.Point(0, 0).buffer(6, quad_segs=6)
    assert is_round(disc, sides_of(disc, 0.05))
    assert not is_round(box(0, 0, 9, 9), sides_of(box(0, 0, 9, 9), 0.05))


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-0.8, 0.8), min_size=8, max_size=8),
    st.floats(0.35, 0.65),
    st.sampled_from([RoofType.GABLE, RoofType.HIP, RoofType.HALF_HIP]),
)
def test_solids_over_skewed_outlines_are_valid(moves: list[float], at: float, kind: RoofType) -> None:
    corners = np.array([[0, 0], [13, 0], [13, 8], [0, 8]]) + np.round(np.array(moves).reshape(4, 2), 3)
    outline = Polygon(corners)
    quad = quad_of(outline)
    quad = quad if quad.length > quad.width else quad.turned()
    shape = ridge_shape(quad, at)
    if kind is not RoofType.GABLE:
        shape[[R2, R3]], shape[[S2, S3]] = 3.0, 0.0 if kind is RoofType.HIP else 0.5
    model = roof_model([PlacedSkeleton(Skeleton(kind, quad, shape, 5.0, 3.0), NOWHERE)])
    solid = assemble(partition_of(model, outline), model.planes, 0.0, (0.0, 0.0, 0.0), outline)
    assert not check_polyhedron(solid)
    assert math.isclose(shape[D0] + ridge_shape(quad, 1 - at)[D0], quad.width)


def test_few_coarse_heights_do_not_tell_their_noise() -> None:
    x, y = (v.ravel() for v in np.meshgrid(np.arange(4) * 2.0, np.arange(3) * 2.0))
    xy = np.column_stack([x, y])
    level = HeightCells(xy, np.arange(12), np.full(12, 6.0), np.ones(12), 2.0, 1.0)
    assert 0.3 < noise_of(level) < 0.45
    assert noise_of(replace(level, step=0.0)) < noise_of(level)


def test_steps_of_heights_are_recognised() -> None:
    rng = np.random.default_rng(1)
    z = rng.uniform(3, 9, 50)
    assert step_of(np.round(z)) == 1.0
    assert step_of(np.round(2 * z) / 2) == 0.5
    assert step_of(z) == 0.0


def test_what_stands_on_a_roof_is_spared_only_where_cells_are_fine() -> None:
    off = np.zeros(40)
    off[:3] = 6.0
    assert misfit(off, np.full(40, 0.5)) < 0.5 * 3 * 4.5
    assert misfit(off, np.ones(40)) == pytest.approx(3 * 4.5)
