"""Where photographs show the edge of a roof: the place at which colours change along all of it, in most images.

A place beside the edge is looked up in every image at the height of the upper roof. There the roof ends at the same place in all images; the foot of
the wall, shadows on the lower roof and what stands behind are at other heights, and so at another place in each image.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.edges.edge_line import EdgeLine
from cityflow.edges.image_window import MARGIN_PX, ImageWindow

REACH_CELLS, APART_CELLS, STEP_CELLS = 8.0, 2.0, 0.5
"""An edge is looked for so far to both sides, in cells of the matched surface; others count as others from so far away; steps; set by hand."""
CHANGE_CELLS = 2.0
"""Colours so far apart are compared across an edge."""
LEAST_IMAGES = 4
"""Fewer say nothing; set by hand, as are those below."""
LEAST_PX = 0.4
"""Pixels of a cell across an edge: an image that sees it more obliquely, or more coarsely, does not count."""
INDEPENDENT_PX, LEAST_INDEPENDENT = 1.5, 3.0
"""So many pixels along an edge are one observation, of which there are so many at least."""
FLOOR = 1.5
"""Standard deviation, of 255, that a change of colours has at least: noise that all pixels share."""
CLEAR = 3.0
"""A change of so many standard deviations is clear: beyond it, its weight grows with its logarithm only."""


@dataclass(frozen=True, slots=True)
class EdgePlace:
    """Where images show an edge.

    Attributes
    ----------
    off_m : metres outside the line that it was looked for at;  sigma_m : standard deviation
    sigmas : by how many standard deviations, of the images' votes, it is more of an edge than any other place
    images : how many see the place
    """

    off_m: float
    sigma_m: float
    sigmas: float
    images: int


def places_across(cell: float) -> FloatArray:
    """(T,) metres outside an edge at which images are looked up."""
    count = round(REACH_CELLS / STEP_CELLS) + _half()
    return np.arange(-count, count + 1, dtype=np.float64) * (STEP_CELLS * cell)


def _half() -> int:
    return round(CHANGE_CELLS / STEP_CELLS / 2)


def votes_of(edge: EdgeLine, window: ImageWindow, off: FloatArray, cell: float) -> FloatArray | None:
    """(T',) how much of an edge one image shows at each place but the first and last ones; None where it does not show all of them well.

    Parameters
    ----------
    off : (T,) `places_across`;  cell : of the matched surface, metres
    """
    along = np.arange(cell, edge.length - cell / 2, cell)
    uv, depth = window.image.project(edge.places(along, off).reshape(-1, 3))
    if not (depth > 0).all() or not window.image.holds(uv, MARGIN_PX).all():
        return None
    uv = uv.reshape(len(along), len(off), 2) / (1 << window.level)
    across = float(np.linalg.norm(uv[:, -1] - uv[:, 0], axis=-1).mean()) / float(off[-1] - off[0])
    if across * cell < LEAST_PX:
        return None
    length = float(np.linalg.norm(uv[-1] - uv[0], axis=-1).mean())
    colours = window.colours(uv * (1 << window.level)).reshape(len(along), len(off), -1)
    change = colours[:, 2 * _half() :] - colours[:, : -2 * _half()]
    count = max(length / INDEPENDENT_PX, LEAST_INDEPENDENT)
    sigma = change.std(axis=0) / math.sqrt(count) + FLOOR
    strength = ((change.mean(axis=0) / sigma) ** 2).sum(axis=-1)
    return np.asarray(np.log1p(strength / CLEAR**2), np.float64)


def place_of_votes(known: Sequence[FloatArray], cell: float) -> EdgePlace | None:
    """The likeliest place within reach, by the (T',) votes of each image; None where they are few, or where it may lie beyond."""
    if len(known) < LEAST_IMAGES:
        return None
    votes, off = np.array(known), places_across(cell)[_half() : -_half()]
    mean = votes.mean(axis=0)
    best = int(mean.argmax())
    if best in (0, len(off) - 1):
        return None
    far = np.abs(off - off[best]) > APART_CELLS * cell
    ahead = votes[:, [best]] - votes[:, far]
    spread = ahead.std(axis=0, ddof=1) / math.sqrt(len(votes))
    sigmas = float((ahead.mean(axis=0) / np.maximum(spread, 1e-6)).min())
    place, sigma = _finer(votes, off, best, cell)
    return EdgePlace(place, sigma, sigmas, len(votes))


def _finer(votes: FloatArray, off: FloatArray, best: int, cell: float) -> tuple[float, float]:
    """The place between steps, and its standard deviation by how the images differ."""
    step = float(off[1] - off[0])
    near = np.flatnonzero(np.abs(off - off[best]) <= APART_CELLS * cell)
    own = votes[:, near]
    each, weight = off[near][own.argmax(axis=1)], own.max(axis=1)
    place = float(np.average(each, weights=np.maximum(weight, 1e-6)))
    variance = float(np.average((each - place) ** 2, weights=np.maximum(weight, 1e-6)))
    count = float(weight.sum() ** 2 / max(float((weight**2).sum()), 1e-9))
    return place, math.sqrt(variance / max(count, 1.0) + step**2 / 12.0)
