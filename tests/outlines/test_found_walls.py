"""Outlines found in a laser's points: the rim of the roof is found, and walls move in to the echoes of their façades."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.points import PointCloud
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.surface.tile_surface import surface_of_tile

BOUNDS = (0.0, 0.0, 40.0, 36.0)
WALLS, EAVES_M, HIGH_M = shapely.box(12, 12, 26, 22), 0.6, 6.0


def scanned(eaves_m: float) -> np.ndarray:
    """Ten points per m² on a flat roof and on the ground around it, and echoes of the south and the west façade."""
    rng = np.random.default_rng(8)
    xyz = np.column_stack([rng.uniform(0, 40, 14400), rng.uniform(0, 36, 14400), np.zeros(14400)])
    roof = shapely.buffer(WALLS, eaves_m, join_style="mitre")
    xyz[shapely.contains_xy(roof, xyz[:, 0], xyz[:, 1]), 2] = HIGH_M
    south = np.column_stack([rng.uniform(12, 26, 250), np.full(250, 12.0), rng.uniform(0.2, 5.8, 250)])
    west = np.column_stack([np.full(250, 12.0), rng.uniform(12, 22, 250), rng.uniform(0.2, 5.8, 250)])
    points = np.concatenate([xyz, south, west])
    return np.asarray(points + rng.normal(0, (0.03, 0.03, 0.02), points.shape))


def found_in(xyz: np.ndarray):  # type: ignore[no-untyped-def]
    s = surface_of_tile(PointCloud.of(xyz), BOUNDS, 0.0)
    surface = RegionSurface(s.grid, s.ndsm, s.klass, s.holes, None, s.count.astype(np.uint32), None, s.dtm)
    roofs = find_outlines(surface, FindParameters())
    assert len(roofs) == 1
    (walls,) = found_walls_in(roofs, SeenHouses.of(xyz[xyz[:, 2] > 0.5], None), WallsInParameters())
    return roofs[0], walls


def test_walls_of_a_found_outline_move_in_under_the_eaves() -> None:
    roof, walls = found_in(scanned(EAVES_M))
    x_min, y_min, x_max, y_max = walls.polygon.bounds
    assert (x_min, y_min) == pytest.approx((12.0, 12.0), abs=0.05)
    assert (x_max, y_max) == pytest.approx(roof.polygon.bounds[2:], abs=1e-3)  # nobody sees these façades
    assert walls.roof == roof.polygon
    assert sorted(e.source for e in walls.edges) == ["roof", "roof", "wall", "wall"]
    assert len(walls.rims) == 2
    assert all(r.seen > 0.8 for r in walls.rims)


def test_a_found_outline_that_is_too_large_gets_its_walls_and_no_eaves() -> None:
    """Cells make it 0.24 m too large; no roof is there that could be an overhang."""
    roof, walls = found_in(scanned(0.0))
    assert roof.polygon.bounds[:2] == pytest.approx((11.76, 11.76), abs=0.02)
    assert walls.polygon.bounds[:2] == pytest.approx((12.0, 12.0), abs=0.05)
    assert not walls.rims
    assert walls.roof is None


def test_without_points_nothing_moves() -> None:
    roof, _ = found_in(scanned(EAVES_M))
    assert found_walls_in([roof], None, WallsInParameters()) == [roof]
