"""Candidates side by side: a column each, pictures where there is a solid."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image
from shapely import box

from cityflow.reconstruction.extruded import extrude
from cityflow.viewer.candidate_view import GAP_PX, PAPER, SIDES_DEG, VIEW_PX, DrawnCandidate, draw_candidates

BLOCK = extrude(box(0, 0, 12, 8), 0.0, 6.0)


def _pixels(*candidates: DrawnCandidate) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(draw_candidates(candidates))).convert("RGB")).astype(int)


def test_a_column_for_each_candidate_and_four_views_in_it() -> None:
    sheet = _pixels(DrawnCandidate(BLOCK, ("planes", "penalty 0.1"), True), DrawnCandidate(None, ("block", "no solid")))
    assert sheet.shape[1] == 2 * (VIEW_PX + GAP_PX)
    paper = (sheet == np.array(PAPER)).all(axis=2)
    views = sheet.shape[0] - len(SIDES_DEG) * (VIEW_PX + GAP_PX)
    for k in range(len(SIDES_DEG)):
        rows = slice(views + k * (VIEW_PX + GAP_PX), views + k * (VIEW_PX + GAP_PX) + VIEW_PX)
        assert not paper[rows, :VIEW_PX].any()
        assert paper[rows, VIEW_PX + GAP_PX : -GAP_PX].all()


def test_the_sides_differ_and_the_kept_one_is_marked() -> None:
    kept, other = (_pixels(DrawnCandidate(BLOCK, ("planes",), k)) for k in (True, False))
    head = kept.shape[0] - len(SIDES_DEG) * (VIEW_PX + GAP_PX)
    assert (kept[:head] != other[:head]).any()
    assert np.array_equal(kept[head:], other[head:])
    first, second = (kept[head + k * (VIEW_PX + GAP_PX) :][:VIEW_PX] for k in (0, 1))
    assert (first != second).any()
