"""Outlines as lines of text: bit for bit the same when read again, each by its byte range."""

from __future__ import annotations

import hashlib

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from cityflow.core.building import Outline
from cityflow.handover.outline_lines import (
    Standing,
    decode,
    decode_all,
    encode,
    entries,
    lines,
    owned,
    touching,
)
from cityflow.outlines.noded.adjacency import party_edges

coordinate = st.floats(-1e7, 1e7, allow_nan=False).map(lambda v: round(v, 4))
text = st.text(max_size=20)
scalar = (
    st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False, allow_infinity=False) | text
)


@st.composite
def standings(draw: st.DrawFn) -> Standing:
    x, y = draw(coordinate), draw(coordinate)
    polygon = shapely.box(x, y, x + 20, y + 10).difference(shapely.box(x + 5, y + 3, x + 8, y + 6))
    attributes = draw(st.dictionaries(text, scalar, max_size=4))
    neighbours = tuple(draw(st.lists(text, max_size=3)))
    return Standing(
        Outline(draw(text), polygon, attributes, draw(text)), neighbours, tuple(draw(st.lists(text, max_size=2)))
    )


@given(standings())
def test_a_line_read_again_is_the_same_outline(standing: Standing) -> None:
    again = decode(encode(standing))
    assert np.array_equal(
        shapely.get_coordinates(again.outline.polygon), shapely.get_coordinates(standing.outline.polygon)
    )
    assert again.outline.attributes == standing.outline.attributes
    assert (again.outline.id, again.outline.remark) == (standing.outline.id, standing.outline.remark)
    assert (again.neighbours, again.neighbour_tiles) == (standing.neighbours, standing.neighbour_tiles)


@given(st.lists(standings(), max_size=5))
def test_entries_point_at_their_lines(given_ones: list[Standing]) -> None:
    written = lines(given_ones)
    found = entries(written, "some/path")
    assert [e["id"] for e in found] == sorted(s.outline.id for s in given_ones)
    for entry, standing in zip(found, decode_all(written), strict=True):
        line = written[entry["start"] : entry["start"] + entry["length"]]
        assert decode(line).outline.id == standing.outline.id == entry["id"]
        assert hashlib.sha256(line).hexdigest() == entry["digest"]


def test_neighbours_share_a_vertex_even_where_they_share_no_edge() -> None:
    boxes = {"sw": (0, 0), "se": (10, 0), "nw": (0, 10), "ne": (10, 10), "far": (40, 40)}
    outlines = [Outline(i, shapely.box(x, y, x + 10, y + 10)) for i, (x, y) in boxes.items()]
    found = touching(outlines)
    assert found["sw"] == {"se", "nw", "ne"}
    assert found["far"] == set()
    dealt = owned(outlines, 15.0, {"0_0", "1_0", "0_1", "1_1"})
    mine = {s.outline.id: s for s in dealt["0_0"]}
    assert mine["sw"].neighbours == ("ne", "nw", "se")
    assert [s.outline.id for s in dealt["3_3"]] == ["far"]


def test_an_outline_knows_the_edges_that_others_have_too() -> None:
    first = Outline("a", shapely.box(0, 0, 10, 8))
    beside = Outline("b", shapely.Polygon([(10, 0), (18, 0), (18, 8), (10, 8)]))
    corner_only = Outline("c", shapely.box(18, 8, 25, 12))
    found = party_edges([first, beside, corner_only])
    assert [shapely.get_coordinates(e).tolist() for e in found["a"]] in ([[[10, 0], [10, 8]]], [[[10, 8], [10, 0]]])
    assert found["c"] == ()
    standing = owned([first, beside, corner_only], 100.0, {"0_0"})["0_0"][0]
    again = decode(encode(standing)).outline
    assert len(again.party) == 1
    assert again.party[0].length == 8.0
