from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree
from shapely import LineString, Polygon, affinity, box

from cityflow.geometry.ring_vertices import on_lattice
from cityflow.splitting.partition import IDLE, SLIVER, TOO_SMALL, Partition, partition

X0, Y0 = 450_000.123, 5_800_000.77


def _placed(shape: Polygon | LineString, degrees: float = 17.0) -> Polygon | LineString:
    turned = affinity.rotate(shape, degrees, origin=(0, 0))
    return shapely.transform(affinity.translate(turned, X0, Y0), on_lattice)


def _line(*points: tuple[float, float]) -> LineString:
    return _placed(LineString(points))


def _polygon(*points: tuple[float, float]) -> Polygon:
    return _placed(Polygon(points))


@pytest.fixture
def row() -> Polygon:
    """60 m × 10 m, turned by 17°."""
    return _placed(box(0, 0, 60, 10))


def _assert_sound(result: Partition, outline: Polygon) -> None:
    """Valid, on the lattice, exterior counter-clockwise, every common edge in both, the outline's vertices all there."""
    pieces = np.array([*result.units, *result.gaps], object)
    assert shapely.is_valid(pieces).all()
    assert all(p.exterior.is_ccw and not any(h.is_ccw for h in p.interiors) for p in pieces)
    xy = shapely.get_coordinates(pieces)
    assert (xy == on_lattice(xy)).all()
    edges = _directed_edges(pieces)
    assert len(set(edges)) == len(edges)
    lone = [(a, b) for a, b in edges if (b, a) not in set(edges)]
    # every edge that is not in two pieces lies on the outline, and together they are all of it
    assert sum(np.hypot(*np.subtract(a, b)) for a, b in lone) == pytest.approx(outline.length, abs=1e-5)
    # an edge near to parallel to an axis has no place of the lattice on it: half a step, over half the length
    assert shapely.area(pieces).sum() == pytest.approx(outline.area, rel=1e-6, abs=2.5e-5 * outline.length)
    assert {tuple(v) for v in shapely.get_coordinates(outline).tolist()} <= {tuple(v) for v in xy.tolist()}


def _directed_edges(polygons: np.ndarray) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    rings = [r.coords for p in polygons for r in (p.exterior, *p.interiors)]
    return [(a, b) for ring in rings for a, b in pairwise(ring)]


def _areas(result: Partition) -> list[float]:
    return [round(u.area, 1) for u in result.units]


def test_cuts_are_trimmed_and_extended_to_the_border(row: Polygon) -> None:
    result = partition(row, [_line((20, -0.3), (20, 9.8)), _line((40, 0.4), (40, 13.0))])
    _assert_sound(result, row)
    assert (_areas(result), result.used, result.dropped) == ([200.0, 200.0, 200.0], (0, 1), ())


def test_area_is_kept_to_a_millionth(row: Polygon) -> None:
    cuts = [_line((x, 0), (x, 10)) for x in (7.3, 15.1, 23.7, 31.9, 40.2, 51.0)]
    result = partition(row, cuts)
    assert len(result.units) == 7
    assert sum(u.area for u in result.units) == pytest.approx(row.area, rel=1e-6)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (((20, 0.6), (20, 9.4)), "ends inside"),
        (((20, 3), (20, 10)), "ends inside"),
        (((0, 0.005), (60, 0.005)), "runs along"),
        (((20, 20), (20, 30)), "lies outside"),
        (((20, 5), (20, 5)), "lies outside"),
        (((float("nan"), 5), (20, 5)), "lies outside"),
    ],
)
def test_a_line_that_is_no_cut_says_why(
    row: Polygon, line: tuple[tuple[float, float], tuple[float, float]], reason: str
) -> None:
    cut = LineString(line) if not np.isfinite(line).all() else _line(*line)
    result = partition(row, [cut])
    assert result.dropped[0][1].startswith(reason)
    assert result.units == (row,) or result.units[0].equals(row)


def test_cuts_end_on_cuts_whichever_is_the_stronger(row: Polygon) -> None:
    long = [_line((20, 0), (20, 10)), _line((40, 0), (40, 10))]
    between = _line((20.3, 5), (39.8, 5))
    for cuts in ([*long, between], [between, *long]):
        result = partition(row, cuts)
        _assert_sound(result, row)
        assert [u.area for u in result.units] == pytest.approx([200, 100, 100, 200], abs=0.1)


def test_ends_snap_to_vertices_that_are_there() -> None:
    outline = _polygon((0, 0), (20, 0), (20, 2), (40, 2), (40, 12), (20, 12), (20, 10), (0, 10))
    result = partition(outline, [_line((20.06, 2), (19.95, 10))])
    assert _areas(result) == [200.0, 200.0]
    assert len(shapely.get_coordinates(list(result.units))) == len(shapely.get_coordinates(outline)) + 3


def test_the_weakest_cut_of_a_piece_too_small_is_dropped(row: Polygon) -> None:
    strong, weak = _line((20, 0), (20, 10)), _line((21.5, 0), (21.5, 10))
    for cuts in ([strong, weak], [weak, strong]):
        result = partition(row, cuts)
        assert (result.used, result.dropped) == ((0,), ((1, TOO_SMALL),))
    assert partition(row, [strong, weak], minimum_area_m2=10).used == (0, 1)


def test_no_piece_is_too_small_for_a_drawn_cut(row: Polygon) -> None:
    found, drawn = _line((20, 0), (20, 10)), _line((21.5, 0), (21.5, 10))
    assert partition(row, [drawn, found], drawn=1).used == (0,)
    assert partition(row, [drawn, found], drawn=2).used == (0, 1)
    assert _areas(partition(row, [_line((58.8, 0), (58.8, 10))], drawn=1)) == [588.0, 12.0]


def test_slivers_go() -> None:
    outline = _polygon((0, 0), (80, 0), (80, 10), (0, 10))
    result = partition(outline, [_line((0, 9.3), (80, 9.3))])
    assert result.used == ()
    assert result.dropped[0][1] == SLIVER


def test_crossing_cuts_share_their_crossing(row: Polygon) -> None:
    result = partition(row, [_line((10, 0), (50, 10)), _line((10, 10), (50, 0))])
    _assert_sound(result, row)
    assert len(result.units) == 4
    common = set.intersection(*({tuple(v) for v in shapely.get_coordinates(u).tolist()} for u in result.units))
    assert len(common) == 1


def test_a_ring_needs_two_cuts() -> None:
    ring = _placed(Polygon(box(0, 0, 50, 50).exterior, [box(10, 10, 40, 40).exterior]))
    west, south = _line((0, 20), (10, 20)), _line((20, 0), (20, 10))
    assert partition(ring, [west]).dropped == ((0, IDLE),)
    result = partition(ring, [west, south])
    _assert_sound(result, ring)
    assert (_areas(result), result.used) == ([300.0, 1300.0], (0, 1))


def test_a_cut_across_a_courtyard_counts_in_both_wings() -> None:
    ring = _placed(Polygon(box(0, 0, 50, 50).exterior, [box(10, 10, 40, 40).exterior]))
    result = partition(ring, [_line((0, 25), (50, 25))])
    assert (_areas(result), result.used) == ([800.0, 800.0], (0,))


def test_gaps_are_taken_out(row: Polygon) -> None:
    gap = _polygon((30, 0.2), (32, 0.2), (32, 9.7), (30, 9.7))
    result = partition(row, [_line((15, 0), (15, 10))], [gap])
    _assert_sound(result, row)
    assert (_areas(result), [round(g.area, 1) for g in result.gaps]) == ([150.0, 150.0, 280.0], [20.0])


def test_a_gap_that_cuts_off_too_little_stays_filled(row: Polygon) -> None:
    result = partition(row, [], [_polygon((57, 0), (59, 0), (59, 10), (57, 10)), box(0, 0, 1, 1)])
    assert (len(result.units), result.gaps) == (1, ())
    assert [i for i, _ in result.gaps_dropped] == [0, 1]


def test_the_same_whatever_the_direction_of_lines_and_rings(row: Polygon) -> None:
    cuts = [_line((20, 0), (20, 10)), _line((41, 0.2), (40, 9.9))]
    other = Polygon(np.roll(shapely.get_coordinates(row)[:-1][::-1], 2, axis=0))
    a, b = partition(row, cuts), partition(other, [shapely.reverse(c) for c in cuts])
    assert [shapely.normalize(u).wkb for u in a.units] == [shapely.normalize(u).wkb for u in b.units]


def test_nothing_to_cut() -> None:
    assert partition(Polygon(), [LineString([(0, 0), (1, 1)])]).dropped == ((0, "the outline has no area"),)
    spike = Polygon([(0, 0), (10, 0), (10, 10), (10, 30), (10, 10), (0, 10)])
    assert _areas(partition(spike, [LineString([(5, 0), (5, 10)])])) == [50.0, 50.0]


def _random_outline(g: np.random.Generator) -> Polygon:
    kind = g.integers(4)
    if kind == 0:
        corners = g.uniform(-25, 25, (int(g.integers(1, 7)), 2))
        boxes = [box(x, y, x + g.uniform(3, 40), y + g.uniform(3, 20)) for x, y in corners]
        turned = [affinity.rotate(b, g.choice([0, 0, 0, g.uniform(0, 90)]), origin=(0, 0)) for b in boxes]
        shape = max(shapely.get_parts(shapely.union_all(turned)), key=lambda p: p.area)
    elif kind == 1:
        t = np.linspace(0, 2 * np.pi, int(g.integers(20, 1500)), endpoint=False)
        r = 25 + g.uniform(0, 3) * np.sin(g.integers(2, 30) * t) + g.normal(0, 0.02, len(t))
        wave = np.column_stack([r * np.cos(t), r * np.sin(t)])
        shape = Polygon(wave, [0.6 * wave] if g.random() < 0.6 else [])
    elif kind == 2:
        courts = [box(x, y, x + 8, y + 9) for x, y in ((8, 8), (30, 8), (8, 22), (45, 20))][: int(g.integers(1, 5))]
        touching = Polygon([(30, 40), (27, 34), (33, 34)])
        shape = affinity.rotate(
            shapely.difference(box(0, 0, 60, 40), shapely.union_all([*courts, touching])), g.uniform(0, 90)
        )
    else:
        t = np.sort(g.uniform(0, 2 * np.pi, int(g.integers(5, 40))))
        r = g.uniform(1, 30, len(t))
        shape = Polygon(np.column_stack([r * np.cos(t), r * np.sin(t)]))
    moved = affinity.translate(shape, *g.uniform((8e4, 4e5), (5e5, 5.9e6)))
    return shapely.transform(moved, on_lattice)


def _random_cuts(outline: Polygon, g: np.random.Generator) -> list[LineString]:
    x_min, y_min, x_max, y_max = outline.bounds
    vertices = shapely.get_coordinates(outline)
    border = shapely.get_coordinates(shapely.segmentize(outline.boundary, 1.0))
    cuts: list[LineString] = []
    for _ in range(int(g.integers(0, 12))):
        kind = g.integers(4)
        if kind == 0:
            ends = g.uniform((x_min - 5, y_min - 5), (x_max + 5, y_max + 5), (2, 2))
        elif kind == 1 and cuts:
            ends = shapely.get_coordinates(cuts[-1]) + g.normal(0, 0.05, (2, 2))
        elif kind == 2:
            ends = vertices[g.integers(len(vertices), size=2)]
        else:
            ends = border[g.integers(len(border), size=2)] + g.normal(0, 0.1, (2, 2))
        cuts.append(LineString(ends))
    return cuts


def _random_gaps(outline: Polygon, g: np.random.Generator) -> list[Polygon]:
    border = shapely.get_coordinates(shapely.segmentize(outline.boundary, 1.0))
    ends = [border[g.integers(len(border), size=2)] for _ in range(int(g.integers(0, 3)))]
    style = str(g.choice(["flat", "square", "round"]))
    return [LineString(e).buffer(g.uniform(0.05, 3), cap_style=style) for e in ends if (e[0] != e[1]).any()]


@pytest.mark.parametrize("seed", range(60))
def test_any_outline_any_cuts_any_gaps(seed: int) -> None:
    g = np.random.default_rng(seed)
    outline = _random_outline(g)
    cuts, gaps = _random_cuts(outline, g), _random_gaps(outline, g)
    result = partition(outline, cuts, gaps)
    assert sorted([*result.used, *(i for i, _ in result.dropped)]) == list(range(len(cuts)))
    assert all(reason for _, reason in (*result.dropped, *result.gaps_dropped))
    if len(result.units) > 1:
        assert min(u.area for u in result.units) >= 20
    if outline.is_valid:
        _assert_sound(result, outline)
    if outline.is_valid and not gaps:
        _assert_no_vertices_side_by_side(result, outline)


def _assert_no_vertices_side_by_side(result: Partition, outline: Polygon) -> None:
    """A new vertex is nowhere nearer than a centimetre to another one: walls that narrow break solids."""
    places = np.array(sorted({tuple(v) for v in shapely.get_coordinates(list(result.units)).tolist()}))
    given = {tuple(v) for v in shapely.get_coordinates(outline).tolist()}
    new = np.array([tuple(v) not in given for v in places.tolist()])
    assert not new[cKDTree(places).query_pairs(0.01, output_type="ndarray")].any()


def test_an_outline_that_rounding_parts_at_a_vertex_keeps_its_units() -> None:
    """A notch that comes within less than the lattice of the wall opposite: on the lattice they touch, and two polygons are left."""
    outline = Polygon([(0, 0), (40, 0), (40, 10), (20.1, 10), (20.00002, 0.00003), (19.9, 10), (0, 10)])
    assert outline.is_valid
    result = partition(outline, [LineString([(8, 0), (8, 10)]), LineString([(30, 0), (30, 10)])], minimum_area_m2=20.0)
    assert [round(u.area) for u in result.units] == [80, 120, 100, 100]
    assert shapely.is_valid(np.array(result.units, object)).all()
