"""Boxes that may be windows, with figures of their edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.windows.box_edges import (
    BRIGHT,
    DARK,
    Edges,
    box_areas,
    box_sums,
    completeness,
    contrast,
    edges_of,
    integral,
    refined,
    seen_share,
    strength,
)
from cityflow.windows.facade_picture import Picture
from cityflow.windows.level_segments import LEAST_PX, segments
from cityflow.windows.window_parameters import WindowParameters

ALIGN_M = 0.15
"""Windows of a row or column agree within this; set by hand on drawn façades."""

LEAST_SEEN = 0.9
"""Share of a window whose texture is true, not interpolated; set by hand on drawn façades."""

MARGIN_M = 0.15
"""Wall that remains between a window and the edge of its wall; set by hand on drawn façades."""

LEAST_SIDE, LEAST_SIDES = 0.35, 0.6
"""Least completeness of the worst side, and of all four on average, of a candidate; set by hand on drawn façades."""
RIM_M = 0.25
"""Of the wall around a candidate that it is compared with; set by hand, as is the next."""
GATE_M = 2.0
"""A wider and as high opening may be a gate."""
HUE_RANGE = 0.06
"""Least range of the hue for which it is used beside brightness; set by hand on drawn façades."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Boxes and figures of their edges, as arrays of one length.

    Attributes
    ----------
    boxes : (N, 4) left, top, right, bottom, cells
    sides : (N, 4) completeness of the sides, in that order
    steps : (N, 4) mean steps across the sides, in thresholds
    contrast : (N,) difference from the rim, in thresholds
    seen : (N,) share with true texture
    channel : (N,) which of the façade's channels (see `channels_of`) they come from
    around : (N, 4) the box itself; between open shutters, the box with both wings
    """

    boxes: IntArray
    sides: FloatArray
    steps: FloatArray
    contrast: FloatArray
    seen: FloatArray
    channel: IntArray
    around: IntArray

    def __len__(self) -> int:
        return len(self.boxes)

    def of(self, which: BoolArray | IntArray) -> Candidates:
        return Candidates(*(getattr(self, f.name)[which] for f in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Candidates]) -> Candidates:
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))

    @property
    def soundness(self) -> FloatArray:
        """(N,) 0 to 1: how complete the sides are, the worst one weighing as much as all together; a little for how strong they are."""
        strong = np.clip(np.minimum(self.steps.min(axis=1), self.contrast) / 3, 0, 1)
        return np.asarray(0.45 * self.sides.mean(axis=1) + 0.45 * self.sides.min(axis=1) + 0.1 * strong)


def channels_of(picture: Picture, parameters: WindowParameters) -> list[Edges]:
    """The façade's edges by channel: dark and bright windows in the brightness, and where the façade has colours, in the hue."""
    values = [picture.light]
    if picture.seen.any() and np.ptp(np.quantile(picture.hue[picture.seen], [0.01, 0.99])) > HUE_RANGE:
        values.append(picture.hue)
    return [edges_of(picture, v, sign, parameters) for v in values for sign in (DARK, BRIGHT)]


def measured(picture: Picture, channels: Sequence[Edges], channel: int, boxes: IntArray) -> Candidates:
    """Boxes with their figures in one channel."""
    edges, rim = channels[channel], max(round(picture.pixels(RIM_M)), 1)
    return Candidates(
        boxes, completeness(edges, boxes), strength(edges, boxes), contrast(edges, boxes, rim), seen_share(edges, boxes),
        np.full(len(boxes), channel), boxes,
    )  # fmt: skip


def candidates(picture: Picture, channels: Sequence[Edges], parameters: WindowParameters) -> Candidates:
    """All segments of all channels that have the size, the place and the sides of a window or a door."""
    found = []
    reach = max(round(picture.pixels(0.1)), 1)
    for k, edges in enumerate(channels):
        boxes = segments(picture, edges, edges.sign, parameters)
        rough = measured(picture, channels, k, boxes)
        boxes = refined(edges, boxes[rough.sides.mean(axis=1) >= 0.4], reach)
        boxes = np.unique(boxes[sized(boxes, picture, parameters)], axis=0)
        part = measured(picture, channels, k, boxes)
        found.append(part.of(_plausible(part, picture)))
    return Candidates.joined(found)


def sized(boxes: IntArray, picture: Picture, parameters: WindowParameters) -> BoolArray:
    """(N,) whether boxes have the size and the proportions of windows."""
    wide, high = boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]
    shortest, longest = np.minimum(wide, high), np.maximum(wide, high)
    least = max(picture.pixels(parameters.least_m), LEAST_PX)
    return np.asarray(
        (shortest >= least)
        & (longest <= picture.pixels(parameters.most_m))
        & (longest <= parameters.most_aspect * shortest)
    )


def _plausible(found: Candidates, picture: Picture) -> BoolArray:
    """Sides complete enough (three of them at the wall base), true texture, wall all around."""
    standing = at_wall_base(found.boxes, picture)
    sides = np.where(standing[:, None] & (np.arange(4) == 3), 1.0, found.sides)
    complete = (sides.min(axis=1) >= LEAST_SIDE) & (sides.mean(axis=1) >= LEAST_SIDES) & (found.contrast > 0.5)
    return np.asarray(complete & (found.seen >= LEAST_SEEN) & within_wall(found.boxes, picture, standing))


def within_wall(boxes: IntArray, picture: Picture, standing: BoolArray) -> BoolArray:
    """Whether wall remains around boxes; not required below those at the wall base."""
    rim = max(round(picture.pixels(MARGIN_M)), 1)
    wide = boxes + rim * np.array([-1, -1, 1, 1])
    wide[:, 3] = np.where(standing, boxes[:, 3], wide[:, 3])
    area = box_areas(wide)
    return np.asarray(box_sums(integral(picture.wall.astype(np.float32)), wide) >= 0.97 * area)


def at_wall_base(boxes: IntArray, picture: Picture) -> BoolArray:
    """Tall boxes, and gates, whose lower edge is where the wall, or its visible part, ends."""
    below = boxes.copy()
    below[:, 1], below[:, 3] = boxes[:, 3], boxes[:, 3] + max(round(picture.pixels(0.4)), 2)
    area = box_areas(below)
    left = box_sums(integral((picture.seen & picture.wall).astype(np.float32)), below) / np.maximum(area, 1)
    high, wide = (picture.cell * (boxes[:, b] - boxes[:, a]) for a, b in ((1, 3), (0, 2)))
    tall, gate = (high >= 1.8) & (high >= 1.3 * wide), (high >= 1.7) & (wide >= GATE_M)
    return np.asarray((left < 0.75) & (tall | gate))
