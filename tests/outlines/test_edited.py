from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Point, Polygon, box

from cityflow.core.building import Outline, OutlineEdge
from cityflow.core.edits import DrawnOutline, Edits
from cityflow.outlines.given.edited import REJECTED, REPLACED, apply_to_outlines, rejected


def _house(name: str, x: float, width: float = 10.0) -> Outline:
    polygon = box(x, 0, x + width, 10)
    edges = tuple(OutlineEdge(shapely.LineString(e), "wall", 0.05, 0.9) for e in np.lib.stride_tricks.sliding_window_view(
        shapely.get_coordinates(polygon), 2, axis=0).transpose(0, 2, 1))  # fmt: skip
    return Outline(name, polygon, {"street": name}, "found", polygon.buffer(0.4), edges)


def _by_id(outlines: list[Outline]) -> dict[str, Outline]:
    found = {o.id: o for o in outlines}
    assert len(found) == len(outlines)
    return found


def test_what_no_edit_touches_is_the_same_object() -> None:
    houses = [_house("a", 0), _house("b", 20)]
    result, refused = apply_to_outlines(houses, Edits((DrawnOutline(box(50, 0, 60, 10), "new"),)))
    assert result[:2] == houses
    assert all(r is h for r, h in zip(result, houses, strict=False))
    assert (result[2].id, result[2].remark, refused) == ("new", "drawn by an edit", [])


def test_a_drawn_outline_replaces_and_inherits() -> None:
    drawn = Polygon([(0.5, -1), (11, -1), (11, 9), (0.5, 9)])
    result, refused = apply_to_outlines([_house("a", 0)], Edits((DrawnOutline(drawn),)))
    assert (len(result), refused) == (1, [])
    assert (result[0].id, dict(result[0].attributes)) == ("a", {"street": "a"})
    assert result[0].polygon.equals(drawn)
    named, gone = apply_to_outlines([_house("a", 0)], Edits((DrawnOutline(drawn, "mine"),)))
    assert ([o.id for o in named], [(r.id, r.reason) for r in gone]) == (["mine"], [("a", REPLACED)])


def test_an_outline_that_is_moved_keeps_name_and_attributes_and_none_of_that_name_is_refused() -> None:
    for share in (0.9, 1.1):
        moved = DrawnOutline(box(0, 0, 10 * share, 10), "a", locked=True)
        result, refused = apply_to_outlines([_house("a", 0), _house("b", 20)], Edits((moved,)))
        found = _by_id(result)
        assert sorted(found) == ["a", "b"]
        assert (dict(found["a"].attributes), round(found["a"].polygon.area, 6), refused) == (
            {"street": "a"},
            round(100 * share, 6),
            [],
        )
    both, refused = apply_to_outlines([_house("a", 0)], Edits((moved,), rejected=(Point(5, 5),)))
    assert ([o.id for o in both], refused) == (["a"], [])


def test_a_unit_that_is_moved_leaves_its_neighbours_though_it_was_most_of_their_outline() -> None:
    moved = DrawnOutline(box(0, -0.5, 42, 10), "row.17_4", locked=True)
    result, refused = apply_to_outlines([_house("row", 0, 60)], Edits((moved,)))
    found = _by_id(result)
    assert (sorted(found), refused) == (["row", "row.17_4"], [])
    assert found["row"].polygon.equals(box(42, 0, 60, 10))
    alone, _ = apply_to_outlines([_house("row", 0, 60)], Edits((DrawnOutline(box(0, 0, 42, 10), "rowan"),)))
    assert [o.id for o in alone] == ["rowan"]


def test_a_house_locked_in_a_row_leaves_the_rest_on_both_sides() -> None:
    locked = DrawnOutline(box(20, 0, 26.5, 10), "villa", locked=True)
    result, refused = apply_to_outlines([_house("row", 0, 60)], Edits((locked,)))
    found = _by_id(result)
    assert sorted(found) == ["row-1", "row-2", "villa"]
    assert [found[n].polygon.area for n in ("row-1", "row-2", "villa")] == [335.0, 200.0, 65.0]
    assert found["row-1"].remark == "found; trimmed by an edit"
    assert found["villa"].remark == "locked by an edit"
    assert refused == []
    assert shapely.coverage_is_valid([o.polygon for o in result])


def test_a_trimmed_outline_keeps_the_edges_that_are_left() -> None:
    result, _ = apply_to_outlines([_house("a", 0, 20)], Edits((DrawnOutline(box(15, -2, 25, 12)),)))
    left = next(o for o in result if o.id == "a")
    assert (left.polygon.area, left.roof) == (150.0, None)
    assert len(left.edges) == 3


def test_slivers_beside_a_drawn_outline_go_with_it() -> None:
    row = [_house("a", 0, 20), _house("b", 20, 20)]
    result, _ = apply_to_outlines(row, Edits((DrawnOutline(box(20.2, 0.2, 39.9, 10)),)))
    assert sorted(o.id for o in result) == ["a", "b"]
    result, _ = apply_to_outlines([_house("a", 0, 60)], Edits((DrawnOutline(box(20, 0.2, 40, 9.9), "b"),)))
    assert [round(o.polygon.area, 1) for o in result] == pytest.approx([200, 200, 194], abs=0.2)
    assert {o.id for o in result} == {"a-1", "a-2", "b"}


def test_vertices_tie_where_a_drawn_outline_ends_on_a_neighbour() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        angle, x = rng.uniform(0, np.pi), float(rng.uniform(3, 15))
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

        def placed(p: Polygon, turn: np.ndarray = turn) -> Polygon:
            return shapely.transform(p, lambda xy: np.round(xy @ turn + [450_000, 5_800_000], 4))

        row = Outline("row", placed(box(0, 0, 60, 10)))
        drawn = placed(box(x, -3, x + 12, 13))
        result, _ = apply_to_outlines([row], Edits((DrawnOutline(drawn, "d"),)))
        found = _by_id(result)
        assert shapely.is_valid([o.polygon for o in result]).all()
        assert shapely.coverage_is_valid([o.polygon for o in result])
        own = set(map(tuple, shapely.get_coordinates(drawn).tolist()))
        assert own <= set(map(tuple, shapely.get_coordinates(found["d"].polygon).tolist()))
        assert found["d"].polygon.hausdorff_distance(drawn) < 1e-4


def test_of_drawn_outlines_that_overlap_the_locked_wins() -> None:
    edits = Edits((DrawnOutline(box(0, 0, 10, 10), "l", True), DrawnOutline(box(5, 0, 20, 10), "o")))
    found = _by_id(apply_to_outlines([], edits)[0])
    assert (found["l"].polygon.area, found["o"].polygon.area) == (100.0, 100.0)


def test_rejected_by_a_point_or_by_half_under_a_polygon() -> None:
    houses = [_house("a", 0), _house("b", 20), _house("c", 40)]
    edits = Edits(rejected=(Point(25, 5), box(39, -1, 45.5, 11), box(-1, -1, 4, 11)))
    result, refused = apply_to_outlines(houses, edits)
    assert [o.id for o in result] == ["a"]
    assert [(r.id, r.reason) for r in refused] == [("b", REJECTED), ("c", REJECTED)]
    assert rejected([h.polygon for h in houses], edits, by_points=False).tolist() == [False, False, True]


def test_ids_stay_unique() -> None:
    result, _ = apply_to_outlines([_house("a", 0)], Edits((DrawnOutline(box(30, 0, 40, 10), "a"),)))
    assert [(o.id, o.polygon.bounds[0]) for o in result] == [("a-2", 0.0), ("a", 30.0)]
