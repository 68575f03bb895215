"""Edits that stand at known places."""

from __future__ import annotations

import shapely
from shapely import LineString, Point, Polygon, box

from cityflow.core.edits import DrawnOutline, Edits, SetRoofType, as_outline, edits_digest

HOUSE = box(0.0, 0.0, 10.0, 10.0)


def edits() -> Edits:
    return Edits(
        outlines=(DrawnOutline(box(0, 0, 10, 10), "h1", True), DrawnOutline(box(50, 0, 60, 10))),
        cut_lines=(LineString([(5, 0), (5, 10)]),),
        no_cut_lines=(LineString([(55, 0), (55, 10)]),),
        rejected=(Point(30.0, 5.0), box(80, 0, 90, 10)),
        notes=("from a file",),
        roof_types=(SetRoofType(Point(5.0, 5.0), "gable"), SetRoofType(box(50, 0, 60, 10), "hip")),
    )


def test_all_edits_are_counted_and_the_locked_ones_known() -> None:
    assert len(edits()) == 8
    assert [p.bounds for p in edits().locked] == [(0, 0, 10, 10)]
    assert len(Edits()) == 0


def test_an_edit_acts_up_to_a_metre_beyond_itself() -> None:
    """A box 0.9 m to the right of the first house meets that and its roof's polygon, not the point in its middle."""
    near = edits().within((10.9, 0.0, 12.0, 10.0))
    assert [o.id for o in near.outlines] == ["h1"]
    assert len(near) == 1
    assert len(edits().within((11.1, 0.0, 12.0, 10.0))) == 0
    assert near.notes == ()


def test_what_acts_under_a_house_is_found_and_nothing_else() -> None:
    found = edits().near(box(52, 2, 58, 8))
    assert [o.id for o in found.outlines] == [""]
    assert [r.roof_type for r in found.roof_types] == ["hip"]
    assert (len(found.cut_lines), len(found.no_cut_lines), len(found.rejected)) == (0, 1, 0)


def test_lines_bring_edits_back_bit_for_bit() -> None:
    odd = Edits(outlines=(DrawnOutline(Polygon([(0.1, 1 / 3), (1e6 + 0.7, 0.1), (5, 2e-7)]), 'a "b" ü'),))
    for given in (edits(), odd, Edits()):
        back = Edits.from_lines(given.lines())
        assert back.lines() == given.lines()
        assert [(o.id, o.locked, o.polygon) for o in back.outlines] == [(o.id, o.locked, o.polygon) for o in given.outlines]  # fmt: skip
        assert [(r.roof_type, r.place) for r in back.roof_types] == [(r.roof_type, r.place) for r in given.roof_types]
        assert (back.cut_lines, back.no_cut_lines, back.rejected) == (given.cut_lines, given.no_cut_lines, given.rejected)  # fmt: skip


def test_a_roof_type_is_that_of_a_point_in_the_house_or_of_a_polygon_over_half_of_it() -> None:
    def of(place: shapely.Geometry) -> str:
        return Edits(roof_types=(SetRoofType(place, "gable"),)).roof_type_of(HOUSE)

    assert of(Point(9.9, 9.9)) == "gable"
    assert of(Point(10.1, 5.0)) == ""
    assert of(box(-5.0, 0.0, 5.1, 10.0)) == "gable"
    assert of(box(-50.0, 0.0, 4.9, 10.0)) == ""
    assert Edits().roof_type_of(HOUSE) == ""


def test_of_several_roof_types_the_last_counts() -> None:
    places = [SetRoofType(Point(5, 5), name) for name in ("gable", "hip", "flat")]
    assert Edits(roof_types=tuple(places)).roof_type_of(HOUSE) == "flat"


def test_a_digest_changes_with_what_acts_on_the_place_only() -> None:
    here, before = box(0, 0, 10, 10), edits_digest(edits(), HOUSE)
    far = Edits(**{**fields_of(edits()), "rejected": (Point(30.0, 5.0),), "notes": ()})
    assert edits_digest(far, HOUSE) == before != ""
    moved = Edits(**{**fields_of(edits()), "cut_lines": (LineString([(5.001, 0), (5, 10)]),)})
    assert edits_digest(moved, HOUSE) != before
    unlocked = Edits(**{**fields_of(edits()), "outlines": (DrawnOutline(here, "h1", False),)})
    assert edits_digest(unlocked, HOUSE) != before
    assert edits_digest(edits(), (0.0, 0.0, 10.0, 10.0)) == before
    assert edits_digest(edits(), (200.0, 0.0, 210.0, 10.0)) == ""


def test_the_order_of_outlines_counts() -> None:
    one, two = DrawnOutline(box(0, 0, 6, 10)), DrawnOutline(box(4, 0, 10, 10))
    assert edits_digest(Edits(outlines=(one, two)), HOUSE) != edits_digest(Edits(outlines=(two, one)), HOUSE)


def fields_of(given: Edits) -> dict:  # type: ignore[type-arg]
    return {name: getattr(given, name) for name in Edits.__dataclass_fields__}


def test_a_drawn_polygon_becomes_an_outline() -> None:
    """Clockwise, with a height, a repeated vertex, a hole, and coordinates finer than 0.1 mm."""
    ring = [(0, 0, 7), (0, 10.00004, 7), (10, 10, 7), (10.00001, 10, 7), (10, -0.00001, 7)]
    hole = [(4, 4, 7), (6, 4, 7), (6, 6, 7), (4, 6, 7)]
    made = as_outline(Polygon(ring, [hole]))
    assert not made.has_z
    assert made.exterior.is_ccw
    assert not made.interiors[0].is_ccw
    assert sorted(set(made.exterior.coords)) == [(0.0, 0.0), (0.0, 10.0), (10.0, 0.0), (10.0, 10.0)]
    assert len(made.exterior.coords) == 5
    assert made.area == 96.0
    assert "-0" not in made.wkt
