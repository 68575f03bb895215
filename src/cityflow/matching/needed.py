"""Parts of a reference image that can show the requested ground cells, for each ground tile by itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.ground_cells import GroundCells
from cityflow.matching.lattice import MARGIN_PX, Block, PairLattice

PART_PX = 64
"""Edge of the squares of the reference image that are looked at or left out; set by hand."""

Window = tuple[int, int, int, int]
"""First row, end row, first column, end column of the reference image; multiples of PART_PX but at the end of the image."""


class NeededParts:
    """Which parts of a reference image may have a point in the cells of which ground tile.

    What is found for a tile depends on no other tile.

    Parameters
    ----------
    grounds : name of each ground tile → its cells
    heights : lowest ground and highest object, world metres
    margin : ground around the cells that counts as theirs, metres

    Attributes
    ----------
    of_tile : name of each tile that the image can show → (rows, cols) of all parts of the image
    """

    def __init__(
        self, reference: OrientedImage, grounds: Mapping[str, GroundCells], heights: tuple[float, float], margin: float
    ) -> None:
        self._grounds, self._margin = grounds, margin
        self.shape = parts_shape(reference.camera)
        self.of_tile: dict[str, BoolArray] = {}
        for name, keep in grounds.items():
            window = window_of(reference, keep, heights, margin)
            if window is not None:
                self.of_tile[name] = np.zeros(self.shape, bool)
                self.of_tile[name][parts_of(window)] = True

    @property
    def of_any(self) -> BoolArray:
        """(rows, cols) of the parts that any tile needs."""
        return np.logical_or.reduce([np.zeros(self.shape, bool), *self.of_tile.values()])

    def narrow(
        self, lattices: Sequence[PairLattice], level: int, window: tuple[slice, slice] = np.s_[:, :]
    ) -> BoolArray:
        """Leave out the parts of a window of them where no pair searches at a level over the cells; (rows, cols) of what any tile still needs in the window."""
        tiles = {name: mask[window] for name, mask in self.of_tile.items() if mask[window].any()}
        left = np.zeros(self.shape, bool)[window]
        rows, cols = np.nonzero(np.logical_or.reduce([left, *tiles.values()]))
        first = window[0].start or 0, window[1].start or 0
        boxes = [ground_boxes(lattice, level, rows + first[0], cols + first[1]) for lattice in lattices]
        for name, mask in tiles.items():
            own = np.flatnonzero(mask[rows, cols])
            found = [self._grounds[name].meets(box[own], self._margin) for box in boxes]
            mask[rows[own], cols[own]] = np.logical_or.reduce(found)
            left |= mask
        return left


def parts_shape(camera: Camera) -> tuple[int, int]:
    return -(-camera.height // PART_PX), -(-camera.width // PART_PX)


def parts_of(window: Window) -> tuple[slice, slice]:
    """Rows and columns of the parts of a window."""
    top, bottom, left, right = window
    return np.s_[top // PART_PX : -(-bottom // PART_PX), left // PART_PX : -(-right // PART_PX)]


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


def ground_boxes(lattice: PairLattice, level: int, rows: IntArray, cols: IntArray) -> FloatArray:
    """(N, 4) x_min, y_min, x_max, y_max around all points that the pair may find in parts, by what it searches at a level.

    A part's points lie in the hull of its corner rays between the depths that the ranges of its blocks allow. NaN where the partner does not see
    the part, infinite where the hull is not bounded.
    """
    out = np.full((len(rows), 4), np.nan)
    x, y = lattice.pair.rectified(lattice.pair.reference.camera.undistort(part_corners(lattice, rows, cols)))
    under, which = np.unique(blocks_under(lattice, level, x, y), axis=0, return_inverse=True)
    found = np.array([_search_range(lattice, level, ends) for ends in under.tolist()]).reshape(-1, 2)[which]
    seen = np.isfinite(found[:, 0])
    x, y, found = x[seen], y[seen], found[seen]
    ends = [lattice.pair.world(x, y, lattice.pair.depths(x, y, found[:, i, None] + 0.0 * x)) for i in (0, 1)]
    hulls = np.concatenate(ends, axis=1)[..., :2]
    boxes = np.concatenate([hulls.min(axis=1), hulls.max(axis=1)], axis=1)
    boxes[~np.isfinite(hulls).all(axis=(1, 2))] = (-np.inf, -np.inf, np.inf, np.inf)
    out[seen] = boxes
    return out


def part_corners(lattice: PairLattice, rows: IntArray, cols: IntArray, more: int = 0) -> FloatArray:
    """(N, 4, 2) image coordinates of the corners of parts, and of so many pixels of the image around them."""
    camera = lattice.pair.reference.camera
    top, left = np.maximum(rows * PART_PX - more, 0), np.maximum(cols * PART_PX - more, 0)
    bottom = np.minimum((rows + 1) * PART_PX + more, camera.height)
    right = np.minimum((cols + 1) * PART_PX + more, camera.width)
    corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
    return np.stack([np.stack(c, axis=-1) for c in corners], axis=1).astype(np.float64)


def blocks_under(lattice: PairLattice, level: int, x: FloatArray, y: FloatArray) -> IntArray:
    """(N, 4) first and end row, first and end column of the blocks of a level that boxes around (N, K) rectified positions of level 0 touch, two
    pixels of the level added; no rows or columns where the lattice ends before."""
    edge = lattice.parameters.block_px * (1 << level)
    more = 2.0 * (1 << level) + 2.0
    ends = []
    for at, size in zip((y, x), lattice.grid(level), strict=True):
        first = np.clip(np.floor((at.min(axis=-1) - more) / edge), 0, size)
        end = np.clip(np.floor((at.max(axis=-1) + more) / edge) + 1, first, np.maximum(first, size))
        ends += [first, end]
    return np.stack(ends, axis=-1).astype(np.int64)


def blocks_within(ends: Sequence[int]) -> list[Block]:
    """Blocks from a first to an end row and from a first to an end column."""
    return [(i, j) for i in range(ends[0], ends[1]) for j in range(ends[2], ends[3])]


def _search_range(lattice: PairLattice, level: int, ends: Sequence[int]) -> tuple[float, float]:
    """Disparities of level 0 that can come out of blocks, with the margin that a finer level may add; NaN: none."""
    ranges = [lattice.range(level, block) for block in blocks_within(ends)]
    known = [r for r in ranges if r is not None]
    if not known:
        return np.nan, np.nan
    step, margin = 1 << level, MARGIN_PX
    return (min(r[0] for r in known) - margin) * step, (max(r[1] for r in known) + margin) * step
