from __future__ import annotations

import shapely
from shapely import Polygon, box

from cityflow.core.building import Outline
from cityflow.outlines.identity import ids_from_geometry, numbered_where_repeated, with_ids


def test_an_id_says_where_the_outline_stands_whatever_the_order() -> None:
    polygons = [box(i * 10, 0, i * 10 + 5, 7) for i in range(20)]
    ids = ids_from_geometry(polygons)
    assert len(set(ids)) == 20
    assert ids_from_geometry(polygons[::-1]) == ids[::-1]
    assert ids_from_geometry(polygons[3:4]) == ids[3:4]


def test_outlines_over_each_other_are_told_apart() -> None:
    nested = [box(0, 0, 10, 10), box(1, 1, 9, 9), shapely.reverse(box(0, 0, 10, 10))]
    ids = ids_from_geometry(nested)
    assert len(set(ids)) == 3
    assert all("-" in name for name in ids)


def test_numbers_avoid_ids_that_are_there() -> None:
    assert numbered_where_repeated(["a", "a", "a-2", "a"]) == ["a", "a-3", "a-2", "a-4"]


def test_geometry_without_a_place_is_named_by_its_position() -> None:
    named = with_ids([Outline("", Polygon()), Outline("", box(0, 0, 4, 2)), Outline("own", box(0, 0, 1, 1))])
    assert [o.id for o in named] == ["unplaced-1", "20_10", "own"]
