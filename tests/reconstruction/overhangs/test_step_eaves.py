"""A high roof that stands out over a lower one of the same unit: the step moves to the wall that is seen under it, and the eave is a surface beyond it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import Polygon

from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.validity import check_polygons, check_polyhedron
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.step_eaves import with_step_eaves, with_step_walls
from cityflow.reconstruction.partition.partition_values import RoofCell, RoofPartition
from cityflow.reconstruction.solids.assemble import assemble

FLOOR, LOW, HIGH, CELL = 10.0, 16.0, 20.0, 0.125
ORIGIN = (1000.0, 2000.0, 0.0)
WALL_X, REACH = 5.0, 0.6
"""The high roof ends at `WALL_X` plus its eave; it is on the west."""
OUTLINE = Polygon([(1000, 2000), (1009, 2000), (1009, 2006), (1000, 2006)])
P = OverhangParameters()


def model(step_x: float) -> Candidate:
    """Two level roofs with the step at a place."""
    corners = np.array([(0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (0.0, 6.0), (step_x, 0.0), (step_x, 6.0)])
    cells = tuple(RoofCell((r,), k) for k, r in enumerate(((0, 4, 5, 3), (4, 1, 2, 5))))
    planes = np.array([(0.0, 0.0, HIGH), (0.0, 0.0, LOW)])
    solid = assemble(RoofPartition(corners, 4, cells), planes, FLOOR, ORIGIN, OUTLINE)
    assert check_polyhedron(solid) == []
    return Candidate("test", solid)


def evidence(rim_x: float, wall_x: float | None) -> Evidence:
    """The surface with the rim at a place, and points on the wall under it."""
    grid = Grid(996.0, 2010.0, CELL, 112, 136)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    inside = shapely.contains_xy(OUTLINE, x, y)
    dsm = np.where(inside, np.where(x < 1000 + rim_x, HIGH, LOW), FLOOR)
    heights = HeightRaster(grid, dsm, np.full(grid.shape, FLOOR))
    walls = joined_walls([])
    if wall_x is not None:
        rng = np.random.default_rng(3)
        xyz = np.column_stack(
            [1000 + wall_x + rng.normal(0, 0.04, 600), rng.uniform(2000, 2006, 600), rng.uniform(LOW, HIGH - 0.4, 600)]
        )
        east = np.tile(np.array([1.0, 0.0], np.float32), (600, 1))
        walls = WallPoints(xyz, east, np.full(600, 0.04, np.float32), np.full(600, 3, np.uint8))
    return Evidence("u", OUTLINE, PointCloud.empty(), FLOOR, heights=heights, walls=walls, matched=True)


def step_of(solid: Polyhedron | None) -> float:
    assert solid is not None
    assert check_polyhedron(solid) == []
    x = np.concatenate([solid.ring(f.rings[0])[:, 0] for f in solid.of_semantic(Semantic.WALL)]) - 1000
    (found,) = np.unique(x[(x > 0.5) & (x < 8.5)].round(3))
    return float(found)


@pytest.mark.parametrize("step_x", [WALL_X + REACH, WALL_X + REACH - 0.1, WALL_X])
def test_the_step_stands_at_the_wall_and_the_eave_beyond_it(step_x: float) -> None:
    """Wherever between wall and rim the method has put it."""
    seen, before = evidence(WALL_X + REACH, WALL_X), model(step_x)
    moved = with_step_walls(before, seen, P)
    assert step_of(moved.solid) == pytest.approx(WALL_X, abs=0.03)
    done = with_step_eaves(moved, moved.solid, seen, P)
    assert done.solid is moved.solid
    (eave,) = done.overhangs
    assert eave.reach_m == pytest.approx(REACH, abs=0.06)
    assert done.beyond is not None
    assert check_polygons(rings_of(done.beyond)) == []
    assert np.ptp(done.beyond.vertices, axis=0) == pytest.approx((eave.reach_m, 6.0, P.slab_m), abs=0.04)
    assert done.beyond.vertices[:, 2].max() == pytest.approx(HIGH, abs=1e-3)
    assert {f.semantic for f in done.beyond.faces} == {Semantic.ROOF, Semantic.WALL, Semantic.OUTER_CEILING}


@pytest.mark.parametrize(
    ("rim_x", "wall_x"), [(WALL_X, WALL_X), (WALL_X + REACH, None)], ids=["no eave", "wall not seen"]
)
def test_nothing_is_made_of_what_is_not_seen(rim_x: float, wall_x: float | None) -> None:
    seen, before = evidence(rim_x, wall_x), model(rim_x)
    moved = with_step_walls(before, seen, P)
    assert moved.solid is before.solid
    done = with_step_eaves(moved, moved.solid, seen, P)
    assert done.overhangs == ()
    assert done.beyond is None


def test_points_of_the_lower_wall_are_not_those_of_the_step() -> None:
    """Points under the lower roof, where the wall of the step would be."""
    seen, before = evidence(WALL_X + REACH, WALL_X), model(WALL_X + REACH)
    sunk = replace(seen.walls, xyz=seen.walls.xyz - [0.0, 0.0, HIGH - LOW])
    made = with_step_walls(before, replace(seen, walls=sunk), P)
    assert made.solid is before.solid
