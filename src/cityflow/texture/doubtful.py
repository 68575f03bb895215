"""Views that are so oblique that they may as well show something else than the wall: the ground before it, or the roof above.

A wall that stands `e` metres behind its model is seen `e · tan(incidence)` metres further along the trace of the rays on it, and a pixel reaches as far as the
slope draws it out. Where a wall ends within so much of a cell, the image may show what is beside the wall. Seen at 45° the same wall would be as uncertain as
its place; what is more comes of the slope, and a view that loses a third of a wall to it is no view.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import EAVE_SPREAD_M, OutlineEdge
from cityflow.core.camera import OrientedImage
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace

MOST_LOST = 1.0 / 3.0
"""Share of a wall that its slope makes uncertain in an image, from which the image does not count: from there on the plain colour of walls was nearer
to the paint of houses seen steeply from above (benchmarks/painted_houses.py, seeds 101 to 108)."""


def wall_sigma(edges: Sequence[OutlineEdge], default_m: float) -> float:
    """How exactly the walls of a unit are known across, metres: root mean square over its outline.

    An outline along the rim of a roof tells of the wall below it no more than that eaves differ, where no façade was seen.

    Parameters
    ----------
    edges : how the parts of the outline are known
    default_m : standard deviation of those without one
    """
    length = np.array([edge.line.length for edge in edges])
    if length.sum() == 0:
        return default_m
    known = np.array([edge.sigma_m if np.isfinite(edge.sigma_m) else default_m for edge in edges])
    unseen = np.array([1.0 - edge.seen if edge.source == "roof" else 0.0 for edge in edges])
    return float(np.sqrt(np.average(known**2 + unseen * EAVE_SPREAD_M**2, weights=length)))


def without_doubtful(
    face: FacePlane, grid: FaceGrid, seen: Sequence[SeenFace], images: Sequence[OrientedImage], sigma_m: float
) -> tuple[SeenFace, ...]:
    """The views of a wall that surely show the wall, where it is known to `sigma_m` across."""
    if not seen:
        return ()
    wall = np.any([one.mask.mask() for one in seen], axis=0)
    return tuple(
        one for one in seen if lost_to_slope(face, grid, wall, one, images[one.view.image], sigma_m) < MOST_LOST
    )


def lost_to_slope(
    face: FacePlane, grid: FaceGrid, wall: BoolArray, one: SeenFace, image: OrientedImage, sigma_m: float
) -> float:
    """Share of a wall at which an image may show something else, less the share at 45°; the wall may stand before its model as well as behind it.

    Parameters
    ----------
    wall : (rows, cols) cells of the wall that some image sees
    """
    ray = face.world(grid.centres()[one.mask.mask()]).mean(axis=0) - image.centre
    along = np.array([ray @ face.right, ray @ face.up]) / -(ray @ face.normal)
    steep = float(np.hypot(*along))
    if steep <= 1.0:
        return 0.0
    # a view's sampling distance is the root of a pixel's area, which the slope draws out in one direction
    stretch = (1.0 + steep**2) ** 0.25
    moved, at_45 = np.hypot(sigma_m * steep, one.view.gsd_m * stretch), np.hypot(sigma_m, one.view.gsd_m / stretch)
    return _uncertain(wall, grid, along * (moved / steep)) - _uncertain(wall, grid, along * (at_45 / steep))


def _uncertain(wall: BoolArray, grid: FaceGrid, moved: FloatArray) -> float:
    """Share of the cells that are none of the wall after a move of so many metres (s, t), one way or the other."""
    return 1.0 - 0.5 * (_on_wall(wall, grid, moved) + _on_wall(wall, grid, -moved))


def _on_wall(wall: BoolArray, grid: FaceGrid, moved: FloatArray) -> float:
    row, col = np.nonzero(wall)
    row, col = row - round(moved[1] / grid.cell), col + round(moved[0] / grid.cell)
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    return float(wall[row[inside], col[inside]].sum() / wall.sum())
