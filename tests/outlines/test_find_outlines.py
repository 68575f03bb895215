from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import HIGH_VEGETATION
from cityflow.evaluation.outlines import compare_outlines
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines, is_seen_whole

EXACT = FindParameters(spot_m=0.0)


def surface_of(
    buildings: list[BaseGeometry], bounds: Bounds, core: Bounds | None = None, trees: BaseGeometry | None = None
) -> RegionSurface:
    """Half-metre cells, high where one of three points per cell lies on a roof: as a survey sees it."""
    grid = Grid.covering(bounds, 0.5)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    high = np.zeros(grid.shape, bool)
    for k in range(3):
        # The points of a cell depend on where it is, not on the raster that it is cut from.
        jitter = [((x * 7919 + y * 104729) * (k + 1.37) * f % 1.0) - 0.5 for f in (0.6180339, 0.7548777)]
        xx, yy = x + jitter[0] * 0.5, y + jitter[1] * 0.5
        high |= shapely.contains_xy(shapely.union_all(buildings), xx, yy)
    ndsm = np.where(high, 6.0, 0.02).astype(np.float32)
    klass = np.where(high, 6, 2).astype(np.uint8)
    if trees is not None:
        leaves = shapely.contains_xy(trees, x, y)
        ndsm[leaves] = 4 + 8 * (((x * 12.9898 + y * 78.233) * 43.7) % 1.0)[leaves]
    count = np.full(grid.shape, 3, np.uint32)
    return RegionSurface(grid, ndsm, klass, np.zeros(grid.shape, bool), core, count)


def l_shape(angle: float) -> Polygon:
    ring = Polygon([(0, 0), (20, 0), (20, 8), (9, 8), (9, 16), (0, 16)])
    return affinity.translate(affinity.rotate(ring, angle, origin=(0, 0)), 85030, 447530)


BOUNDS = (85000.0, 447500.0, 85060.0, 447560.0)


@pytest.mark.parametrize("angle", [3, 11, 27, 45, 72])
def test_an_l_is_found_to_fractions_of_a_cell_at_any_angle(angle: float) -> None:
    truth = l_shape(angle)
    (found,) = find_outlines(surface_of([truth], BOUNDS), EXACT)
    accuracy = compare_outlines([found.polygon], [truth])
    assert shapely.get_num_coordinates(found.polygon) <= 8
    assert accuracy.iou > 0.94
    assert accuracy.boundary_m < 0.2
    assert accuracy.corner_mean_m < 0.5


def test_a_trapezoid_and_a_house_of_two_orientations_keep_their_slanting_edges() -> None:
    trapezoid = Polygon([(0, 0), (24, 0), (18, 10), (0, 10)])
    wing = shapely.union(box(0, 0, 20, 8), affinity.rotate(box(0, 0, 18, 8), 40, origin=(0, 0)))
    for shape in (trapezoid, wing):
        truth = affinity.translate(affinity.rotate(shape, 17, origin=(0, 0)), 85025, 447520)
        (found,) = find_outlines(surface_of([truth], BOUNDS), EXACT)
        assert compare_outlines([found.polygon], [truth]).iou > 0.93
        assert shapely.get_num_coordinates(found.polygon) <= shapely.get_num_coordinates(truth) + 2
        assert "free edges" in found.remark


def test_courtyards_stay_and_trees_go() -> None:
    yard = Polygon(box(85010, 447510, 85040, 447535).exterior, [box(85020, 447518, 85032, 447528).exterior])
    trees = shapely.Point(85050, 447550).buffer(6)
    found = find_outlines(surface_of([yard], BOUNDS, trees=trees), EXACT)
    assert len(found) == 1
    assert found[0].polygon.area == pytest.approx(yard.area, rel=0.04)
    assert len(found[0].polygon.interiors) == 1


def test_vegetation_water_and_holes_are_no_buildings() -> None:
    whole = surface_of([box(85010, 447510, 85020, 447520), box(85030, 447510, 85040, 447520)], BOUNDS)
    klass, holes = whole.klass.copy(), whole.holes.copy()
    klass[:, :50] = HIGH_VEGETATION
    holes[:, 50:] = True
    assert len(find_outlines(whole, EXACT)) == 2
    assert len(find_outlines(RegionSurface(whole.grid, whole.ndsm, klass, whole.holes), EXACT)) == 1
    assert not find_outlines(RegionSurface(whole.grid, whole.ndsm, klass, holes), EXACT)


def test_another_window_around_it_gives_the_same_outline() -> None:
    truth = l_shape(33)
    (a,) = find_outlines(surface_of([truth], BOUNDS), EXACT)
    (b,) = find_outlines(surface_of([truth], (84980.0, 447510.0, 85090.0, 447600.0)), EXACT)
    assert a.id == b.id
    assert shapely.hausdorff_distance(a.polygon, b.polygon) < 1e-3


def test_a_wide_building_is_whole_where_more_of_it_is_read() -> None:
    truth = box(85005, 447510, 85095, 447522)
    parameters = EXACT.model_copy(update={"halo_m": 40.0, "reach_m": 100.0})
    found = []
    for x_min in (85000.0, 85050.0):
        core = (x_min, 447500.0, x_min + 50, 447550.0)
        near = surface_of([truth], (x_min - 40, 447460.0, x_min + 90, 447590.0), core=core)
        assert not is_seen_whole(near, parameters)
        found += find_outlines(
            surface_of([truth], (x_min - 100, 447400.0, x_min + 150, 447650.0), core=core), parameters
        )
    assert len({o.id for o in found}) == 1
    assert all(compare_outlines([o.polygon], [truth]).iou > 0.93 for o in found)
    assert not any("cut" in o.remark for o in found)


def test_a_building_of_the_next_tile_asks_for_nothing() -> None:
    core = (85000.0, 447500.0, 85050.0, 447550.0)
    beside = surface_of([box(85055, 447510, 85089, 447522)], (84960.0, 447460.0, 85090.0, 447590.0), core=core)
    assert is_seen_whole(beside, EXACT.model_copy(update={"halo_m": 30.0}))


def test_what_is_wider_than_what_is_read_is_cut_where_the_tiles_meet() -> None:
    truth = box(85005, 447510, 85095, 447522)
    parameters = EXACT.model_copy(update={"halo_m": 40.0, "reach_m": 40.0})
    parts = []
    for x_min in (85000.0, 85050.0):
        core = (x_min, 447500.0, x_min + 50, 447550.0)
        window = (x_min - 40, 447460.0, x_min + 90, 447590.0)
        parts += find_outlines(surface_of([truth], window, core=core), parameters)
    assert len(parts) == 2
    assert all("cut" in p.remark for p in parts)
    assert shapely.area(shapely.intersection(parts[0].polygon, parts[1].polygon)) < 1e-6
    assert shapely.union_all([p.polygon for p in parts]).area == pytest.approx(truth.area, rel=0.04)
