"""Parts of a reference image that can show the requested ground cells."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.ground_cells import GroundCells
from cityflow.matching.lattice import MARGIN_PX, PairLattice

PART_PX = 64
"""Edge of the squares of the reference image that are looked at or left out; set by hand."""

Window = tuple[int, int, int, int]
"""First row, end row, first column, end column of the reference image; multiples of PART_PX but at the end of the image."""


def window_of(
    reference: OrientedImage, keep: GroundCells, heights: tuple[float, float], margin: float
) -> Window | None:
    """Window of the reference image that shows the box around the cells between the heights; None where it shows nothing of it."""
    x_min, y_min, x_max, y_max = keep.bounds
    axes = (
        np.linspace(x_min - margin, x_max + margin, 17), np.linspace(y_min - margin, y_max + margin, 17),
        np.linspace(heights[0], heights[1], 5),
    )  # fmt: skip
    xyz = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    local = reference.in_camera(xyz)
    local = local[local[:, 2] > 0]
    if not len(local):
        return None
    # the pinhole view is convex; clipping it before distortion keeps far points from folding back
    normal = local[:, :2] / local[:, 2:]
    camera = reference.camera
    corners = np.array([[0, 0], [camera.width, 0], [0, camera.height], [camera.width, camera.height]], np.float64)
    middles = np.array([[0.5, 0], [0.5, 1], [0, 0.5], [1, 0.5]]) * (camera.width, camera.height)
    limits = camera.undistort(np.concatenate([corners, middles]))
    low, high = normal.min(axis=0), normal.max(axis=0)
    if np.any(high < limits.min(axis=0)) or np.any(low > limits.max(axis=0)):
        return None
    low, high = np.maximum(low, limits.min(axis=0)), np.minimum(high, limits.max(axis=0))
    along = np.linspace(0.0, 1.0, 33)[:, None]
    edges = [
        low + along * (high - low) * (1, 0),
        low + along * (high - low) * (0, 1),
        high - along * (high - low) * (1, 0),
    ]
    uv = camera.distort(np.concatenate([*edges, high - along * (high - low) * (0, 1)]))
    return _aligned(uv, camera.height, camera.width)


def _aligned(uv: FloatArray, height: int, width: int) -> Window | None:
    (left, top), (right, bottom) = uv.min(axis=0) - 2.0, uv.max(axis=0) + 2.0
    window = (
        max(int(top // PART_PX) * PART_PX, 0), min(int(-(-bottom // PART_PX)) * PART_PX, height),
        max(int(left // PART_PX) * PART_PX, 0), min(int(-(-right // PART_PX)) * PART_PX, width),
    )  # fmt: skip
    return window if window[0] < window[1] and window[2] < window[3] else None


def parts_shape(window: Window) -> tuple[int, int]:
    return -(-(window[1] - window[0]) // PART_PX), -(-(window[3] - window[2]) // PART_PX)


def parts_of_pair(
    lattice: PairLattice, level: int, window: Window, candidates: BoolArray, keep: GroundCells, margin: float
) -> BoolArray:
    """Which candidate parts of the window may have a point in the cells, by what this pair searches at a level.

    A part's points lie in the hull of its corner rays between the depths that the ranges of its blocks allow.
    """
    needed = np.zeros_like(candidates)
    rows, cols = np.nonzero(candidates)
    normal = lattice.pair.reference.camera.undistort(_corners(window, rows, cols))
    x, y = lattice.pair.rectified(normal)
    found = np.array([_search_range(lattice, level, x[i], y[i]) for i in range(len(rows))]).reshape(-1, 2)
    seen = np.isfinite(found[:, 0])
    x, y, found = x[seen], y[seen], found[seen]
    ends = [lattice.pair.world(x, y, lattice.pair.depths(x, y, found[:, i, None] + 0.0 * x)) for i in (0, 1)]
    hulls = np.concatenate(ends, axis=1)[..., :2]
    needed[rows[seen], cols[seen]] = [not np.isfinite(hull).all() or _meets(keep, hull, margin) for hull in hulls]
    return needed


def _corners(window: Window, rows: IntArray, cols: IntArray) -> FloatArray:
    """(N, 4, 2) image coordinates of the corners of parts."""
    top, left = window[0] + rows * PART_PX, window[2] + cols * PART_PX
    bottom, right = np.minimum(top + PART_PX, window[1]), np.minimum(left + PART_PX, window[3])
    corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
    return np.stack([np.stack(c, axis=-1) for c in corners], axis=1).astype(np.float64)


def compute_blocks(lattice: PairLattice, window: Window, needed: BoolArray) -> None:
    """Match every block of level 0 that a needed part touches."""
    rows, cols = np.nonzero(needed)
    x, y = lattice.pair.rectified(lattice.pair.reference.camera.undistort(_corners(window, rows, cols)))
    for block in sorted({b for i in range(len(rows)) for b in blocks_under(lattice, 0, x[i], y[i])}):
        lattice.disparity(0, block)


def blocks_under(lattice: PairLattice, level: int, x: FloatArray, y: FloatArray) -> list[tuple[int, int]]:
    """Blocks of a level that the box around rectified positions of level 0 touches, two pixels of the level added."""
    edge = lattice.parameters.block_px * (1 << level)
    more = 2.0 * (1 << level) + 2.0
    down, right = lattice.grid(level)
    rows = range(max(int((y.min() - more) // edge), 0), min(int((y.max() + more) // edge) + 1, down))
    cols = range(max(int((x.min() - more) // edge), 0), min(int((x.max() + more) // edge) + 1, right))
    return [(i, j) for i in rows for j in cols]


def _search_range(lattice: PairLattice, level: int, x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Disparities of level 0 that can come out of the blocks under a part, with the margin that a finer level may add; NaN: none."""
    ranges = [lattice.range(level, block) for block in blocks_under(lattice, level, x, y)]
    known = [r for r in ranges if r is not None]
    if not known:
        return np.nan, np.nan
    step, margin = 1 << level, MARGIN_PX
    return (min(r[0] for r in known) - margin) * step, (max(r[1] for r in known) + margin) * step


def _meets(keep: GroundCells, world: FloatArray, margin: float) -> bool:
    """Whether the box around the points, widened by a margin, meets a chosen cell within the tile."""
    (x_0, y_0), (x_1, y_1) = world.min(axis=0) - margin, world.max(axis=0) + margin
    if x_1 < keep.tile[0] or y_1 < keep.tile[1] or x_0 > keep.tile[2] or y_0 > keep.tile[3]:
        return False
    cells = np.array(keep.chosen, np.float64) * keep.cell_m
    across = (cells[:, 0] <= x_1) & (cells[:, 0] + keep.cell_m >= x_0)
    return bool(np.any(across & (cells[:, 1] <= y_1) & (cells[:, 1] + keep.cell_m >= y_0)))
