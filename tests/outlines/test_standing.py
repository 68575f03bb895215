"""Crowns, vehicles, regions that nobody measured and such without ground around are no buildings; houses, sheds and garages are."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.ndimage import gaussian_filter
from shapely import Polygon, affinity, box

from cityflow.core.grid import Grid
from cityflow.core.points import HIGH_VEGETATION
from cityflow.outlines.from_heights.regions import RegionParameters, RegionSurface, building_regions
from cityflow.outlines.from_heights.standing import standing

MIDDLE = 30.0


def rectangle(width: float, length: float, angle: float) -> Polygon:
    shape = box(MIDDLE - length / 2, MIDDLE - width / 2, MIDDLE + length / 2, MIDDLE + width / 2)
    return affinity.rotate(shape, angle)


def heights(shape: Polygon, height: float, cell: float, seed: int, reach: float = MIDDLE) -> tuple[Grid, np.ndarray]:
    """Ground with one block on it, blurred over a cell and noisy, as matching leaves it; `reach`: from the middle to the border."""
    grid = Grid.covering((MIDDLE - reach, MIDDLE - reach, MIDDLE + reach, MIDDLE + reach), cell)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    block = np.where(shapely.contains_xy(shape, x, y), height, 0.0)
    noise = np.random.default_rng(seed).normal(0, 0.05, grid.shape)
    return grid, (gaussian_filter(block, 0.6) + noise).astype(np.float32)


def found(grid: Grid, ndsm: np.ndarray, trees: np.ndarray | None = None, holes: np.ndarray | None = None) -> float:
    """Area of the building regions, m²."""
    klass = np.full(grid.shape, 2, np.uint8)
    if trees is not None:
        klass[trees] = HIGH_VEGETATION
    holes = np.zeros(grid.shape, bool) if holes is None else holes
    surface = RegionSurface(grid, ndsm, klass, holes, highest=False)
    return sum(r.area_m2 for r in building_regions(surface, RegionParameters()))


@pytest.mark.parametrize("cell", [0.1, 0.2])
@pytest.mark.parametrize(("angle", "length", "height"), [(0, 12, 3.1), (33, 10, 2.7), (71, 18, 3.9), (90, 8, 3.2)])
def test_vehicles_are_no_buildings(cell: float, angle: int, length: float, height: float) -> None:
    assert found(*heights(rectangle(2.5, length, angle), height, cell, angle, reach=20.0)) == 0


@pytest.mark.parametrize("cell", [0.1, 0.2])
@pytest.mark.parametrize(
    ("width", "length", "height"), [(3.2, 6, 2.5), (6, 9, 2.4), (2.5, 30, 3), (2.5, 9, 5.5), (8, 10, 6)]
)
@pytest.mark.parametrize("angle", [0, 27])
def test_garages_sheds_and_towers_are(cell: float, width: float, length: float, height: float, angle: float) -> None:
    assert found(*heights(rectangle(width, length, angle), height, cell, 5, reach=20.0)) > 0.7 * width * length


def test_a_narrow_shed_at_a_wood_is_no_vehicle() -> None:
    grid, ndsm = heights(rectangle(2.5, 12, 0), 2.6, 0.2, 1)
    _, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    wood = y < MIDDLE - 1.4
    ndsm[wood] = 9 + np.random.default_rng(2).normal(0, 1, grid.shape)[wood]
    assert found(grid, ndsm, wood) > 20


@pytest.mark.parametrize("seed", range(4))
def test_an_even_spot_in_a_crown_is_no_building_and_a_house_with_trees_on_three_sides_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid, ndsm = heights(rectangle(7, 9, 20 * seed), 8.0, 0.2, seed)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    house = shapely.contains_xy(rectangle(7, 9, 20 * seed), x, y)
    canopy = (8 + rng.normal(0, 0.8, grid.shape)).astype(np.float32)
    wood = (np.hypot(x - MIDDLE, y - MIDDLE) < 14) & ~house
    assert found(grid, np.where(wood, canopy, ndsm), wood) == 0
    beside = wood & (x < MIDDLE + 2)
    assert found(grid, np.where(beside, canopy, ndsm), beside) > 50


def test_what_nobody_measured_is_no_building() -> None:
    grid, ndsm = heights(rectangle(8, 12, 10), 6, 0.2, 3)
    speckled = np.random.default_rng(1).random(grid.shape)
    assert found(grid, ndsm, holes=speckled < 0.35) > 80
    house = ndsm > 3
    assert found(grid, ndsm, holes=house & (speckled < 0.65)) == 0


def test_without_ground_in_reach_its_height_is_a_guess() -> None:
    """Filled heights around say nothing; ground on one side does."""
    grid, ndsm = heights(rectangle(8, 12, 40), 6, 0.2, 4)
    x, _ = np.meshgrid(grid.x_centres(), grid.y_centres())
    measured = (ndsm > 3) | (np.random.default_rng(3).random(grid.shape) < 0.03)
    mask = ndsm > 3
    assert not standing(mask, ndsm, measured, 0.2).any()
    assert np.array_equal(standing(mask, ndsm, measured | (x > MIDDLE + 8), 0.2), mask)


@pytest.mark.parametrize("seed", range(3))
def test_a_low_shed_over_terrain_found_too_high_stays_whole_and_what_is_lower_beside_a_house_does_not_join_it(
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    shape = rectangle(10, 40, 15 * seed)
    grid, ndsm = heights(shape, 2.5, 0.2, seed)
    # terrain found too high under it: the roof falls below 2 m in bands across
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    a = np.radians(15 * seed)
    along = (x - MIDDLE) * np.cos(a) + (y - MIDDLE) * np.sin(a)
    inside = shapely.contains_xy(shape, x, y)
    ndsm = np.where(inside, ndsm - np.where(np.abs(along - rng.uniform(-8, 8)) < 2, 0.9, 0.1), ndsm).astype(np.float32)
    assert found(grid, ndsm) > 0.93 * shape.area
    grid, tall = heights(rectangle(10, 20, 0), 7.0, 0.2, seed)
    terrace = np.where((np.abs(x - MIDDLE) < 9) & (np.abs(y - MIDDLE - 7.5) < 2.5), np.float32(1.5), tall)
    assert found(grid, terrace.astype(np.float32)) < 1.1 * 200
