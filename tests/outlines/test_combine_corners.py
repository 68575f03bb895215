"""Corners of footprints against their price, on evidence that is drawn."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.outlines.joined.combine_corners import with_fewer_corners
from cityflow.outlines.joined.combine_lines import Kind, Pieces

CELL = 0.1
HOUSE = box(3, 3, 15, 11)


def drawn(building: Polygon, unknown: Polygon | None = None) -> FloatArray:
    """Gain of calling a place building: 1 on it, -1 beside it, 0 where nothing is known."""
    x, y = np.meshgrid((np.arange(200) + 0.5) * CELL, (np.arange(160) + 0.5) * CELL)
    gain = np.where(shapely.contains_xy(building, x, y), 1.0, -1.0)
    return np.where(shapely.contains_xy(unknown, x, y), 0.0, gain) if unknown is not None else gain


def pieces_of(polygon: Polygon, kind: Kind = Kind.ROOF) -> Pieces:
    xy = shapely.get_coordinates(shapely.orient_polygons(polygon).exterior)
    n = len(xy) - 1
    return Pieces(np.stack([xy[:-1], xy[1:]], axis=1), np.full(n, kind), np.full(n, np.nan), np.full(n, -1))


def cut_off(leg_m: float) -> tuple[Polygon, Polygon]:
    """The house without a corner, and that corner."""
    corner = Polygon([(15, 11), (15 - leg_m, 11), (15, 11 - leg_m)])
    cut = shapely.difference(HOUSE, corner)
    assert isinstance(cut, Polygon)
    return cut, corner


def test_corner_that_nobody_saw_is_made_again() -> None:
    cut, corner = cut_off(1.2)
    found = with_fewer_corners(cut, drawn(HOUSE, corner), CELL, pieces_of(cut))
    assert shapely.symmetric_difference(found, HOUSE).area < 1e-6
    assert len(found.exterior.coords) == 5


@pytest.mark.parametrize("leg_m", [1.2, 3.0])
def test_corner_that_is_seen_to_be_cut_off_stays(leg_m: float) -> None:
    cut, _ = cut_off(leg_m)
    assert with_fewer_corners(cut, drawn(cut), CELL, pieces_of(cut)).equals(cut)


@pytest.mark.parametrize(("deep_m", "stays"), [(0.2, False), (1.0, True)])
def test_step_stays_if_its_area_is_worth_two_corners(deep_m: float, stays: bool) -> None:
    stepped = shapely.difference(HOUSE, box(12, 11 - deep_m, 16, 12))
    assert isinstance(stepped, Polygon)
    found = with_fewer_corners(stepped, drawn(stepped), CELL, pieces_of(stepped))
    assert len(found.exterior.coords) - 1 == (6 if stays else 4)


def test_wall_that_was_seen_outweighs_its_corners() -> None:
    """A step of 0.25 m along a metre is worth no corners, unless façades show it."""
    stepped = shapely.union(HOUSE, box(12, 11, 15, 11.25))
    assert isinstance(stepped, Polygon)
    plain, nothing = drawn(stepped), np.zeros((160, 200))
    assert len(with_fewer_corners(stepped, plain, CELL, pieces_of(stepped)).exterior.coords) - 1 == 4
    assert with_fewer_corners(stepped, nothing, CELL, pieces_of(stepped, Kind.SEEN)).equals(stepped)


def test_order_and_start_of_a_ring_do_not_matter() -> None:
    cut, corner = cut_off(1.2)
    xy = shapely.get_coordinates(cut.exterior)[:-1]
    for shift in range(len(xy)):
        turned = Polygon(np.roll(xy, shift, axis=0)[::-1] if shift % 2 else np.roll(xy, shift, axis=0))
        found = with_fewer_corners(turned, drawn(HOUSE, corner), CELL, pieces_of(cut))
        assert shapely.symmetric_difference(found, HOUSE).area < 1e-6


def test_courtyard_keeps_its_corners() -> None:
    yard = Polygon(HOUSE.exterior.coords, [[(6, 5), (6, 9), (10, 9), (10, 5)]])
    found = with_fewer_corners(yard, drawn(yard), CELL, pieces_of(yard))
    assert found.equals(yard)
