"""All that may be a window on a façade, strip by strip where it is long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.windows.agreement import completed_heights
from cityflow.windows.candidates import (
    ALIGN_M,
    LEAST_SEEN,
    Candidates,
    candidates,
    judged,
    looks_of,
    on_foot,
    sized,
    within_wall,
)
from cityflow.windows.choice import chosen, support
from cityflow.windows.confidence import confidence, running_on
from cityflow.windows.edges import Edges
from cityflow.windows.fitting import bounds_of
from cityflow.windows.picture import Picture
from cityflow.windows.proposals import WHOLE, framed, fused, hold_panes
from cityflow.windows.rows import aligned, in_column, overlap, places
from cityflow.windows.shutters import between_shutters
from cityflow.windows.storeys import door_like
from cityflow.windows.window_parameters import WindowParameters

PERHAPS = 0.3
"""Confidence of boxes that are kept; those that are not sure enough still say what a façade is of."""
RUNS_ON = 0.6
"""Step beyond the corners of a box, upright and level, in thresholds, from which it is one of a lattice."""
STRIP_M, LAP_M = 40.0, 5.0
"""Longest façade that is looked at as a whole, and what strips see beyond their ends: time and memory grow with the square of the boxes in one."""
BONUS = (0.0, 0.2, 0.1, 0.35)
"""What speaks for plain boxes, fused ones, those with their frames, and those between shutters, beside the parts that they hold."""
PANE = 0.6
"""Shortest side of a pane by that of a window."""
AREA_BONUS = 0.05
"""For each square metre: a window before one of its panes, where both are as sound."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Boxes in metres on the wall's plane, as arrays of one length.

    Attributes
    ----------
    bounds : (N, 4) s, t of the lower left and the upper right corner
    sure : (N,) confidence;  company : (N,) others in row and column
    completed : (N,) whether only rows and columns asked for it;  doors : (N,) whether it is a door
    lattice : (N,) whether the lines of its sides run on beyond its corners, as those of panes and panels do
    """

    bounds: FloatArray
    sure: FloatArray
    company: IntArray
    completed: BoolArray
    doors: BoolArray
    lattice: BoolArray

    def of(self, which: BoolArray) -> Found:
        return Found(*(getattr(self, f.name)[which] for f in fields(self)))


def found_on(picture: Picture, parameters: WindowParameters) -> Found:
    """Boxes on a façade; of a long one each strip says what has its middle in it."""
    parts = []
    for strip, low, high in strips(picture):
        found = _found_on(strip, parameters)
        middle = (found.bounds[:, 0] + found.bounds[:, 2]) / 2
        parts.append(found.of((middle >= low) & (middle < high)))
    return Found(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Found)))


def strips(picture: Picture) -> list[tuple[Picture, float, float]]:
    """Equal parts of a façade of at most `STRIP_M`, with what is seen beside them, and from which to which s each answers for."""
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
    looks, tolerance = looks_of(picture, parameters), _tolerance(picture)
    found, company, late = searched(picture, looks, parameters)
    sure = confidence(found, company, late, picture, looks)
    lattice = running_on(looks, found).min(axis=1) >= RUNS_ON
    keep = (sure >= min(PERHAPS, parameters.least_confidence)) | lattice
    found, company, sure = found.of(keep), company[keep], sure[keep]
    windows = sure >= parameters.least_confidence
    whole = found.boxes.copy()
    whole[windows] = completed_heights(whole[windows], looks, tolerance)
    boxes = aligned(whole, sure, tolerance)
    alike = in_column(found.boxes, found.boxes, tolerance).any(axis=1)
    doors = door_like(boxes, picture) | (on_foot(found.boxes, picture) & ~alike)
    return Found(bounds_of([picture.bounds(b) for b in boxes]), sure, company, late[keep] > 0, doors, lattice[keep])


def searched(
    picture: Picture, looks: Sequence[Edges], parameters: WindowParameters
) -> tuple[Candidates, IntArray, FloatArray]:
    """Boxes, their company, and which of them were only looked for because rows and columns ask for them."""
    tolerance = _tolerance(picture)
    found, company = _first(picture, looks, parameters)
    sure = confidence(found, company, np.zeros(len(found)), picture, looks) >= parameters.least_confidence
    more = _completed(picture, found.of(sure), parameters)
    more = more.of(overlap(more.boxes, found.around[sure])[1].max(axis=1, initial=0) < 0.1)
    both = Candidates.joined([found, more])
    late = np.repeat([0.0, 1.0], [len(found), len(more)])
    return both, support(both, tolerance), late


def _first(picture: Picture, looks: Sequence[Edges], parameters: WindowParameters) -> tuple[Candidates, IntArray]:
    """What the picture shows by itself: segments, and what follows from them."""
    panes = parameters.model_copy(
        update={"least_m": PANE * parameters.least_m, "most_aspect": parameters.most_aspect / PANE}
    )
    plain = candidates(picture, looks, panes)
    whole = fused(plain, picture, looks, panes)
    whole = Candidates.joined([whole, fused(Candidates.joined([plain, whole]), picture, looks, panes)])
    grown = framed(Candidates.joined([plain, whole]), picture, looks, panes)
    between = between_shutters(plain, picture, looks, parameters)
    parts = (plain, whole, grown, between)
    found = Candidates.joined(parts)
    area = picture.cell**2 * (found.boxes[:, 2:] - found.boxes[:, :2]).prod(axis=1)
    bonus = np.repeat(BONUS, [len(p) for p in parts])
    holding = hold_panes(found.boxes, whole.boxes, picture) & (found.sides.min(axis=1) >= WHOLE)
    bonus = np.where(holding, np.maximum(bonus, BONUS[1]), bonus) + AREA_BONUS * np.minimum(area, 3)
    fits = (found.seen >= LEAST_SEEN) & sized(found.boxes, picture, parameters)
    fits &= within_wall(found.boxes, picture, on_foot(found.boxes, picture))
    return chosen(found.of(fits), bonus[fits], _tolerance(picture))


def _completed(picture: Picture, found: Candidates, parameters: WindowParameters) -> Candidates:
    """Boxes at the places that rows and columns leave, where the picture shows at least half of the contrast of a window."""
    tolerance = _tolerance(picture)
    parts = [found.of(np.zeros(0, np.int64))]
    faint = parameters.model_copy(
        update={"edge_sigmas": parameters.edge_sigmas / 2, "least_contrast": parameters.least_contrast / 2}
    )
    looks = looks_of(picture, faint) if len(found) >= 2 else []
    for look in np.unique(found.look):
        asked = places(found.boxes[found.look == look], tolerance, picture.light.shape[::-1])
        if len(asked) and looks:
            made = judged(picture, looks, int(look), asked)
            good = (made.sides.mean(axis=1) >= 0.6) & (made.contrast > 1) & (made.seen >= LEAST_SEEN)
            parts.append(made.of(good & within_wall(asked, picture, np.zeros(len(asked), bool))))
    more = Candidates.joined(parts)
    apart = overlap(more.boxes, found.around)[1].max(axis=1, initial=0) < 0.1
    more = more.of(apart)
    return chosen(more, np.zeros(len(more)), tolerance)[0]


def _tolerance(picture: Picture) -> float:
    return max(picture.pixels(ALIGN_M), 1.5)
