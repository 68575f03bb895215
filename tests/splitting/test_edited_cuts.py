from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon, box

from cityflow.core.edits import DrawnOutline, Edits
from cityflow.core.splitting import CutLine, Splitting
from cityflow.splitting.cuts.edited_cuts import LOCKED, edited_cuts, with_edits
from cityflow.splitting.partition import partition

ROW = box(0, 0, 60, 10)


def _cut(x: float, kind: str = "cut", lean: float = 0.0) -> CutLine:
    return CutLine(LineString([(x, 0), (x + lean, 10)]), kind, confidence=0.8)


def _split(*cuts: CutLine, gaps: tuple[Polygon, ...] = ()) -> Splitting:
    result = partition(ROW, [c.line for c in cuts if c.kind != "gap"], gaps)
    return Splitting(result.units, cuts, (_cut(33.0),), notes=(("candidates", 3.0),))


def _widths(splitting: Splitting) -> list[float]:
    return [round(u.area / 10, 1) for u in splitting.units]


def test_without_an_edit_here_nothing_is_touched() -> None:
    found = _split(_cut(20), _cut(40))
    elsewhere = Edits((DrawnOutline(box(90, 0, 99, 9), locked=True),), (LineString([(70, 0), (70, 10)]),))
    assert with_edits(found, ROW, elsewhere) is found
    assert with_edits(found, ROW, Edits()) is found


def test_a_drawn_line_cuts_however_small_the_unit() -> None:
    edits = Edits(cut_lines=(LineString([(58.5, -0.2), (58.5, 10.2)]), LineString([(30, 0), (30, 10)])))
    result = with_edits(_split(_cut(20), _cut(40)), ROW, edits)
    assert _widths(result) == [20.0, 10.0, 10.0, 18.5, 1.5]
    assert [(c.kind, c.confidence) for c in result.cut_lines[:2]] == [("edit", 1.0), ("edit", 1.0)]


def test_a_drawn_line_takes_the_place_of_the_found_one_beside_it() -> None:
    result = with_edits(_split(_cut(20), _cut(40)), ROW, Edits(cut_lines=(LineString([(40.6, 10), (40.6, 0)]),)))
    assert _widths(result) == [20.0, 20.6, 19.4]
    assert _cut(40) in result.rejected


def test_a_forbidden_line_is_not_cut_and_stays_to_be_seen() -> None:
    found = _split(_cut(20), _cut(40))
    result = with_edits(found, ROW, Edits(no_cut_lines=(LineString([(39.2, 1), (39.4, 8)]),)))
    assert _widths(result) == [20.0, 40.0]
    assert result.rejected == (*found.rejected, _cut(40))
    assert (
        with_edits(_split(_cut(40)), ROW, Edits(no_cut_lines=(_cut(40).line,))).reason
        == "every cut line forbidden by edits"
    )


def test_gaps_stay_until_one_of_their_sides_is_forbidden() -> None:
    gap = box(30, 0, 32, 10)
    found = _split(_cut(15), _cut(30, "gap"), _cut(32, "gap"), gaps=(gap,))
    assert _widths(found) == [15.0, 15.0, 28.0]
    more = with_edits(found, ROW, Edits(cut_lines=(_cut(45).line,)))
    assert _widths(more) == [15.0, 15.0, 13.0, 15.0]
    assert [c.kind for c in more.cut_lines] == ["edit", "cut", "gap", "gap"]
    filled = with_edits(found, ROW, Edits(no_cut_lines=(_cut(32.2).line,)))
    assert _widths(filled) == [15.0, 45.0]
    assert [c.kind for c in filled.cut_lines] == ["cut"]


def test_a_locked_outline_stays_whole() -> None:
    edits = Edits((DrawnOutline(ROW, locked=True),), cut_lines=(_cut(20).line,))
    result = with_edits(_split(_cut(20)), ROW, edits)
    assert (result.units, result.cut_lines, result.reason) == ((ROW,), (), LOCKED)
    beside = Edits((DrawnOutline(box(60, 0, 70, 10), locked=True),))
    assert with_edits(_split(_cut(20)), ROW, beside).reason == ""


def test_a_drawn_line_that_cuts_nothing_is_said() -> None:
    result = with_edits(_split(_cut(20)), ROW, Edits(cut_lines=(LineString([(40, 3), (40, 7)]),)))
    assert result.reason == "drawn cut line: ends inside the outline, more than 0.5 m from its border"
    assert _widths(result) == [20.0, 40.0]


@pytest.mark.parametrize(
    ("line", "out"),
    [
        (((20.9, 0), (20.9, 10)), True),
        (((21.2, 0), (21.2, 10)), False),
        (((20.5, 10), (20.5, 6)), True),
        (((20.5, 10), (20.5, 16)), False),
        (((19.3, 0), (20.7, 10)), True),
        (((18.5, 0), (21.5, 10)), False),
    ],
)
def test_beside_means_within_a_metre_and_parallel(line: tuple[tuple[float, float], ...], out: bool) -> None:
    kept, gone = edited_cuts([_cut(20)], Edits(no_cut_lines=(LineString(line),)))
    assert (len(kept), len(gone)) == ((0, 1) if out else (1, 0))


def test_turned_and_far_from_the_origin() -> None:
    def turned(xy: np.ndarray) -> np.ndarray:
        a = np.radians(31.0)
        return np.asarray(
            np.round(xy @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) + [450_000.0, 5_800_000.0], 4)
        )

    row = shapely.transform(ROW, turned)
    cuts = tuple(CutLine(shapely.transform(_cut(x).line, turned), "cut") for x in (20, 40))
    found = Splitting(partition(row, [c.line for c in cuts]).units, cuts)
    edits = Edits(
        cut_lines=(shapely.transform(_cut(30).line, turned),),
        no_cut_lines=(shapely.transform(_cut(20.4).line, turned),),
    )
    result = with_edits(found, row, edits)
    assert _widths(result) == [30.0, 10.0, 20.0]
    assert shapely.coverage_is_valid(list(result.units))
