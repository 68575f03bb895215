"""Walls that move in from the rims of roofs: corners, neighbours, and what does not move."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon

from cityflow.core.building import Outline, OutlineEdge
from cityflow.core.facade_points import WallPoints
from cityflow.geometry.straight_edges import WallEdge
from cityflow.outlines.given.edited import LOCKED
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.outlines.under_eaves.facades_inside import SeenHouses, facade_inside
from cityflow.outlines.under_eaves.walls_in import Facade, WallsInParameters, walls_moved_in

P = WallsInParameters()
BOX = Polygon([(0, 0), (8, 0), (8, 6), (0, 6)])


def outlines(*polygons: Polygon) -> list[Outline]:
    bare = [Outline(f"o{k}", p) for k, p in enumerate(polygons)]
    party = party_edges(bare)
    return [Outline(o.id, o.polygon, party=party[o.id]) for o in bare]


def facing(*inwards: tuple[tuple[float, float], float]):  # type: ignore[no-untyped-def]
    """Façades so far inside all edges that look one way."""

    def find(_: Outline, edge: WallEdge) -> Facade | None:
        for outward, depth in inwards:
            if edge.outward @ np.array(outward) > 0.99:
                return Facade(-depth, 0.03, 0.05)
        return None

    return find


EVERYWHERE = tuple((way, 0.5) for way in ((0, -1), (1, 0), (0, 1), (-1, 0)))


def test_a_house_under_its_eaves() -> None:
    (walls,) = walls_moved_in(outlines(BOX), facing(*EVERYWHERE), P)
    assert walls.polygon.normalize().equals(shapely.box(0.5, 0.5, 7.5, 5.5).normalize())
    assert walls.roof == BOX
    assert {e.source for e in walls.edges} == {"wall"}
    assert sum(e.line.length for e in walls.edges) == pytest.approx(24.0, abs=0.05)
    assert "4 of 4" in walls.remark


def test_what_is_not_significant_stays() -> None:
    given = outlines(BOX)
    assert walls_moved_in(given, facing(((0, -1), 0.12)), P)[0] is given[0]
    unsure = walls_moved_in(given, lambda _o, _e: Facade(-0.5, 0.03, 0.3), P)
    assert unsure[0] is given[0]
    assert walls_moved_in(given, facing(*EVERYWHERE), WallsInParameters(wanted=False))[0] is given[0]


def test_what_a_person_has_drawn_stays() -> None:
    drawn = Outline("o", BOX, remark=LOCKED)
    assert walls_moved_in([drawn], facing(*EVERYWHERE), P)[0] is drawn


def test_a_terrace_keeps_its_shared_walls() -> None:
    """The middle house's front moves in: the neighbours get its corners, bit for bit, and nothing overlaps."""
    row = outlines(*(Polygon([(x, 0), (x + 6, 0), (x + 6, 9), (x, 9)]) for x in (0.0, 6.0, 12.0)))

    def middle(outline: Outline, edge: WallEdge) -> Facade | None:
        return facing(((0, -1), 0.4))(outline, edge) if outline.id == "o1" else None

    left, house, right = walls_moved_in(row, middle, P)
    assert house.polygon.area == pytest.approx(6 * 8.6)
    for other, corner in ((left, (6.0, 0.4)), (right, (12.0, 0.4))):
        assert corner in set(map(tuple, shapely.get_coordinates(other.polygon).tolist()))
        assert corner in set(map(tuple, shapely.get_coordinates(house.polygon).tolist()))
        assert shapely.intersection(other.polygon, house.polygon).area == 0
        assert other.roof is None
    shared = party_edges([left, house, right])["o1"]
    assert sum(line.length for line in shared) == pytest.approx(2 * 8.6)


def test_a_wall_that_goes_on_behind_a_shed_makes_no_step() -> None:
    """The north edge of the house is touched by a shed along its half; the free half stays in line with it."""
    house = Polygon([(0, 0), (8, 0), (8, 6), (4, 6), (0, 6)])
    shed = Polygon([(0, 6), (4, 6), (4, 8), (0, 8)])
    given = outlines(house, shed)
    moved = walls_moved_in(given, lambda o, e: facing(((0, 1), 0.5))(o, e) if o.id == "o0" else None, P)
    assert moved[0] is given[0]


def test_an_inner_corner_moves_with_both_edges() -> None:
    shape = Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10)])
    (walls,) = walls_moved_in(outlines(shape), facing(*EVERYWHERE), P)
    true = Polygon([(0.5, 0.5), (9.5, 0.5), (9.5, 3.5), (3.5, 3.5), (3.5, 9.5), (0.5, 9.5)])
    assert walls.polygon.normalize().equals(true.normalize())
    (north,) = walls_moved_in(outlines(shape), facing(((0, 1), 0.5)), P)
    assert north.polygon.area == pytest.approx(shape.area - 0.5 * 10)


def test_a_courtyard_grows() -> None:
    ring = Polygon([(0, 0), (20, 0), (20, 20), (0, 20)], [[(6, 6), (6, 14), (14, 14), (14, 6)]])
    (walls,) = walls_moved_in(outlines(ring), facing(*EVERYWHERE), P)
    assert walls.polygon.area == pytest.approx(19 * 19 - 9 * 9)


def test_moves_that_leave_nothing_are_left_out() -> None:
    narrow = Polygon([(0, 0), (8, 0), (8, 1.6), (0, 1.6)])
    (walls,) = walls_moved_in(outlines(narrow), facing(((0, -1), 0.7), ((0, 1), 0.7)), P)
    assert walls.polygon.area == pytest.approx(8 * 0.9)


ROOF = np.array([(x, y, 6.0) for x in np.arange(0.1, 8, 0.25) for y in np.arange(0.05, 6, 0.2)])


def echoes(y: float, top: float = 5.5) -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.column_stack([rng.uniform(0, 8, 120), rng.normal(y, 0.03, 120), rng.uniform(0.5, top, 120)])


def south_facade(tops: np.ndarray, outline: Outline) -> Facade | None:
    edge = WallEdge(np.array([(0.0, 0.0), (8.0, 0.0)]), False)
    return facade_inside(outline, edge, SeenHouses.of(tops, None), 0.09)


def test_a_laser_sees_the_facade_under_the_eaves() -> None:
    found = south_facade(np.vstack([ROOF, echoes(0.6)]), Outline("o", BOX))
    assert found is not None
    assert found.place_m == pytest.approx(-0.6, abs=0.03)
    assert found.outline_sigma_m == 0.09


def test_no_eaves_no_move() -> None:
    """Where the roof ends with the façade the outline is merely too large; a lower annex before an upper wall is no eaves either."""
    short = ROOF[ROOF[:, 1] > 0.6]
    assert south_facade(np.vstack([short, echoes(0.6)]), Outline("o", BOX)) is None
    annex = np.where(ROOF[:, 1:2] < 0.9, ROOF * [1, 1, 0.45], ROOF)
    assert south_facade(np.vstack([annex, echoes(0.9)]), Outline("o", BOX)) is None


def test_what_facades_gave_is_the_wall() -> None:
    tops = np.vstack([ROOF, echoes(0.6)])
    line = shapely.LineString([(0, 0), (8, 0)])
    assert south_facade(tops, Outline("o", BOX, edges=(OutlineEdge(line, "wall", 0.05),))) is None
    of_roof = south_facade(tops, Outline("o", BOX, edges=(OutlineEdge(line, "roof", 0.2),)))
    assert of_roof is not None
    assert of_roof.outline_sigma_m == 0.2


def test_fronts_that_move_nearly_alike_share_their_corner() -> None:
    """Each house sees its own façade, 6 mm apart: one corner on the shared wall, not two with an edge of 6 mm."""
    row = outlines(*(Polygon([(x, 0), (x + 6, 0), (x + 6, 9), (x, 9)]) for x in (0.0, 6.0)))
    depth = {"o0": 0.4, "o1": 0.406}
    moved = walls_moved_in(row, lambda o, e: facing(((0, -1), depth[o.id]))(o, e), P)
    on_wall = [{v for v in map(tuple, shapely.get_coordinates(o.polygon).tolist()) if v[0] == 6.0} for o in moved]
    assert on_wall[0] == on_wall[1] == {(6.0, 0.403), (6.0, 9.0)}
    assert all(o.polygon.is_valid for o in moved)


def test_a_corner_beside_an_old_vertex_is_that_vertex() -> None:
    """A third house's vertex stands on the shared wall 2 cm from where the front would end."""
    house = Polygon([(0, 0), (6, 0), (6, 0.42), (6, 9), (0, 9)])
    other = Polygon([(6, 0), (12, 0), (12, 9), (6, 9), (6, 0.42)])
    moved = walls_moved_in(
        outlines(house, other), lambda o, e: facing(((0, -1), 0.4))(o, e) if o.id == "o0" else None, P
    )
    assert (6.0, 0.4) not in set(map(tuple, shapely.get_coordinates(moved[0].polygon).tolist()))
    assert (6.0, 0.42) in set(map(tuple, shapely.get_coordinates(moved[0].polygon).tolist()))
    assert moved[1].polygon.equals(other)


def facade_points(lean_m: float, scatter_m: float) -> WallPoints:
    """Points of images on a façade 0.5 m inside the south edge, which leans by so much from base to top."""
    rng = np.random.default_rng(6)
    z = rng.uniform(0.5, 5.5, 600)
    y = 0.5 + lean_m * (z / 5.5 - 0.5) + rng.normal(0, scatter_m, 600)
    normal = np.tile(np.array([0.0, -1.0], np.float32), (600, 1))
    xyz = np.column_stack([rng.uniform(0, 8, 600), y, z])
    return WallPoints(xyz, normal, np.full(600, 0.05, np.float32), np.full(600, 3, np.uint8))


def test_images_show_a_facade_only_where_it_is_upright() -> None:
    """Matching smears narrow gaps and what it sees aslant: a line through that is no wall, or an uncertain one."""
    edge = WallEdge(np.array([(0.0, 0.0), (8.0, 0.0)]), False)

    def found(lean_m: float, scatter_m: float) -> Facade | None:
        return facade_inside(Outline("o", BOX), edge, SeenHouses.of(ROOF, facade_points(lean_m, scatter_m)), 0.05)

    clear, smeared = found(0.0, 0.05), found(0.0, 0.2)
    assert clear is not None
    assert smeared is not None
    assert clear.place_m == pytest.approx(-0.5, abs=0.02)
    assert clear.sigma_m < 0.05 < 0.08 < smeared.sigma_m
    assert found(0.6, 0.05) is None
