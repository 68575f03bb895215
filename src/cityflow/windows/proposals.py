"""Boxes that come from other boxes: panes fused over their bars, grown over their frames, found between their shutters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.windows.candidates import Candidates, judged, sized
from cityflow.windows.edges import Edges, step_any, strength
from cityflow.windows.picture import Picture
from cityflow.windows.rows import in_row
from cityflow.windows.window_parameters import WindowParameters

MULLION_M, MULLION_PX = 0.3, 4.0
MULLIONED_M = 1.9
"""Bars, and, where pixels are coarse, of windows up to a certain width, what may be one."""
LAP_PX = 2
"""Cells by which boxes on both sides of a bar may overlap: each ends at the farther edge of it."""
FRAME_M = 0.2
WING_STEP, WING_PX = 0.2, 3
"""Step between a shutter and the window by that between the shutter and the wall, and width of a shutter in cells: what is less is a blurred edge."""
APART_M = 0.12
WHOLE = 0.7
"""Completeness of the worst side from which a box is whole."""


def fused(found: Candidates, picture: Picture, looks: Sequence[Edges], parameters: WindowParameters) -> Candidates:
    """Pairs of boxes with a bar between them, side by side and equally high or one above the other and equally wide, as one box each."""
    tolerance = max(picture.pixels(parameters.align_m) / 2, 1.5)
    parts = [found.of(np.zeros(0, np.int64))]
    for look in range(len(looks)):
        boxes = found.boxes[(found.look == look) & (found.sides.min(axis=1) >= 0.4)]
        for axis in (0, 1):
            ends = boxes[:, [1 - axis, 3 - axis]]
            level = (np.abs(ends[:, None] - ends[None]) <= tolerance).all(axis=2)
            first = boxes[:, axis] + boxes[:, axis + 2]
            one, other = np.nonzero(
                level & (first[:, None] < first[None]) & (boxes[:, None, axis + 2] - boxes[None, :, axis] <= LAP_PX)
            )
            gap = boxes[other, axis] - boxes[one, axis + 2]
            size = np.minimum(*(boxes[k, axis + 2] - boxes[k, axis] for k in (one, other)))
            whole = boxes[other, axis + 2] - boxes[one, axis]
            near = (gap <= picture.pixels(MULLION_M)) | ((gap <= MULLION_PX) & (whole <= picture.pixels(MULLIONED_M)))
            near &= gap <= 0.75 * size
            both = np.concatenate(
                [np.minimum(boxes[one, :2], boxes[other, :2]), np.maximum(boxes[one, 2:], boxes[other, 2:])], axis=1
            )[near]
            made = judged(picture, looks, look, np.unique(both, axis=0))
            parts.append(made.of(sized(made.boxes, picture, parameters) & (made.sides.min(axis=1) >= 0.5)))
    return Candidates.joined(parts)


def hold_panes(boxes: IntArray, panes: IntArray, picture: Picture) -> BoolArray:
    """(N,) whether a box holds one of some fused panes, hardly wider than it and up to thrice as high: then it is the whole, and that a part of it."""
    frame = picture.pixels(FRAME_M) + 1
    beside = [boxes[:, None, k] - panes[None, :, k] for k in range(4)]
    around = (beside[0] <= 1) & (beside[1] <= 1) & (beside[2] >= -1) & (beside[3] >= -1)
    near = (beside[0] >= -frame) & (beside[2] <= frame)
    high = (panes[:, 3] - panes[:, 1])[None]
    taller = (boxes[:, 3] - boxes[:, 1])[:, None] / np.maximum(high, 1)
    return np.asarray((around & near & (taller <= 3) & (taller > 1.1)).any(axis=1))


def framed(found: Candidates, picture: Picture, looks: Sequence[Edges], parameters: WindowParameters) -> Candidates:
    """Boxes grown over a frame of the other sign, where one follows on all sides; measured by its outer edges."""
    reach = np.arange(1, max(round(picture.pixels(FRAME_M)), 2) + 1)
    parts = [found.of(np.zeros(0, np.int64))]
    for look in range(len(looks)):
        boxes = np.unique(found.boxes[(found.look == look) & (found.sides.min(axis=1) >= 0.5)], axis=0)
        if len(boxes) == 0:
            continue
        grown, steps = boxes.copy(), np.empty((len(boxes), 4))
        rows, cols = picture.light.shape
        most = (0, 0, cols, rows)
        for side, way in enumerate((-1, -1, 1, 1)):
            tried = np.repeat(boxes[:, None], len(reach), axis=1)
            tried[:, :, side] = np.clip(
                tried[:, :, side] + way * reach, 0, max(most[side], cols + rows if side < 2 else 0)
            )
            tried[:, :, side] = np.minimum(tried[:, :, side], (cols, rows)[side % 2])
            values = strength(looks[look ^ 1], tried.reshape(-1, 4))[:, side].reshape(len(boxes), -1)
            best = values.argmax(axis=1)
            grown[:, side], steps[:, side] = (
                tried[np.arange(len(boxes)), best, side],
                values[np.arange(len(boxes)), best],
            )
        made = judged(picture, looks, look ^ 1, grown[(steps >= 0.8).all(axis=1)])
        made = replace(made, contrast=made.steps.mean(axis=1))
        parts.append(made.of(sized(made.boxes, picture, parameters) & (made.sides.min(axis=1) >= 0.4)))
    return Candidates.joined(parts)


def between_shutters(
    found: Candidates, picture: Picture, looks: Sequence[Edges], parameters: WindowParameters
) -> tuple[Candidates, IntArray]:
    """What stands between the wings of open shutters, half as wide as itself each; and the boxes of both wings and all.

    Returns
    -------
    candidates, (N, 4) boxes from the outer edge of the one wing to that of the other
    """
    shut = np.unique(
        np.concatenate([_around(found, picture, parameters), _between(found, picture, parameters)]), axis=0
    )
    if len(shut) == 0:
        return found.of(np.zeros(0, np.int64)), shut
    pane = _inner(shut, looks)
    made = [judged(picture, looks, k, pane) for k in range(len(looks))]
    level = np.stack([_level(m, judged(picture, looks, k, _middle(pane))) for k, m in enumerate(made)])
    best = level.argmax(axis=0)
    inner = np.min([step_any(looks, pane[:, side], pane) for side in (0, 2)], axis=0)
    outer_step = np.min([step_any(looks, shut[:, side], pane) for side in (0, 2)], axis=0)
    wing = np.minimum(pane[:, 0] - shut[:, 0], shut[:, 2] - pane[:, 2])
    good = (
        (level.max(axis=0) >= 0.8)
        & (inner >= np.maximum(0.8, WING_STEP * outer_step))
        & (wing >= WING_PX)
        & sized(pane, picture, parameters)
    )
    good &= ~_holds_a_window(pane, found, picture, parameters)
    good &= _usual(shut, good)
    chosen = Candidates.joined([m.of(good & (best == k)) for k, m in enumerate(made)])
    outer = np.concatenate([shut[good & (best == k)] for k in range(len(made))])
    sides, steps = chosen.sides.copy(), chosen.steps.copy()
    sides[:, [0, 2]] = np.maximum(sides[:, [0, 2]], 0.75)
    steps[:, [0, 2]] = np.maximum(
        steps[:, [0, 2]], np.concatenate([inner[good & (best == k)] for k in range(len(made))])[:, None]
    )
    return replace(chosen, sides=sides, steps=steps, contrast=np.maximum(chosen.contrast, 1.0)), outer


def _middle(pane: IntArray) -> IntArray:
    """The middle half across: what lies between two windows, rather than between two shutters of one, has nothing there."""
    quarter = (pane[:, 2] - pane[:, 0]) // 4
    return np.stack([pane[:, 0] + quarter, pane[:, 1], pane[:, 2] - quarter, pane[:, 3]], axis=1)


def _holds_a_window(pane: IntArray, found: Candidates, picture: Picture, parameters: WindowParameters) -> BoolArray:
    """(N,) whether a whole box as high as the pane stands in it, with wall on both sides: then the wings are windows themselves."""
    whole = found.boxes[found.sides.min(axis=1) >= WHOLE]
    tolerance = max(picture.pixels(parameters.align_m), 1.5)
    level = (np.abs(pane[:, None, [1, 3]] - whole[None, :, [1, 3]]) <= tolerance).all(axis=2)
    least = max(picture.pixels(APART_M), 2.0)
    apart = (whole[None, :, 0] - pane[:, None, 0] >= least) & (pane[:, None, 2] - whole[None, :, 2] >= least)
    wide = (whole[:, 2] - whole[:, 0])[None] >= 0.4 * (pane[:, 2] - pane[:, 0])[:, None]
    return np.asarray((level & apart & wide).any(axis=1))


def _level(pane: Candidates, middle: Candidates) -> FloatArray:
    """(N,) weaker step at lintel and sill, of the pane and of its middle; 0 where they are not complete."""
    whole = np.minimum(pane.sides, middle.sides)[:, [1, 3]].min(axis=1) >= 0.6
    return np.asarray(np.where(whole, np.minimum(pane.steps, middle.steps)[:, [1, 3]].min(axis=1), 0.0))


def _around(found: Candidates, picture: Picture, parameters: WindowParameters) -> IntArray:
    """Whole wide boxes: windows with their shutters, at a brightness where both are one."""
    wide, high = ((found.boxes[:, k + 2] - found.boxes[:, k]).astype(np.float64) for k in (0, 1))
    return found.boxes[
        (wide >= 0.55 * high)
        & (wide <= 3 * high)
        & (found.sides.min(axis=1) >= WHOLE)
        & (wide * picture.cell >= 2 * parameters.least_m)
    ]


def _between(found: Candidates, picture: Picture, parameters: WindowParameters) -> IntArray:
    """From wing to wing of pairs of equal narrow boxes, with twice their width between them."""
    tolerance = max(picture.pixels(parameters.align_m) / 2, 1.0)
    parts = [np.empty((0, 4), np.int64)]
    for look in np.unique(found.look):
        b = found.boxes[found.look == look]
        one, other = np.nonzero(in_row(b, b, tolerance) & (b[:, None, 0] < b[None, :, 0]))
        gap, wide = b[other, 0] - b[one, 2], 0.5 * (b[one, 2] - b[one, 0] + b[other, 2] - b[other, 0])
        pair: BoolArray = (gap >= 1.5 * wide) & (gap <= 2.6 * wide)
        parts.append(
            np.concatenate([np.minimum(b[one, :2], b[other, :2]), np.maximum(b[one, 2:], b[other, 2:])], axis=1)[pair]
        )
    return np.concatenate(parts)


def _usual(shut: IntArray, good: BoolArray) -> BoolArray:
    """(N,) whether most of the boxes of the same size show wings: a façade has shutters, or it has none."""
    size = np.log(np.maximum(shut[:, 2:] - shut[:, :2], 1))
    alike = (np.abs(size[:, None] - size[None]) <= 0.2).all(axis=2)
    return np.asarray((alike & good[None]).sum(axis=1) >= 0.6 * alike.sum(axis=1))


def _inner(shut: IntArray, looks: Sequence[Edges]) -> IntArray:
    """The part between two wings, a quarter of the width each, where brightness or hue steps most on both sides."""
    wide = (shut[:, 2] - shut[:, 0]).astype(np.float64)
    best, most = shut.copy(), np.full(len(shut), -1.0)
    for share in np.linspace(0.19, 0.31, 7):
        wing = np.rint(share * wide).astype(np.int64)
        left, right = shut[:, 0] + wing, shut[:, 2] - wing
        steps = np.minimum(step_any(looks, left, shut), step_any(looks, right, shut))
        better = steps > most
        best[better, 0], best[better, 2], most[better] = left[better], right[better], steps[better]
    return best
