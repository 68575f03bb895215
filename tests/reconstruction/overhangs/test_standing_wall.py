"""Where the wall below an edge stands, by points on its façade."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import LineString, Polygon

from cityflow.core.building import EdgeOverhang, OutlineEdge
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.facade_line import facade_place
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.standing_wall import at_outline, standing_wall

EDGE = WallEdge(np.array([[0.0, 0.0], [6.0, 0.0]]), False)
ROOF, SIGMA = 6.0, 0.03
P = OverhangParameters()
BOX = Polygon([(0, 0), (6, 0), (6, 5), (0, 5)])


def points(place: float, count: int = 200, z: tuple[float, float] = (1.0, 5.0), seed: int = 1) -> WallPoints:
    """On a façade `place` metres outside the edge (south of it), 4 cm off."""
    rng = np.random.default_rng(seed)
    xyz = np.column_stack([rng.uniform(0, 6, count), rng.normal(-place, 0.04, count), rng.uniform(*z, count)])
    normal = np.tile(np.array([0.0, -1.0], np.float32), (count, 1))
    return WallPoints(xyz, normal, np.full(count, 0.04, np.float32), np.full(count, 3, np.uint8))


@pytest.mark.parametrize("place", [-1.2, -0.6, 0.0, 0.3])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_line_of_the_facade(place: float, seed: int) -> None:
    found = facade_place(EDGE, points(place, seed=seed), ROOF, SIGMA)
    assert found is not None
    assert abs(found[0] - place) < 0.02
    assert SIGMA < found[1] < 0.05


def test_points_dragged_to_the_rim_and_a_recess_move_nothing() -> None:
    dragged = points(-0.1, 400, (5.8, 6.2))
    recess = points(-1.1, 400, (1.0, 2.0))
    found = facade_place(EDGE, joined_walls((points(-0.6), dragged, recess)), ROOF, SIGMA)
    assert found is not None
    assert abs(found[0] + 0.6) < 0.02


def test_what_does_not_tell() -> None:
    assert facade_place(EDGE, points(-0.6, 20), ROOF, SIGMA) is None
    assert facade_place(EDGE, joined_walls((points(-0.6), points(-1.4))), ROOF, SIGMA) is None
    assert facade_place(EDGE, points(-0.6, 400, (1.0, 1.3)), ROOF, SIGMA) is None
    behind = points(-0.6)
    turned = WallPoints(behind.xyz, -behind.normal, behind.sigma, behind.views)
    assert facade_place(EDGE, turned, ROOF, SIGMA) is None


def evidence(walls: WallPoints, source: str = "", sigma_m: float = 0.05) -> Evidence:
    edges = (OutlineEdge(LineString(EDGE.xy), source, sigma_m),) if source else ()
    return Evidence("u", BOX, PointCloud.empty(), 0.0, walls=walls, edges=edges)


@pytest.mark.parametrize(
    ("place", "source", "apart"),
    [
        (-0.15, "roof", True),
        (-0.15, "wall", False),
        (-0.3, "wall", True),
        (-0.3, "given", False),
        (-0.8, "given", True),
    ],
)
def test_an_outline_is_given_up_by_what_it_was_found_from(place: float, source: str, apart: bool) -> None:
    wall = standing_wall(EDGE, evidence(points(place), source), ROOF, P)
    assert wall.apart is apart
    assert wall.origin_m == pytest.approx(place if apart else 0.0, abs=0.02)


def test_a_rim_without_facade_tells_no_wall() -> None:
    assert not standing_wall(EDGE, evidence(joined_walls(()), "roof"), ROOF, P).known
    assert standing_wall(EDGE, evidence(joined_walls(()), "wall"), ROOF, P).sigma_m == pytest.approx(0.05)


def test_the_solid_gets_what_lies_beyond_the_outline() -> None:
    inside = EdgeOverhang(LineString([(0.0, 0.5), (6.0, 0.5)]), 0.9, 0.1, 1.0)
    rim = EdgeOverhang(LineString([(0.0, 0.5), (6.0, 0.5)]), 0.55, 0.1, 1.0)
    on = EdgeOverhang(LineString([(6.0, 0.0), (6.0, 5.0)]), 0.4, 0.1, 1.0)
    moved, none, same = at_outline([inside, rim, on], evidence(joined_walls(())), P)
    assert moved.reach_m == pytest.approx(0.4)
    assert list(moved.line.coords) == [(0.0, 0.0), (6.0, 0.0)]
    assert none.reach_m == 0.0
    assert same is on
