from __future__ import annotations

from dataclasses import replace

import pytest
import shapely
from shapely import LineString, Polygon, box

from cityflow.core.splitting import CutLine, Splitting
from cityflow.splitting.cuts.moved_cuts import with_moved_cuts
from cityflow.splitting.partition import partition

ROW, LEAST_M2 = box(0, 0, 60, 10), 20.0


def _cut(x: float, kind: str = "cut") -> CutLine:
    return CutLine(LineString([(x, 0), (x, 10)]), kind, confidence=0.8)


def _split(*cuts: CutLine, gaps: tuple[Polygon, ...] = ()) -> Splitting:
    units = partition(ROW, [c.line for c in cuts if c.kind == "cut"], gaps, LEAST_M2).units
    return Splitting(units, cuts, (_cut(33.0),), notes=(("candidates", 3.0),))


def _borders(splitting: Splitting) -> list[float]:
    return sorted({x for u in splitting.units for x in shapely.get_coordinates(u)[:, 0].round(3).tolist()})


def test_a_cut_moves_to_its_right_and_units_stay_noded() -> None:
    before = _split(_cut(20), _cut(40))
    after = with_moved_cuts(before, ROW, [0.6, -0.35], LEAST_M2)
    assert _borders(after) == [0.0, 20.6, 39.65, 60.0]
    assert sum(u.area for u in after.units) == pytest.approx(ROW.area)
    assert [shapely.get_coordinates(c.line)[0, 0] for c in after.cut_lines] == pytest.approx([20.6, 39.65])
    assert (after.rejected, dict(after.notes)) == (
        before.rejected,
        {"candidates": 3.0, "borders_seen": 2.0, "borders_moved": 2.0},
    )


def test_nothing_moves_where_nothing_is_seen() -> None:
    before = _split(_cut(20), _cut(40))
    after = with_moved_cuts(before, ROW, [0.0, 0.0], LEAST_M2)
    assert replace(after, notes=before.notes) == before


def test_a_gap_keeps_its_place() -> None:
    gap = (_cut(40, "gap"), _cut(42, "gap"))
    after = with_moved_cuts(_split(_cut(20), *gap, gaps=(box(40, 0, 42, 10),)), ROW, [0.5], LEAST_M2)
    assert _borders(after) == [0.0, 20.5, 40.0, 42.0, 60.0]
    assert after.cut_lines[1:] == gap


def test_a_cut_that_would_leave_a_unit_too_small_stays() -> None:
    after = with_moved_cuts(_split(_cut(2.1), _cut(40)), ROW, [-0.5, 0.5], LEAST_M2)
    assert _borders(after) == [0.0, 2.1, 40.5, 60.0]
    assert dict(after.notes)["borders_moved"] == 1.0
