"""Windows between open shutters. All boxes of one size on a façade are tested together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.windows.box_edges import Edges, box_areas, box_sums, completeness, integral
from cityflow.windows.candidates import ALIGN_M, Candidates, measured, sized
from cityflow.windows.facade_picture import Picture
from cityflow.windows.proposals import WHOLE
from cityflow.windows.rows import in_row, overlap
from cityflow.windows.window_parameters import WindowParameters

SHARES = np.concatenate([[0.0], np.linspace(0.06, 0.44, 25)])
"""Tested ends of a wing, as shares of the width of the window with both wings; a frame ends before `WING`, a casement after it; set by hand on drawn
façades."""
WING = (0.165, 0.345)
"""Set by hand on drawn façades, as are those below."""
WING_PX = 2.0
"""Least width of a wing, pixels; set by hand on drawn façades."""
LEAST_STEP = 0.3
"""Mean step from wing to window over all boxes of a size, in thresholds of the façade's edges."""
OUTER = 0.08
"""Least step from wing to window, as a share of the step from wall to wing."""
EVEN = 1.6
"""Least ratio of the mean of both wings' steps to their difference: shutters are a pair."""
LEVEL = 0.8
"""Least step from the middle of the window to the wall above and below it, in thresholds."""
APART_M = 0.12
"""Edges nearer to each other are one; set by hand."""
ENDS = 0.5
"""Least completeness of a window's lintel and sill next to its wings; mean over all boxes of one size."""
VALLEY = 0.75
"""Most of the smallest step between the edges of a wing, as a share of the step at its inner edge: a blurred edge of a window has no such minimum."""
BAND = 0.1
"""Width that is compared on either side of a wing's end, as a share of the whole width."""


def between_shutters(
    found: Candidates, picture: Picture, channels: Sequence[Edges], parameters: WindowParameters
) -> Candidates:
    """Windows between open shutters; `around` of each is the window with both wings.

    One window is rarely evidence enough: wings may be as dark as the glass, and a curtain looks like a wing. Shutters are a pair, and are alike at all
    windows of one size. So the steps at equal places of all these windows are averaged.
    """
    shut = np.unique(np.concatenate([_around(found, picture, parameters), _between(found, picture)]), axis=0)
    shut = shut[_filled(shut, picture, channels)]
    if len(shut) == 0:
        return found.of(np.zeros(0, np.int64))
    weights = _alike(shut)
    share, good = _wings(shut, weights, picture, channels)
    wide = shut[:, 2] - shut[:, 0]
    wing = np.rint(share * wide).astype(np.int64)
    pane = np.stack([shut[:, 0] + wing, shut[:, 1], shut[:, 2] - wing, shut[:, 3]], axis=1)
    good &= (wing >= WING_PX) & sized(pane, picture, parameters)
    good &= _mean(_holds_a_window(pane, found, picture), weights) < 0.3
    good &= _mean(_ends(pane, channels), weights) >= ENDS
    return _with_wings(pane[good], shut[good], picture, channels)


def _with_wings(pane: IntArray, shut: IntArray, picture: Picture, channels: Sequence[Edges]) -> Candidates:
    """Panes as candidates; each takes the better figures of itself and of the whole with its wings."""
    made = [measured(picture, channels, k, pane) for k in range(len(channels))]
    whole = [measured(picture, channels, k, shut) for k in range(len(channels))]
    best = np.stack([w.sides.mean(axis=1) + np.clip(w.steps.mean(axis=1), 0, 3) / 3 for w in whole]).argmax(axis=0)
    out, around = (
        Candidates.joined([m.of(best == k) for k, m in enumerate(parts)]).of(np.argsort(_order(best), kind="stable"))
        for parts in (made, whole)
    )
    return replace(
        out, sides=np.maximum(out.sides, around.sides), steps=np.maximum(out.steps, around.steps),
        contrast=np.maximum(out.contrast, around.contrast), around=around.boxes,
    )  # fmt: skip


def _order(best: IntArray) -> IntArray:
    """Position of each before it was sorted by channel."""
    return np.argsort(best, kind="stable")


def _alike(shut: IntArray) -> FloatArray:
    """(N, N) weights of boxes of the same size as each; those that lie upon one another share one."""
    size = (shut[:, 2:] - shut[:, :2]).astype(np.float64)
    off = np.abs(size[:, None] - size[None])
    alike = (off <= np.maximum(0.12 * size[:, None], 2.0)).all(axis=2)
    same = overlap(shut, shut)[0] > 0.5
    return np.asarray(alike / np.maximum((alike & same).sum(axis=0), 1), np.float64)


def _mean(values: FloatArray | BoolArray, weights: FloatArray) -> FloatArray:
    """Means of values (N, …) over all boxes of the size of each."""
    return np.asarray(weights @ values / weights.sum(axis=1)[:, *[None] * (values.ndim - 1)])


def _holds_a_window(pane: IntArray, found: Candidates, picture: Picture) -> BoolArray:
    """(N,) whether a whole box as high as the pane stands in it, with wall on both sides: then the wings are windows themselves."""
    whole = found.boxes[found.sides.min(axis=1) >= WHOLE]
    tolerance = max(picture.pixels(ALIGN_M), 1.5)
    level = (np.abs(pane[:, None, [1, 3]] - whole[None, :, [1, 3]]) <= tolerance).all(axis=2)
    least = max(picture.pixels(APART_M), 2.0)
    apart = (whole[None, :, 0] - pane[:, None, 0] >= least) & (pane[:, None, 2] - whole[None, :, 2] >= least)
    wide = (whole[:, 2] - whole[:, 0])[None] >= 0.4 * (pane[:, 2] - pane[:, 0])[:, None]
    return np.asarray((level & apart & wide).any(axis=1))


def _ends(pane: IntArray, channels: Sequence[Edges]) -> FloatArray:
    """(N,) completeness of lintel and sill right beside the wings, of the worse of both: where wall lies there, the wings are windows themselves."""
    quarter = np.maximum((pane[:, 2] - pane[:, 0]) // 4, 1)
    worst = np.ones(len(pane))
    for start in (pane[:, 0], pane[:, 2] - quarter):
        part = np.stack([start, pane[:, 1], start + quarter, pane[:, 3]], axis=1)
        worst = np.minimum(worst, np.max([completeness(k, part)[:, [1, 3]].min(axis=1) for k in channels], axis=0))
    return worst


def _wings(
    shut: IntArray, weights: FloatArray, picture: Picture, channels: Sequence[Edges]
) -> tuple[FloatArray, BoolArray]:
    """(N,) share of the width that a wing takes, and whether there are wings."""
    share, rows = SHARES, np.arange(len(shut))
    even, uneven = np.zeros((len(shut), len(share))), np.zeros((len(shut), len(share)))
    for values, threshold in _values(picture, channels):
        left, right = _steps_at(shut, values)
        even += _mean(np.abs((left + right) / 2 / threshold), weights) ** 2
        uneven += _mean(np.abs((left - right) / 2 / threshold), weights) ** 2
    at = np.where((share >= WING[0]) & (share <= WING[1]), even, -1).argmax(axis=1)
    top, side = np.sqrt(even[rows, at]), np.sqrt(uneven[rows, at])
    outside = np.sqrt(np.where(share[at][:, None] > share, even, np.inf).min(axis=1))
    inside = np.sqrt(np.where(share > WING[1], even, 0).max(axis=1))
    good = (
        (top >= np.maximum(LEAST_STEP, OUTER * np.sqrt(even[:, 0])))
        & (top >= EVEN * side)
        & (outside <= VALLEY * top)
        & (inside <= top)
    )
    return share[at], np.asarray(good)


def _values(picture: Picture, channels: Sequence[Edges]) -> list[tuple[Float32Array, float]]:
    """Sums of brightness, and of hue where it tells something, with the threshold of their edges."""
    values = [picture.light, picture.hue][: len(channels) // 2]
    return [(integral(v), channels[2 * k].threshold) for k, v in enumerate(values)]


def _steps_at(shut: IntArray, values: Float32Array) -> tuple[FloatArray, FloatArray]:
    """(N, S) and (N, S): brightness inside less that outside of each share of the width, from the left and from the right; lintel and sill left out."""
    x_0, x_1 = shut[:, [0]].astype(np.float64), shut[:, [2]].astype(np.float64)
    wide, high = x_1 - x_0, shut[:, 3] - shut[:, 1]
    top, bottom = shut[:, 1] + high // 6, shut[:, 3] - high // 6
    band = np.maximum(BAND * wide, 1.0)
    below, above = values[bottom], values[top]
    columns = np.arange(values.shape[1])
    steps = []
    for start, way in ((x_0, 1.0), (x_1, -1.0)):
        edge = start + way * SHARES * wide
        total = [_between_columns(below - above, columns, edge, edge + way * d * band) for d in (1, -1)]
        steps.append((total[0] - total[1]) / (band * np.maximum(bottom - top, 1)[:, None]))
    return steps[0], steps[1]


def _between_columns(sums: Float32Array, columns: IntArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """(N, S) of sums (N, C) that grow from column to column: what lies between columns a and b, which need not be whole."""
    at = [_interpolated(sums, np.clip(v, 0, columns[-1])) for v in (np.minimum(a, b), np.maximum(a, b))]
    return at[1] - at[0]


def _interpolated(sums: Float32Array, at: FloatArray) -> FloatArray:
    low = np.minimum(np.floor(at).astype(np.int64), sums.shape[1] - 2)
    rows, part = np.arange(len(sums))[:, None], at - low
    return np.asarray((1 - part) * sums[rows, low] + part * sums[rows, low + 1])


def _filled(shut: IntArray, picture: Picture, channels: Sequence[Edges]) -> BoolArray:
    """(N,) whether the middle differs from the wall above and below: else it is wall, and the wings belong to the next windows, or are windows themselves."""
    side = (3 * (shut[:, 2] - shut[:, 0])) // 8
    middle = np.stack([shut[:, 0] + side, shut[:, 1], shut[:, 2] - side, shut[:, 3]], axis=1)
    level, size = np.zeros(len(shut)), max(round(picture.pixels(0.25)), 2)
    for values, threshold in _values(picture, channels):
        steps = [_across(middle, values, side, size) / threshold for side in (1, 3)]
        level = np.maximum(level, np.where(steps[0] * steps[1] > 0, np.minimum(*np.abs(steps)), 0.0))
    return np.asarray(level >= LEVEL)


def _across(boxes: IntArray, values: Float32Array, side: int, size: int) -> FloatArray:
    """(N,) mean of a strip within boxes along their top (1) or bottom (3) less that of one outside, with the edge itself left out."""
    way = 1 if side == 1 else -1
    strips = []
    for near, far in ((1, 1 + size), (-1 - size, -1)):
        strip = boxes.copy()
        ends = np.sort(np.stack([boxes[:, side] + way * near, boxes[:, side] + way * far]), axis=0)
        strip[:, 1], strip[:, 3] = ends
        strip[:, [1, 3]] = np.clip(strip[:, [1, 3]], 0, values.shape[0] - 1)
        strips.append(box_sums(values, strip) / np.maximum(box_areas(strip), 1))
    return strips[0] - strips[1]


def _around(found: Candidates, picture: Picture, parameters: WindowParameters) -> IntArray:
    """Whole wide boxes: windows with their shutters, at a brightness where both are one."""
    wide, high = ((found.boxes[:, k + 2] - found.boxes[:, k]).astype(np.float64) for k in (0, 1))
    return found.boxes[
        (wide >= 0.55 * high)
        & (wide <= 3 * high)
        & (found.sides.min(axis=1) >= WHOLE)
        & (wide * picture.cell >= 2 * parameters.least_m)
    ]


def _between(found: Candidates, picture: Picture) -> IntArray:
    """From wing to wing of pairs of equal narrow boxes, with twice their width between them."""
    tolerance = max(picture.pixels(ALIGN_M) / 2, 1.0)
    parts = [np.empty((0, 4), np.int64)]
    for channel in np.unique(found.channel):
        b = found.boxes[found.channel == channel]
        one, other = np.nonzero(in_row(b, b, tolerance) & (b[:, None, 0] < b[None, :, 0]))
        gap, wide = b[other, 0] - b[one, 2], 0.5 * (b[one, 2] - b[one, 0] + b[other, 2] - b[other, 0])
        pair: BoolArray = (gap >= 1.5 * wide) & (gap <= 2.6 * wide)
        parts.append(
            np.concatenate([np.minimum(b[one, :2], b[other, :2]), np.maximum(b[one, 2:], b[other, 2:])], axis=1)[pair]
        )
    return np.concatenate(parts)
