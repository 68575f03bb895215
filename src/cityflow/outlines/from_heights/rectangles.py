"""Recursive rectangle approximation of a region (Gross, Thoennessen and von Hansen 2005, §2.3).

The smallest upright rectangle around the region, less the parts of it that are not region, each of which is first
approximated in the same way: building and not-building alternate until what is left over is small.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import BoolArray

_DEEPEST = 12
"""Rectangles within rectangles are cut out to this depth at most; set by hand."""
_MOST = 0.7
"""A part whose box is so large a share of the whole's is halved first; set by hand on synthetic towns."""


def rectangle_approximation(region: BoolArray, minimum_cells: float) -> BoolArray:
    """(rows, cols) mask of a polygon with sides along rows and columns that approximates the region.

    Parameters
    ----------
    region : (rows, cols) bool, in a frame turned into the region's principal orientation
    minimum_cells : parts of the difference smaller than this are left as they are
    """
    result = np.zeros_like(region)
    _approximate(region, result, minimum_cells, _DEEPEST)
    return result


def _approximate(region: BoolArray, result: BoolArray, minimum_cells: float, depth: int) -> None:
    """Set `result` to True on the approximation of `region`; both of the same shape."""
    box = _bounding_box(region)
    if box is None:
        return
    inside, filled = region[box], np.ones(region[box].shape, bool)
    if depth > 0:
        labels, count = ndimage.label(~inside)
        sizes = np.bincount(labels.ravel(), minlength=count + 1)
        for label, part in enumerate(ndimage.find_objects(labels), 1):
            if sizes[label] >= minimum_cells:
                outside = _part_approximation(labels[part] == label, inside.shape, minimum_cells, depth)
                filled[part] &= ~outside
    result[box] |= filled


def _part_approximation(part: BoolArray, whole_shape: tuple[int, ...], minimum_cells: float, depth: int) -> BoolArray:
    """Approximation of one part of the difference; halved first where it reaches over most of the whole.

    Along a slanting edge the part's rectangle is nearly the whole's again, and the recursion would turn in a circle.
    """
    result = np.zeros_like(part)
    if part.size < _MOST * whole_shape[0] * whole_shape[1]:
        _approximate(part, result, minimum_cells, depth - 1)
        return result
    axis = int(np.argmax(part.shape))
    for half, target in zip(np.array_split(part, 2, axis), np.array_split(result, 2, axis), strict=True):
        _approximate(half, target, minimum_cells, depth - 1)
    return result


def _bounding_box(region: BoolArray) -> tuple[slice, slice] | None:
    rows, cols = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    if not len(rows):
        return None
    return slice(rows[0], rows[-1] + 1), slice(cols[0], cols[-1] + 1)
