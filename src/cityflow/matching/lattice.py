"""Disparities of a pair, block by block on a fixed lattice of the rectified reference image, each level guided by the coarser one."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.matching.disparity_search import Range, Search, Sight, hull_around, search_around, search_everywhere
from cityflow.matching.grey import GreyImage
from cityflow.matching.rectification import Rectification
from cityflow.matching.resample import resampled
from cityflow.matching.sgm import SgmClock, SgmParameters, matched_block
from cityflow.matching.subpixel import SubpixelParameters, refined

Block = tuple[int, int]
MARGIN_PX = 4.0
"""What the depths of a part of an image are taken to reach beyond the disparities searched, pixels; set by hand."""
GUIDE_PX = 8
"""Pixels of the coarser level around a block that say what it searches."""
COARSEST = 5
"""No level is coarser."""
LEAST_SIDE_PX = 48
"""Shorter side of the coarsest level where ranges are wide, pixels; set by hand."""


class LatticeParameters(Parameters):
    """Levels, blocks and ranges of disparities."""

    block_px: int = Field(448, ge=64, le=4096, description="edge of a block, pixels of its level")
    halo_px: int = Field(32, ge=8, le=512, description="pixels around a block that take part in its matching")
    coarsest_px: int = Field(
        128, ge=32, le=1024, description="the coarsest level is the last whose shorter side has as many pixels"
    )
    most_disparities: int = Field(
        256, ge=64, le=4096, description="largest range of disparities of a pixel; limits memory"
    )
    sgm: SgmParameters = SgmParameters()
    subpixel: SubpixelParameters = SubpixelParameters()


@dataclass
class PairLattice:
    """All blocks of one pair that were asked for.

    A block depends on the two images, the parameters and its place in the lattice, never on what else is asked for.

    Attributes
    ----------
    heights : lowest ground and highest object in sight, metres
    coarsest : the level without a guide; coarser than usual where a pixel would search more than it may
    ranges, blocks, expected : what has been found so far, by level and block; the last are disparities between both heights
    matched : how often each block was matched; blocks that the partner does not see are not
    """

    pair: Rectification
    images: tuple[GreyImage, GreyImage]
    heights: tuple[float, float]
    parameters: LatticeParameters
    clock: SgmClock
    ranges: dict[tuple[int, Block], Range | None] = field(default_factory=dict)
    blocks: dict[tuple[int, Block], Float32Array] = field(default_factory=dict)
    matched: Counter[tuple[int, Block]] = field(default_factory=Counter)
    expected: dict[tuple[int, Block], Range | None] = field(default_factory=dict)

    @cached_property
    def usual(self) -> int:
        """The coarsest level where a pixel may search all that heights allow."""
        return self._level_of(self.parameters.coarsest_px)

    @cached_property
    def coarsest(self) -> int:
        level, deepest = self.usual, self._level_of(LEAST_SIDE_PX)
        while level < deepest and self._widest(level) > self.parameters.most_disparities:
            level += 1
        return level

    def _level_of(self, shorter_px: int) -> int:
        """The last level whose shorter side has so many pixels."""
        camera = self.pair.reference.camera
        return max(0, min(COARSEST, int(np.log2(max(min(camera.width, camera.height) / shorter_px, 1.0)))))

    def shape(self, level: int) -> tuple[int, int]:
        return -(-self.pair.rows >> level), -(-self.pair.cols >> level)

    def grid(self, level: int) -> tuple[int, int]:
        """Rows and columns of blocks."""
        rows, cols = self.shape(level)
        return -(-rows // self.parameters.block_px), -(-cols // self.parameters.block_px)

    def bounds(self, level: int, block: Block) -> tuple[int, int, int, int]:
        """First row, end row, first column, end column."""
        edge, (rows, cols) = self.parameters.block_px, self.shape(level)
        return block[0] * edge, min((block[0] + 1) * edge, rows), block[1] * edge, min((block[1] + 1) * edge, cols)

    def range(self, level: int, block: Block) -> Range | None:
        """Disparities to be searched; None where the partner does not see the block."""
        key = (level, block)
        if key not in self.ranges:
            self.ranges[key] = self._range(level, block)
        return self.ranges[key]

    def disparity(self, level: int, block: Block) -> Float32Array:
        """(rows, cols) float32 of the block, pixels of the level; NaN where unknown."""
        key = (level, block)
        if key not in self.blocks:
            self.blocks[key] = self._matched(level, block)
        return self.blocks[key]

    def forget(self, level: int, block: Block) -> None:
        """Drop the disparities of a block; its range stays. Whoever asks for them again has it matched again."""
        self.blocks.pop((level, block), None)

    def region(
        self, level: int, rows: tuple[int, int], cols: tuple[int, int], *, known_only: bool = False
    ) -> Float32Array:
        """Disparities of half-open ranges of a level, which may reach beyond the lattice; NaN there and where unknown."""
        out = np.full((rows[1] - rows[0], cols[1] - cols[0]), np.nan, np.float32)
        edge, (down, right) = self.parameters.block_px, self.grid(level)
        for i in range(max(rows[0] // edge, 0), min((rows[1] - 1) // edge + 1, down)):
            for j in range(max(cols[0] // edge, 0), min((cols[1] - 1) // edge + 1, right)):
                if known_only and (level, (i, j)) not in self.blocks:
                    continue
                top, bottom, left, end = self.bounds(level, (i, j))
                r0, r1, c0, c1 = max(rows[0], top), min(rows[1], bottom), max(cols[0], left), min(cols[1], end)
                if r0 < r1 and c0 < c1:
                    part = self.disparity(level, (i, j))[r0 - top : r1 - top, c0 - left : c1 - left]
                    out[r0 - rows[0] : r1 - rows[0], c0 - cols[0] : c1 - cols[0]] = part
        return out

    def _matched(self, level: int, block: Block) -> Float32Array:
        top, bottom, left, right = self.bounds(level, block)
        hull = self.range(level, block)
        if hull is None:
            return np.full((bottom - top, right - left), np.nan, np.float32)
        self.matched[level, block] += 1
        halo, (low, high) = self.parameters.halo_px, hull
        row, col, shape = top - halo, left - halo, (bottom - top + 2 * halo, right - left + 2 * halo)
        wide = shape[0], shape[1] + high - low - 1
        reference, in_reference = resampled(self.images[0], self.pair.reference_pixels, (row, col), shape, level)
        partner, in_partner = resampled(self.images[1], self.pair.partner_pixels, (row, col - high + 1), wide, level)
        sight = Sight(_everywhere(in_reference, shape), _everywhere(in_partner, wide), 1 - high)
        search = self._search(level, block, (row, col))
        disparity = matched_block(reference, partner, search, sight, level, self.parameters.sgm, self.clock)
        if level == 0:
            # the partner's first column is that of the highest disparity
            disparity = refined(reference, partner, disparity, high - 1, self.parameters.subpixel)
        return np.ascontiguousarray(disparity[halo:-halo, halo:-halo])

    def _range(self, level: int, block: Block) -> Range | None:
        widest = self._range_of_heights(level, block)
        if widest is None:
            return None
        if level == self.coarsest:
            return search_everywhere(self._bounded(widest)).hull()
        return hull_around(self._guide(level, block)[0], widest)

    def _search(self, level: int, block: Block, corner: tuple[int, int]) -> Search:
        """What the pixels of a raster window around a block search that the partner sees; `corner`: its first row and column."""
        widest = self._range_of_heights(level, block)
        assert widest is not None
        if level == self.coarsest:
            return search_everywhere(self._bounded(widest))
        guide, at = self._guide(level, block)
        search = search_around(guide, widest, self.parameters.most_disparities)
        return search._replace(corner=(corner[0] - 2 * at[0], corner[1] - 2 * at[1]), bits=1)

    def _guide(self, level: int, block: Block) -> tuple[Float32Array, tuple[int, int]]:
        """Disparities of the coarser level around a block, and the row and column of the first of them."""
        halo, (top, bottom, left, right) = self.parameters.halo_px, self.bounds(level, block)
        at = (top - halo >> 1) - GUIDE_PX, (left - halo >> 1) - GUIDE_PX
        ends = (bottom + halo + 1 >> 1) + GUIDE_PX, (right + halo + 1 >> 1) + GUIDE_PX
        return self.region(level + 1, (at[0], ends[0]), (at[1], ends[1])), at

    def _range_of_heights(self, level: int, block: Block) -> Range | None:
        key = (level, block)
        if key not in self.expected:
            self.expected[key] = self._between_heights(level, block)
        return self.expected[key]

    def _between_heights(self, level: int, block: Block) -> Range | None:
        """Disparities between the lowest ground and the highest object where the partner sees them."""
        step, halo = float(1 << level), self.parameters.halo_px
        top, bottom, left, right = self.bounds(level, block)
        x, y = np.meshgrid(
            np.linspace(left - halo, right + halo, 24) * step, np.linspace(top - halo, bottom + halo, 24) * step
        )
        seen = []
        for height in self.heights:
            depth = self.pair.depths_at_height(x, y, height)
            disparity = self.pair.disparities(x, y, depth)
            world = self.pair.world(x, y, depth)
            uv, far = self.pair.partner.project(np.nan_to_num(world))
            in_view = self.pair.partner.holds(uv, -64.0 * step) & (far > 0) & np.isfinite(disparity)
            seen.append(disparity[in_view] / step)
        both = np.concatenate(seen)
        return _rounded(float(both.min()) - 2.0, float(both.max()) + 2.0) if both.size else None

    def _widest(self, level: int) -> int:
        """The most disparities between lowest ground and highest object in a block."""
        down, right = self.grid(level)
        ranges = [self._range_of_heights(level, (i, j)) for i in range(down) for j in range(right)]
        return max((r[1] - r[0] for r in ranges if r is not None), default=0)

    def _bounded(self, widest: Range) -> Range:
        """What a pixel may search of a range without a guide: its lower part, where the ground is."""
        return widest[0], min(widest[1], widest[0] + self.parameters.most_disparities)


def _rounded(low: float, high: float) -> Range:
    """A range of a multiple of 16 that holds both, the slack shared out evenly."""
    need = int(np.ceil(high) - np.floor(low)) + 1
    count = -(-need // 16) * 16
    begin = int(np.floor(low)) - (count - need) // 2
    return begin, begin + count


def _everywhere(seen: BoolArray | None, shape: tuple[int, int]) -> BoolArray:
    """What is seen; None is all of it."""
    return np.ones(shape, np.bool_) if seen is None else seen


def positions(bounds: tuple[int, int, int, int], level: int) -> tuple[FloatArray, FloatArray]:
    """Rectified x and y of the centres of the pixels of a block."""
    step = float(1 << level)
    return np.meshgrid((np.arange(bounds[2], bounds[3]) + 0.5) * step, (np.arange(bounds[0], bounds[1]) + 0.5) * step)
