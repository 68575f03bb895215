"""Rims found in drawn surfaces: sub-pixel, per edge, none where there is none."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
import shapely.affinity
from shapely import LineString, Polygon
from shapely.geometry.polygon import orient

from cityflow.core.building import OutlineEdge, Polyhedron
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud, concatenate
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster, Picture
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.overhang_solid import with_overhangs
from cityflow.reconstruction.overhangs.rim_search import find_overhangs

FLOOR, TOP = 10.0, 15.0
HOUSE = shapely.affinity.rotate(shapely.box(1005.0, 2005.0, 1015.0, 2013.0), 17.0, origin="centroid")
FRAME = (1000.0, 1999.0, 1020.0, 2019.0)


def moved_out(outline: Polygon, reaches: list[float]) -> Polygon:
    """The outline (convex, counter-clockwise) with each edge moved out by its own reach."""
    half_planes = outline.buffer(3.0, join_style="mitre")
    xy = shapely.get_coordinates(outline.exterior)
    for a, b, reach in zip(xy[:-1], xy[1:], reaches, strict=True):
        along = (b - a) / np.hypot(*(b - a))
        out = np.array([along[1], -along[0]])
        p, q = a + reach * out - 50 * along, b + reach * out + 50 * along
        half_planes = half_planes.intersection(Polygon([p, q, q - 100 * out, p - 100 * out]))
    return half_planes


def surface(roof: Polygon, cell: float, noise: float = 0.0, seed: int = 0) -> HeightRaster:
    """Ground with a flat roof over it; every cell holds the mean over its area."""
    fine = 5
    grid = Grid.covering(FRAME, cell)
    small = Grid(grid.x_min, grid.y_max, cell / fine, grid.rows * fine, grid.cols * fine)
    x, y = np.meshgrid(small.x_centres(), small.y_centres())
    z = np.where(shapely.contains_xy(roof, x, y), TOP, FLOOR)
    dsm = z.reshape(grid.rows, fine, grid.cols, fine).mean(axis=(1, 3))
    dsm += np.random.default_rng(seed).normal(0.0, noise, dsm.shape)
    return HeightRaster(grid, dsm, np.full(dsm.shape, FLOOR))


def model(outline: Polygon = HOUSE) -> Candidate:
    solid: Polyhedron = extrude(outline, FLOOR, TOP)
    return Candidate("extruded", solid)


def evidence(heights: HeightRaster | None, **more: object) -> Evidence:
    """Of an outline that was surveyed, unless `more` says otherwise."""
    known = {"edges": said_of(HOUSE, 0.03), **more}
    return Evidence("u", HOUSE, PointCloud.empty(), FLOOR, heights=heights, **known)  # type: ignore[arg-type]


def said_of(outline: Polygon, sigma_m: float) -> tuple[OutlineEdge, ...]:
    xy = shapely.get_coordinates(outline.exterior)
    return tuple(OutlineEdge(LineString(p), "given", sigma_m) for p in itertools.pairwise(xy))


def scanned(roof: Polygon, seed: int = 5) -> PointCloud:
    """Ten echoes a square metre of a flat roof."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(FRAME[0], FRAME[2], 4000), rng.uniform(FRAME[1], FRAME[3], 4000)
    on = shapely.contains_xy(roof, x, y)
    return PointCloud.of(np.column_stack([x[on], y[on], TOP + rng.normal(0, 0.02, np.count_nonzero(on))]), 6)


def echoes(house: Polygon) -> PointCloud:
    """A dozen echoes on each wall, all over its height."""
    xy = shapely.get_coordinates(house.exterior)
    share, height = np.linspace(0.05, 0.95, 12)[:, None], FLOOR + 0.8 + 0.5 * (np.arange(12) % 4)
    walls = [np.column_stack([a + share * (b - a), height]) for a, b in itertools.pairwise(xy)]
    return PointCloud.of(np.concatenate(walls), 1)


def reaches(found: tuple[object, ...]) -> list[float]:
    return [o.reach_m for o in found]  # type: ignore[attr-defined]


def facades(house: Polygon) -> WallPoints:
    """80 points on each wall, 1.5 to 3 m above the floor."""
    parts = []
    for a, b in itertools.pairwise(shapely.get_coordinates(house.exterior)):
        along = (b - a) / np.hypot(*(b - a))
        place = a + np.linspace(0.05, 0.95, 80)[:, None] * (b - a)
        height = FLOOR + 1.5 + 0.5 * (np.arange(80) % 4)
        parts.append((np.column_stack([place, height]), np.tile([along[1], -along[0]], (80, 1))))
    return WallPoints(
        np.concatenate([p for p, _ in parts]), np.concatenate([n for _, n in parts]).astype(np.float32),
        np.full(320, 0.05, np.float32), np.full(320, 3, np.uint8),
    )  # fmt: skip


@pytest.mark.parametrize("cell", [0.05, 0.08, 0.2])
@pytest.mark.parametrize("seed", [1, 2])
def test_each_edge_has_its_own_reach(cell: float, seed: int) -> None:
    true = [float(r) for r in np.random.default_rng(seed).uniform(0.5, 1.0, 4)]
    found = find_overhangs(evidence(surface(moved_out(HOUSE, true), cell, 0.02, seed)), model())
    assert np.abs(np.subtract(reaches(found), true)).max() < 0.35 * cell
    assert all(o.seen > 0.8 and 0 < o.sigma_m < 1.5 * cell for o in found)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_overhang_where_there_is_none(seed: int) -> None:
    found = find_overhangs(evidence(surface(HOUSE, 0.08, 0.03, seed)), model())
    assert reaches(found) == [0.0] * 4
    assert all(o.seen > 0.8 and np.isfinite(o.sigma_m) for o in found)


def test_lines_run_with_the_outline_and_have_the_outside_on_the_right() -> None:
    found = find_overhangs(evidence(surface(moved_out(HOUSE, [0.5] * 4), 0.1)), model())
    for overhang in found:
        (x0, y0), (x1, y1) = overhang.line.coords[0], overhang.line.coords[-1]
        right = shapely.Point((x0 + x1) / 2 + 0.1 * (y1 - y0), (y0 + y1) / 2 - 0.1 * (x1 - x0))
        assert not HOUSE.contains(right)
    assert sum(o.line.length for o in found) == pytest.approx(HOUSE.exterior.length)


def test_shared_walls_have_none() -> None:
    xy = shapely.get_coordinates(HOUSE.exterior)
    party = (LineString(xy[1:3]),)
    found = find_overhangs(evidence(surface(moved_out(HOUSE, [0.6] * 4), 0.08), party=party), model())
    shared = [o.reach_m for o in found if shapely.dwithin(o.line.interpolate(0.5, normalized=True), party[0], 0.01)]
    assert shared == [0.0]
    assert sum(r > 0 for r in reaches(found)) == 3


def test_what_stands_as_high_beside_a_wall_hides_its_rim() -> None:
    heights = surface(moved_out(HOUSE, [0.6] * 4), 0.08)
    xy = shapely.get_coordinates(HOUSE.exterior)
    beside = LineString(xy[1:3]).buffer(3.0)
    x, y = np.meshgrid(heights.grid.x_centres(), heights.grid.y_centres())
    heights.dsm[shapely.contains_xy(beside, x, y)] = TOP
    found = find_overhangs(evidence(heights), model())
    hidden = [o for o in found if shapely.dwithin(o.line.interpolate(0.5, normalized=True), LineString(xy[1:3]), 0.01)]
    assert hidden[0].reach_m == 0.0
    assert hidden[0].seen < 0.3


def test_holes_below_a_rim_are_low() -> None:
    heights = surface(moved_out(HOUSE, [0.6] * 4), 0.08)
    gone = np.random.default_rng(4).random(heights.dsm.shape) < 0.3
    heights.dsm[gone & (heights.dsm < TOP - 1.0)] = np.nan
    found = find_overhangs(evidence(heights), model())
    assert np.abs(np.array(reaches(found)) - 0.6).max() < 0.05


def test_a_wall_that_is_badly_known_needs_a_wider_overhang() -> None:
    heights = surface(moved_out(HOUSE, [0.3] * 4), 0.08)
    badly = said_of(HOUSE, 0.3)
    assert min(reaches(find_overhangs(evidence(heights), model()))) > 0.2
    assert reaches(find_overhangs(evidence(heights, edges=badly), model())) == [0.0] * 4


def test_facades_tell_an_outline_that_is_too_small_from_an_overhang() -> None:
    """The true house is 0.25 m larger all round than the outline, and its roof ends with its walls."""
    house = orient(moved_out(HOUSE, [0.25] * 4))
    walls = facades(house)
    heights = surface(house, 0.08)
    assert min(reaches(find_overhangs(evidence(heights), model()))) > 0.15
    assert reaches(find_overhangs(evidence(heights, walls=walls, edges=()), model())) == [0.0] * 4


def test_colours_sharpen_a_rim_that_matching_has_widened() -> None:
    """Heights show the roof 1.5 cells too wide, colours where it ends."""
    cell, true = 0.08, 0.6
    heights = surface(moved_out(HOUSE, [true + 1.5 * cell] * 4), cell)
    roof = moved_out(HOUSE, [true] * 4)
    x, y = np.meshgrid(heights.grid.x_centres(), heights.grid.y_centres())
    grey = np.where(shapely.contains_xy(roof, x, y), 150, 90).astype(np.uint8)
    picture = Picture(heights.grid, np.stack([grey, grey, grey]))
    alone = np.array(reaches(find_overhangs(evidence(heights), model()))) - true
    both = np.array(reaches(find_overhangs(evidence(heights, pictures=(picture,)), model()))) - true
    assert np.all(np.abs(both) < 0.7 * np.abs(alone))


@pytest.mark.parametrize("reach", [0.0, 0.5])
def test_points_tell_where_cells_are_coarse(reach: float) -> None:
    roof = moved_out(HOUSE, [max(reach, 1e-6)] * 4)
    cloud = scanned(roof)
    found = find_overhangs(evidence(surface(roof, 0.5), around=cloud), model())
    assert np.abs(np.array(reaches(found)) - reach).max() < 0.12
    fine = find_overhangs(evidence(surface(roof, 0.05)), model())
    assert min(o.sigma_m for o in found) > max(o.sigma_m for o in fine)


@pytest.mark.parametrize("shift", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_outline_that_is_off_makes_no_overhang(shift: float, seed: int) -> None:
    """Nothing is said of it; the roof ends with the true walls, on one side beyond the outline and on the other short of it."""
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    house = shapely.affinity.translate(HOUSE, shift * np.cos(angle), shift * np.sin(angle))
    found = find_overhangs(evidence(None, around=scanned(house, seed), edges=()), model())
    assert reaches(found) == [0.0] * 4
    assert max(o.sigma_m for o in found) > 0.6 * shift


def test_an_outline_of_which_nothing_is_said_needs_a_wide_overhang() -> None:
    for reach, stated in ((0.2, False), (0.5, True)):
        cloud = scanned(moved_out(HOUSE, [reach] * 4))
        found = find_overhangs(evidence(None, around=cloud, edges=()), model())
        assert [r > 0 for r in reaches(found)] == [stated] * 4


def test_echoes_on_the_walls_tell_an_overhang_from_an_outline_that_is_off() -> None:
    roof = moved_out(HOUSE, [0.3] * 4)
    at_outline = concatenate([scanned(roof), echoes(HOUSE)])
    under_rim = concatenate([scanned(roof), echoes(orient(roof))])
    assert min(reaches(find_overhangs(evidence(None, around=at_outline, edges=()), model()))) > 0.2
    assert reaches(find_overhangs(evidence(None, around=under_rim, edges=()), model())) == [0.0] * 4


def test_without_surface_or_points_nothing_is_claimed() -> None:
    found = find_overhangs(evidence(None), model())
    assert reaches(found) == [0.0] * 4
    assert all(np.isnan(o.sigma_m) and o.seen == 0 for o in found)
    none = find_overhangs(evidence(surface(HOUSE, 0.1)), Candidate("x", None))
    assert reaches(none) == [0.0] * 4


def test_rims_beyond_the_longest_reach_are_not_seen() -> None:
    heights = surface(moved_out(HOUSE, [1.5] * 4), 0.1)
    found = find_overhangs(evidence(heights), model(), OverhangParameters(most_reach_m=0.8))
    assert reaches(found) == [0.0] * 4
    assert all(o.seen == 0 for o in found)


def along_roof(outline: Polygon) -> tuple[OutlineEdge, ...]:
    xy = shapely.get_coordinates(outline.exterior)
    return tuple(OutlineEdge(LineString(p), "roof", 0.1) for p in itertools.pairwise(xy))


def test_a_reach_counts_from_the_facade_where_the_outline_is_the_roofs_rim() -> None:
    """Walls stand 0.6 m inside; the line of the overhang is theirs, and the roof of the solid ends where it is."""
    inner = orient(HOUSE.buffer(-0.6, join_style="mitre"))
    known = evidence(surface(HOUSE, 0.08), walls=facades(inner), edges=along_roof(HOUSE))
    found = find_overhangs(known, model())
    assert np.abs(np.array(reaches(found)) - 0.6).max() < 0.05
    assert max(shapely.distance(o.line.centroid, inner.exterior) for o in found) < 0.03
    before = model()
    assert before.solid is not None
    finished = with_overhangs(before, found, known)
    assert finished.solid is not None
    assert np.array_equal(finished.solid.vertices, before.solid.vertices)
    assert finished.overhangs == found


def test_nothing_is_stated_where_the_outline_is_the_roofs_rim_and_no_facade_was_seen() -> None:
    found = find_overhangs(evidence(surface(HOUSE, 0.08), edges=along_roof(HOUSE)), model())
    assert reaches(found) == [0.0] * 4
    assert all(np.isnan(o.sigma_m) and o.seen == 0 for o in found)


def test_heights_drawn_out_over_shadow_make_no_overhang() -> None:
    """The surface stands out by 0.24 m, colours end with the wall."""
    heights = surface(moved_out(HOUSE, [0.24] * 4), 0.08)
    x, y = np.meshgrid(heights.grid.x_centres(), heights.grid.y_centres())
    grey = np.where(shapely.contains_xy(HOUSE, x, y), 200, 30).astype(np.uint8)
    picture = Picture(heights.grid, np.stack([grey, grey, grey]))
    assert min(reaches(find_overhangs(evidence(heights), model()))) > 0.2
    assert reaches(find_overhangs(evidence(heights, pictures=(picture,)), model())) == [0.0] * 4
