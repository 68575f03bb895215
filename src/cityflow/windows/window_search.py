"""Search for windows on a façade, in overlapping strips where it is long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.windows.agreement import completed_heights
from cityflow.windows.box_edges import Edges
from cityflow.windows.candidates import (
    ALIGN_M,
    LEAST_SEEN,
    Candidates,
    at_wall_base,
    candidates,
    channels_of,
    measured,
    sized,
    within_wall,
)
from cityflow.windows.choice import chosen, support_of
from cityflow.windows.confidence import confidence, lines_beyond_corners
from cityflow.windows.facade_picture import Picture
from cityflow.windows.fitting import bounds_of
from cityflow.windows.proposals import WHOLE, framed, fused, hold_panes
from cityflow.windows.rows import aligned, in_column, overlap, places
from cityflow.windows.shutters import between_shutters
from cityflow.windows.storeys import door_like
from cityflow.windows.window_parameters import WindowParameters

LEAST_KEPT = 0.3
"""Least confidence of boxes that are kept; boxes that are not windows still help to recognise façades of panels or glass; set by hand on drawn
façades, as are those below."""
LINES_BEYOND = 0.6
"""Step beyond the corners of a box, upright and level, in thresholds, from which it is part of a lattice."""
STRIP_M, LAP_M = 40.0, 5.0
"""Longest façade that is searched as a whole, and overlap of strips: time and memory grow with the square of the number of boxes in one."""
BONUS = (0.0, 0.2, 0.1, 0.35)
"""Added to the soundness of plain boxes, merged ones, those with frames, and those between shutters, so that a whole precedes its parts."""
PANE = 0.6
"""Shortest side of a pane, as a share of that of a window."""
AREA_BONUS = 0.05
"""Bonus for each square metre: of equally sound boxes a window precedes one of its panes."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Boxes in metres on the wall's plane, as arrays of one length.

    Attributes
    ----------
    bounds : (N, 4) s, t of the lower left and the upper right corner
    sure : (N,) confidence;  support : (N,) number of others in row and column
    completed : (N,) whether it was searched for only because of its row or column;  doors : (N,) whether it is a door
    lattice : (N,) whether the lines of its sides continue beyond its corners, as those of panes and panels do
    """

    bounds: FloatArray
    sure: FloatArray
    support: IntArray
    completed: BoolArray
    doors: BoolArray
    lattice: BoolArray

    def of(self, which: BoolArray) -> Found:
        return Found(*(getattr(self, f.name)[which] for f in fields(self)))


def found_on(picture: Picture, parameters: WindowParameters) -> Found:
    """Boxes on a façade; in a long one each strip contributes the boxes whose middle it contains."""
    parts = []
    for strip, low, high in strips(picture):
        found = _found_on(strip, parameters)
        middle = (found.bounds[:, 0] + found.bounds[:, 2]) / 2
        parts.append(found.of((middle >= low) & (middle < high)))
    return Found(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Found)))


def strips(picture: Picture) -> list[tuple[Picture, float, float]]:
    """Equal parts of a façade of at most `STRIP_M` with their overlap, and the range of s that each contributes."""
    cols = picture.light.shape[1]
    count = max(int(np.ceil(cols * picture.cell / STRIP_M)), 1)
    ends, lap = np.linspace(0, cols, count + 1).round().astype(int), round(picture.pixels(LAP_M))
    made = []
    for k in range(count):
        a, b = max(int(ends[k]) - lap, 0), min(int(ends[k + 1]) + lap, cols)
        part = {name: getattr(picture, name)[:, a:b] for name in ("light", "hue", "seen", "wall")}
        limits = [-np.inf if k == 0 else picture.s_min + ends[k] * picture.cell]
        limits.append(np.inf if k == count - 1 else picture.s_min + ends[k + 1] * picture.cell)
        made.append((replace(picture, s_min=picture.s_min + a * picture.cell, **part), limits[0], limits[1]))
    return made


def _found_on(picture: Picture, parameters: WindowParameters) -> Found:
    channels, tolerance = channels_of(picture, parameters), _tolerance(picture)
    found, support, completed = searched(picture, channels, parameters)
    sure = confidence(found, support, completed, picture, channels)
    lattice = lines_beyond_corners(channels, found).min(axis=1) >= LINES_BEYOND
    keep = (sure >= min(LEAST_KEPT, parameters.least_confidence)) | lattice
    found, support, sure = found.of(keep), support[keep], sure[keep]
    windows = sure >= parameters.least_confidence
    whole = found.boxes.copy()
    whole[windows] = completed_heights(whole[windows], channels, tolerance)
    boxes = aligned(whole, sure, tolerance)
    alike = in_column(found.boxes, found.boxes, tolerance).any(axis=1)
    doors = door_like(boxes, picture) | (at_wall_base(found.boxes, picture) & ~alike)
    return Found(
        bounds_of([picture.bounds(b) for b in boxes]), sure, support, completed[keep] > 0, doors, lattice[keep]
    )


def searched(
    picture: Picture, channels: Sequence[Edges], parameters: WindowParameters
) -> tuple[Candidates, IntArray, FloatArray]:
    """Boxes, their support, and which of them were searched for only because of rows and columns."""
    tolerance = _tolerance(picture)
    found, support = _first(picture, channels, parameters)
    sure = confidence(found, support, np.zeros(len(found)), picture, channels) >= parameters.least_confidence
    more = _completed(picture, found.of(sure), parameters)
    more = more.of(overlap(more.boxes, found.around[sure])[1].max(axis=1, initial=0) < 0.1)
    both = Candidates.joined([found, more])
    completed = np.repeat([0.0, 1.0], [len(found), len(more)])
    return both, support_of(both, tolerance), completed


def _first(picture: Picture, channels: Sequence[Edges], parameters: WindowParameters) -> tuple[Candidates, IntArray]:
    """Boxes from the picture alone: segments, and boxes derived from them."""
    panes = parameters.model_copy(
        update={"least_m": PANE * parameters.least_m, "most_aspect": parameters.most_aspect / PANE}
    )
    plain = candidates(picture, channels, panes)
    whole = fused(plain, picture, channels, panes)
    whole = Candidates.joined([whole, fused(Candidates.joined([plain, whole]), picture, channels, panes)])
    grown = framed(Candidates.joined([plain, whole]), picture, channels, panes)
    between = between_shutters(plain, picture, channels, parameters)
    parts = (plain, whole, grown, between)
    found = Candidates.joined(parts)
    area = picture.cell**2 * (found.boxes[:, 2:] - found.boxes[:, :2]).prod(axis=1)
    bonus = np.repeat(BONUS, [len(p) for p in parts])
    holding = hold_panes(found.boxes, whole.boxes, picture) & (found.sides.min(axis=1) >= WHOLE)
    bonus = np.where(holding, np.maximum(bonus, BONUS[1]), bonus) + AREA_BONUS * np.minimum(area, 3)
    fits = (found.seen >= LEAST_SEEN) & sized(found.boxes, picture, parameters)
    fits &= within_wall(found.boxes, picture, at_wall_base(found.boxes, picture))
    return chosen(found.of(fits), bonus[fits], _tolerance(picture))


def _completed(picture: Picture, found: Candidates, parameters: WindowParameters) -> Candidates:
    """Boxes in gaps of rows and columns where the picture shows at least half of the contrast of a window."""
    tolerance = _tolerance(picture)
    parts = [found.of(np.zeros(0, np.int64))]
    faint = parameters.model_copy(
        update={"edge_sigmas": parameters.edge_sigmas / 2, "least_contrast": parameters.least_contrast / 2}
    )
    channels = channels_of(picture, faint) if len(found) >= 2 else []
    for channel in np.unique(found.channel):
        asked = places(found.boxes[found.channel == channel], tolerance, picture.light.shape[::-1])
        if len(asked) and channels:
            made = measured(picture, channels, int(channel), asked)
            good = (made.sides.mean(axis=1) >= 0.6) & (made.contrast > 1) & (made.seen >= LEAST_SEEN)
            parts.append(made.of(good & within_wall(asked, picture, np.zeros(len(asked), bool))))
    more = Candidates.joined(parts)
    apart = overlap(more.boxes, found.around)[1].max(axis=1, initial=0) < 0.1
    more = more.of(apart)
    return chosen(more, np.zeros(len(more)), tolerance)[0]


def _tolerance(picture: Picture) -> float:
    return max(picture.pixels(ALIGN_M), 1.5)
