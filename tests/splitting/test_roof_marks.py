"""Marks of roofs laid out in rows whose borders are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import RoofMarks, roof_marks, roof_rows
from cityflow.splitting.scores.roof_step import roof_step
from cityflow.splitting.strips.strip_evidence import StripEvidence
from cityflow.splitting.strips.strip_rasters import RoofRaster

CELL_M, ROWS = 0.2, 20
U = np.arange(0.0, 24.0, CELL_M)
BORDER_M = 12.13


def rows_of(profile: FloatArray, share: float = 1.0, other: FloatArray | None = None) -> FloatArray:
    """A roof with one profile in a share of its rows and another, or a level one, in the rest."""
    level = np.full_like(U, 8.0) if other is None else other
    count = round(share * ROWS)
    rows = np.column_stack([profile] * count + [level] * (ROWS - count))
    return np.asarray(rows + np.random.default_rng(3).normal(0, 0.03, rows.shape))


def marks_of(profile: FloatArray, share: float = 1.0, other: FloatArray | None = None) -> RoofMarks:
    return roof_marks(rows_of(profile, share, other), U)


def at_border(marks: RoofMarks, values: FloatArray) -> float:
    return float(values[np.abs(marks.u - BORDER_M) < 0.25].max())


def gables(width: float = 5.0) -> FloatArray:
    return 6.0 + 0.9 * np.abs((U - BORDER_M + width / 2) % width - width / 2)


def test_valley_between_gables() -> None:
    marks = marks_of(gables())
    assert at_border(marks, marks.valley) > 0.9
    near = np.abs(marks.u - BORDER_M) < 0.25
    assert np.abs(marks.bottom[near] - BORDER_M).max() < 0.08


def test_ridge_is_no_border() -> None:
    marks = marks_of(gables())
    ridge = np.abs(marks.u - (BORDER_M + 2.5)) < 0.9
    assert marks.marked[ridge].max() < 0.1
    assert marks.ridge[ridge].max() > 0.9


@pytest.mark.parametrize("height", [0.4, -1.0])
def test_step(height: float) -> None:
    rows = rows_of(np.where(U > BORDER_M, 8.0 + height, 8.0))
    marks, seen = roof_marks(rows, U), cast(StripEvidence, SimpleNamespace(rows=rows, roof=SimpleNamespace(u=U)))
    assert at_border(marks, marks.step) > 0.9
    assert roof_step(seen, BORDER_M, (-np.inf, np.inf)).size == pytest.approx(abs(height), abs=0.15)
    assert marks.marked[np.abs(marks.u - BORDER_M) > 1.0].max() < 0.1


def test_firewall_and_trench() -> None:
    close = np.abs(U - BORDER_M) < 0.3
    wall, trench = (marks_of(np.where(close, z, 8.0)) for z in (8.5, 3.0))
    assert at_border(wall, wall.wall) > 0.9
    assert at_border(trench, trench.trench) > 0.9
    assert at_border(wall, wall.trench) == at_border(trench, trench.wall) == 0.0


def test_dormer_steps_along_too_little_of_the_depth() -> None:
    marks = marks_of(np.where(np.abs(U - BORDER_M) < 1.3, 9.5, 8.0), share=0.2)
    assert marks.marked.max() < 0.25


def test_unknown_roof_has_no_marks() -> None:
    marks = roof_marks(np.full((len(U), ROWS), np.nan), U)
    assert not marks.step.any()
    assert not marks.valley.any()
    assert np.isnan(marks.bottom).all()


def test_row_shorter_than_the_windows() -> None:
    marks = roof_marks(np.full((5, ROWS), 8.0), U[:5])
    assert not marks.step.any()


def test_rows_lie_where_they_lie_whatever_the_outline_s_extremes() -> None:
    """A bay of three cells at one side, and a raster that begins elsewhere: the rows between are the same."""
    height = np.random.default_rng(5).normal(8.0, 1.0, (40, 60)).astype(np.float32)
    u, v = np.linspace(0.05, 3.95, 40), np.linspace(0.0, 5.9, 60)

    def rows(first: int, bay: int) -> FloatArray:
        known = height.copy()
        known[:, : 20 - bay], known[10:, :20] = np.nan, np.nan
        nothing = np.empty((40, 60 - first, 0), np.float32)
        return roof_rows(RoofRaster(u, v[first:], known[:, first:], nothing, nothing, np.isfinite(known[:, first:])))

    plain = rows(0, 0)
    assert plain.shape == (40, 10)
    for other in (rows(0, 3), rows(6, 3), rows(7, 0)):
        assert np.array_equal(other[:, -10:], plain)
