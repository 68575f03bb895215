from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cityflow.windows.candidates import channels_of
from cityflow.windows.window_parameters import WindowParameters
from cityflow.windows.window_search import LAP_M, STRIP_M, found_on, searched, strips
from drawn_walls import CELL_M, rows_of, wall

P = WindowParameters()


def test_windows_are_found_where_they_are_drawn() -> None:
    """To half a cell, 3 cm: what is drawn ends between cells; s counts from the left and t from below."""
    boxes = rows_of(2, 4)
    found = found_on(wall(boxes), P)
    truth = CELL_M * np.column_stack([boxes[:, 0], 100 - boxes[:, 3], boxes[:, 2], 100 - boxes[:, 1]])
    order = np.lexsort((found.bounds[:, 0], -found.bounds[:, 1]))
    assert len(found.bounds) == 8
    np.testing.assert_allclose(found.bounds[order], truth, atol=CELL_M / 2)
    assert found.sure.min() > 0.8
    assert not found.doors.any()
    assert not found.lattice.any()
    assert (found.support == 4).all()


def test_a_mirrored_wall_has_the_mirrored_windows() -> None:
    boxes = np.concatenate([rows_of(2, 3), [(120, 20, 134, 40)]])
    picture = wall(boxes)
    mirrored = replace(picture, light=np.ascontiguousarray(picture.light[:, ::-1]))
    one, other = (np.sort(found_on(p, P).bounds[:, [0, 2]].mean(axis=1)) for p in (picture, mirrored))
    assert len(one) == 7
    np.testing.assert_allclose(np.sort(160 * CELL_M - other), one, atol=CELL_M)


def test_a_wall_somewhere_else_has_its_windows_there() -> None:
    picture = wall(rows_of(2, 4))
    moved = replace(picture, s_min=7.0, t_max=picture.t_max - 3.0)
    offset = np.array([7.0, -3.0, 7.0, -3.0])
    np.testing.assert_allclose(found_on(moved, P).bounds - offset, found_on(picture, P).bounds, atol=1e-9)


def test_a_plain_wall_has_none() -> None:
    found = found_on(wall(), P)
    assert (found.sure < P.least_confidence).all()
    assert found.bounds.shape == (len(found.sure), 4)


@pytest.mark.parametrize(("step", "completed"), [(0.01, []), (0.02, [1.0]), (0.04, [0.0])])
def test_a_faint_window_is_asked_for_by_its_rows_and_marked_so(step: float, completed: list[float]) -> None:
    """Steps of 0.025 are edges, half of that where seven others ask for it: the eighth is not there, asked for, or found by itself."""
    boxes = rows_of(2, 4)
    picture = wall(np.delete(boxes, 5, axis=0), noise=0.003)
    left, top, right, bottom = boxes[5]
    picture.light[top:bottom, left:right] -= step
    found, support, asked = searched(picture, channels_of(picture, P), P)
    at = np.abs(found.boxes - boxes[5]).max(axis=1) <= 2
    assert asked[at].tolist() == completed
    assert support[at].tolist() == [4] * len(completed)
    assert len(found) == 7 + len(completed)
    assert asked.sum() == sum(completed)


@pytest.mark.parametrize(("wide_m", "count"), [(9.6, 1), (STRIP_M, 1), (41.0, 2), (130.0, 4)])
def test_strips_cover_a_long_wall_each_place_once(wide_m: float, count: int) -> None:
    picture = replace(wall(shape=(10, round(wide_m / 0.1))), cell=0.1, s_min=5.0)
    parts = strips(picture)
    assert len(parts) == count
    assert parts[0][1] == -np.inf
    assert parts[-1][2] == np.inf
    for (_, _, high), (_, low, _) in pairwise(parts):
        assert high == low
    for part, low, high in parts:
        end = part.s_min + part.light.shape[1] * part.cell
        assert part.s_min <= max(low - LAP_M, 5.0) + 0.1
        assert end >= min(high + LAP_M, 5.0 + wide_m) - 0.1
        assert min(high, 5.0 + wide_m) - max(low, 5.0) <= STRIP_M + 0.1
        first = round((part.s_min - 5.0) / 0.1)
        np.testing.assert_array_equal(part.light, picture.light[:, first : first + part.light.shape[1]])
