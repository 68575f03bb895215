"""Footprints from walls and roofs: places with known walls, each line of which is known exactly."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon, affinity, box

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.core.points import HIGH_VEGETATION
from cityflow.outlines import find_outlines as finding
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.from_walls.wall_line import WallLine

CELL = 0.4
GRID = Grid.covering((85000.0, 447000.0, 85060.0, 447060.0), CELL)
SOME_WALL_POINT = WallPoints(
    np.array([[85000.0, 447000.0, 1.0]]), np.array([[1, 0]], np.float32), np.ones(1, np.float32), np.ones(1, np.uint8)
)


def surface_of(parts: list[tuple[Polygon, float]], green: Polygon | None = None) -> RegionSurface:
    """Level roofs of given heights; cells hold the height at their middle."""
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    ndsm = np.zeros(GRID.shape, np.float32)
    for polygon, height in parts:
        ndsm = np.where(shapely.contains_xy(polygon, x, y), np.maximum(ndsm, height), ndsm).astype(np.float32)
    klass = np.where(ndsm > 2, 6, 2).astype(np.uint8)
    if green is not None:
        leaves = shapely.contains_xy(green, x, y)
        rough = np.random.default_rng(1).uniform(3, 9, GRID.shape)
        ndsm = np.where(leaves, np.maximum(rough, ndsm), ndsm).astype(np.float32)
        klass[leaves] = HIGH_VEGETATION
    none = np.zeros(GRID.shape, bool)
    dtm = np.full(GRID.shape, 10.0, np.float32)
    return RegionSurface(GRID, ndsm, klass, none, None, None, SOME_WALL_POINT, dtm, highest=False)


def wall(a: tuple[float, float], b: tuple[float, float], low: float = 0.2, high: float = 6.0) -> WallLine:
    """A wall with the building on the left, seen from `low` to `high` above the terrain."""
    along = np.subtract(b, a) / np.hypot(*np.subtract(b, a))
    normal = np.array([along[1], -along[0]])
    return WallLine(LineString([a, b]), normal, 0.02, 0.9, 10.0 + low, 10.0 + high, 300, ground_z=10.0)


def walls_of(polygon: Polygon, cut_m: float = 0.3) -> list[WallLine]:
    """All walls of a polygon, each somewhat short of its corners."""
    found = []
    for ring in (shapely.orient_polygons(polygon).exterior, *shapely.orient_polygons(polygon).interiors):
        xy = shapely.get_coordinates(ring)
        for a, b in pairwise(xy):
            d = (b - a) / np.hypot(*(b - a)) * cut_m
            found.append(wall(tuple(a + d), tuple(b - d)))
    return found


def outlines_of(surface: RegionSurface, walls: list[WallLine], monkeypatch: pytest.MonkeyPatch) -> list[Outline]:
    monkeypatch.setattr(finding, "find_wall_lines", lambda *_: walls)
    return find_outlines(surface, FindParameters())


def placed(shape: Polygon, angle: float = 0.0) -> Polygon:
    return affinity.translate(affinity.rotate(shape, angle, origin=(0, 0)), 85025, 447020)


def corners(polygon: Polygon) -> FloatArray:
    return np.asarray(shapely.get_coordinates(polygon)[:-1])


def off_m(found: Polygon, true: Polygon) -> float:
    """Farthest distance of a corner of either polygon from the nearest of the other."""
    a, b = shapely.multipoints(corners(found)), shapely.multipoints(corners(true))
    return float(shapely.hausdorff_distance(a, b))


@pytest.mark.parametrize("angle", [0, 17, 40])
def test_walls_under_eaves_become_the_outline_and_the_roof_stays(angle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(Polygon([(0, 0), (14, 0), (14, 6), (8, 6), (8, 12), (0, 12)]), angle)
    roof = shapely.buffer(walls, 0.7, join_style="mitre")
    (found,) = outlines_of(surface_of([(roof, 6.0)]), walls_of(walls), monkeypatch)
    assert off_m(found.polygon, walls) < 0.05
    assert found.roof is not None
    assert shapely.symmetric_difference(found.roof, roof).area < 0.1 * roof.area
    assert [e.source for e in found.edges] == ["wall"] * 6
    assert all(e.seen > 0.7 and e.sigma_m == pytest.approx(0.02) for e in found.edges)
    joined = shapely.get_coordinates([e.line for e in found.edges]).reshape(-1, 4)
    assert np.array_equal(joined[:, 2:], np.roll(joined[:, :2], -1, axis=0))


def test_the_roof_stands_in_where_no_facade_was_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(box(0, 0, 14, 9))
    roof = shapely.buffer(walls, 0.6, join_style="mitre")
    seen = [w for w in walls_of(walls) if abs(w.normal[1] - 1) > 0.1]
    (found,) = outlines_of(surface_of([(roof, 6.0)]), seen, monkeypatch)
    sources = sorted(e.source for e in found.edges)
    assert sources == ["roof", "wall", "wall", "wall"]
    (roof_edge,) = (e for e in found.edges if e.source == "roof")
    assert roof_edge.line.centroid.y == pytest.approx(447020 + 9.6, abs=0.25)
    assert 0 < roof_edge.sigma_m < 0.3


def test_a_short_wall_that_is_seen_askew_does_not_cut_through_the_far_end_of_its_roof(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two metres at one end of a row of garages, 7° off; of the rest of that front nothing is seen."""
    walls = placed(box(0, 0, 16, 6))
    front = affinity.rotate(LineString([(85038.4, 447020), (85040.7, 447020)]), -7.0)
    (west, at_west), (east, at_east) = shapely.get_coordinates(front).tolist()
    seen = [w for w in walls_of(walls) if w.normal[0] > 0.5 or w.normal[1] > 0.5]
    seen.append(wall((west, at_west), (east, at_east), high=2.3))
    (found,) = outlines_of(surface_of([(walls, 2.5)]), seen, monkeypatch)
    assert found.polygon.intersection(walls).area / found.polygon.union(walls).area > 0.95


def test_a_wall_above_a_lower_roof_is_an_inner_edge(monkeypatch: pytest.MonkeyPatch) -> None:
    high, low = placed(box(0, 0, 12, 9)), placed(box(11.5, 1, 20, 8))
    inner = wall((85037, 447021.2), (85037, 447027.8), low=3.3, high=8.0)
    outer = [w for w in walls_of(shapely.union(high, low)) if w.line.length > 2]
    (found,) = outlines_of(surface_of([(high, 8.0), (low, 3.0)]), [*outer, inner], monkeypatch)
    assert off_m(found.polygon, shapely.union(high, low)) < 0.35
    (edge,) = found.inner_edges
    assert edge.line.length == pytest.approx(6.6, abs=0.1)


def test_a_courtyard_is_a_hole_where_its_walls_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(Polygon(box(0, 0, 26, 24).exterior, [box(8, 7, 18, 16).exterior]), 12)
    roof = shapely.buffer(walls, 0.5, join_style="mitre")
    (found,) = outlines_of(surface_of([(roof, 9.0)]), walls_of(walls), monkeypatch)
    assert len(found.polygon.interiors) == 1
    assert off_m(found.polygon, walls) < 0.05


def unseen(surface: RegionSurface, place: Polygon) -> RegionSurface:
    """The surface with a hole, over which the terrain goes on; but for two lone squares that are false ground."""
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    hole = shapely.contains_xy(place, x, y)
    middle = place.centroid
    false = [box(middle.x + dx, middle.y, middle.x + dx + 1.6, middle.y + 1.6) for dx in (-4.0, 1.0)]
    ndsm = np.where(hole, 0.0, surface.ndsm).astype(np.float32)
    klass = np.where(hole, 2, surface.klass).astype(np.uint8)
    return replace(surface, ndsm=ndsm, klass=klass, holes=hole & ~shapely.contains_xy(shapely.union_all(false), x, y))


@pytest.mark.parametrize("angle", [0, 31])
def test_walls_close_a_tower_whose_roof_is_mostly_a_hole(angle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(box(0, 0, 15, 14), angle)
    surface = unseen(surface_of([(walls, 30.0)]), placed(box(0, 0, 10, 14), angle))
    (found,) = outlines_of(surface, walls_of(walls), monkeypatch)
    assert off_m(found.polygon, walls) < 0.05


def test_a_hole_behind_a_building_is_none_of_it_where_no_wall_stands_beyond(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(box(0, 0, 10, 14))
    seen = [w for w in walls_of(walls) if w.normal[0] < 0.5]
    (found,) = outlines_of(unseen(surface_of([(walls, 30.0)]), placed(box(10, 0, 16, 14))), seen, monkeypatch)
    assert found.polygon.intersection(walls).area / found.polygon.union(walls).area > 0.95


def test_a_yard_that_nobody_sees_is_of_neither_building_whose_walls_look_into_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    west, east = placed(box(0, 0, 8, 14)), placed(box(13, 0, 21, 14))
    surface = unseen(surface_of([(west, 20.0), (east, 20.0)]), placed(box(8, 0, 13, 14)))
    found = outlines_of(surface, [*walls_of(west), *walls_of(east)], monkeypatch)
    assert sorted(round(o.polygon.area) for o in found) == [112, 112]


def test_walls_that_face_each_other_part_two_buildings(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = placed(box(0, 0, 10, 9)), placed(box(11.2, 0, 22, 9))
    bridged = surface_of([(placed(box(0, 0, 22, 9)), 6.0)])
    found = outlines_of(bridged, [*walls_of(one), *walls_of(other)], monkeypatch)
    assert len(found) == 2
    assert max(off_m(f.polygon, t) for f, t in zip(found, (one, other), strict=True)) < 0.05


def test_a_tree_against_a_wall_is_no_building(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(box(0, 0, 14, 9))
    tree = shapely.Point(85042, 447024).buffer(3.5)
    surface = surface_of([(walls, 6.0)], green=tree)
    seen_as_roof = replace(surface, klass=np.where(surface.klass == HIGH_VEGETATION, 6, surface.klass).astype(np.uint8))
    found = outlines_of(seen_as_roof, walls_of(walls), monkeypatch)
    assert len(found) == 1
    assert off_m(found[0].polygon, walls) < 0.05


def test_walls_close_a_building_whose_roof_is_lost_under_trees(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(box(0, 0, 11, 8), 20)
    surface = surface_of([], green=shapely.buffer(walls, 2))
    (found,) = outlines_of(surface, walls_of(walls), monkeypatch)
    assert off_m(found.polygon, walls) < 0.05
    assert found.remark == "walls alone"
    assert not outlines_of(surface, walls_of(walls)[:2], monkeypatch)


def test_round_walls_stay_round(monkeypatch: pytest.MonkeyPatch) -> None:
    angle = np.linspace(0, 2 * np.pi, 33)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * 8 + (85030, 447030)
    roof = shapely.buffer(Polygon(ring), 0.5)
    curves = [
        WallLine(LineString(part), np.array([1.0, 0.0]), 0.02, 1.0, 10.2, 16.0, 500, "curve", 10.0)
        for part in (ring[:17], ring[16:])
    ]
    (found,) = outlines_of(surface_of([(roof, 6.0)]), curves, monkeypatch)
    assert shapely.hausdorff_distance(found.polygon.boundary, Polygon(ring).boundary) < 0.1


def test_a_small_step_between_walls_is_kept_and_a_tiny_one_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    for step, count in ((0.6, 6), (0.08, 4)):
        walls = placed(Polygon([(0, 0), (9, 0), (9, step), (18, step), (18, 9), (0, 9)]))
        seen = [w for w in walls_of(walls, 0.1 if step > 0.3 else 0.02) if w.line.length > 1]
        (found,) = outlines_of(surface_of([(walls, 6.0)]), seen, monkeypatch)
        assert len(corners(found.polygon)) == count


@pytest.mark.parametrize("seed", range(4))
def test_any_walls_give_valid_polygons(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    lines = []
    for _ in range(40):
        a = rng.uniform((84990, 446990), (85070, 447070))
        turn, length = rng.uniform(0, 2 * np.pi), float(rng.choice([0.001, 1, 5, 30]))
        lines.append(wall(tuple(a), tuple(a + length * np.array([np.cos(turn), np.sin(turn)])), rng.uniform(0, 5)))
    surface = surface_of(
        [(shapely.Point(p).buffer(6), 5.0) for p in rng.uniform((85000, 447000), (85060, 447060), (8, 2))]
    )
    noisy = replace(surface, ndsm=surface.ndsm + rng.normal(0, 0.3, GRID.shape).astype(np.float32))
    case = noisy if seed % 2 else replace(noisy, dtm=None)
    for found in outlines_of(case, [*lines, lines[0]], monkeypatch):
        assert found.polygon.is_valid
        assert found.polygon.area > 0
        assert len(found.edges) == sum(len(r.coords) - 1 for r in (found.polygon.exterior, *found.polygon.interiors))


def test_the_same_walls_in_another_window_give_the_same_outline(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = placed(box(0, 0, 14, 9), 25)
    whole = surface_of([(shapely.buffer(walls, 0.5, join_style="mitre"), 6.0)])
    cut = Grid(GRID.x_min + 12 * CELL, GRID.y_max - 20 * CELL, CELL, GRID.rows - 30, GRID.cols - 25)
    rows, cols = GRID.slices(cut)
    part = RegionSurface(
        cut, whole.ndsm[rows, cols], whole.klass[rows, cols], whole.holes[rows, cols], None, None, whole.walls,
        None if whole.dtm is None else whole.dtm[rows, cols], highest=False,
    )  # fmt: skip
    (a,), (b,) = (outlines_of(s, walls_of(walls), monkeypatch) for s in (whole, part))
    assert a.id == b.id
    assert shapely.hausdorff_distance(a.polygon, b.polygon) < 1e-3


def bridged(surface: RegionSurface, gap: Polygon, height: float, share: float) -> RegionSurface:
    """A gap as matching leaves it: that share of its cells, in patches of a metre, at the height of the roofs."""
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    patch = np.random.default_rng(2).random((60, 60))[(y - GRID.y_max).astype(int), (x - GRID.x_min).astype(int)]
    ndsm = np.where(shapely.contains_xy(gap, x, y) & (patch < share), height, surface.ndsm).astype(np.float32)
    return replace(surface, ndsm=ndsm, klass=np.where(ndsm > 2, 6, 2).astype(np.uint8))


@pytest.mark.parametrize("share", [0.4, 0.5])
def test_blocks_a_metre_apart_are_two_where_the_gap_is_bridged_in_patches(
    share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody sees the walls in the gap; fronts and backs end before it."""
    x, y = GRID.bounds[0], GRID.bounds[1]
    blocks = [box(x + 10, y + 20, x + 26, y + 32), box(x + 26.8, y + 20, x + 44, y + 32)]
    gap = box(x + 26, y + 20, x + 26.8, y + 32)
    surface = bridged(surface_of([(b, 6.0) for b in blocks]), gap, 6.0, share)
    walls = [w for b in blocks for w in walls_of(b) if shapely.distance(w.line.centroid, gap) > 2]
    found = [o.polygon for o in outlines_of(surface, walls, monkeypatch)]
    assert len(found) == 2
    for block in blocks:
        nearest = max(found, key=lambda p: p.intersection(block).area)
        assert nearest.intersection(block).area / nearest.union(block).area > 0.93


def test_a_block_without_a_gap_stays_one_though_its_facade_is_seen_in_two_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    x, y = GRID.bounds[0], GRID.bounds[1]
    whole, halves = box(x + 10, y + 20, x + 44, y + 32), [
        box(x + 10, y + 20, x + 26, y + 32), box(x + 27, y + 20, x + 44, y + 32)
    ]  # fmt: skip
    gap = box(x + 26, y + 20, x + 27, y + 32)
    walls = [w for b in halves for w in walls_of(b) if shapely.distance(w.line.centroid, gap) > 2]
    assert len(outlines_of(surface_of([(whole, 6.0)]), walls, monkeypatch)) == 1
