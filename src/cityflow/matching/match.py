"""Depth map of one reference image over some ground cells, from several partners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.core.ground_cells import GroundCells
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import Pixels
from cityflow.matching.depth_edges import EdgeParameters, at_image_edges
from cityflow.matching.grey import GreyImage, TileStore
from cityflow.matching.lattice import LatticeParameters, PairLattice
from cityflow.matching.merge import DISPARITY_SIGMA_PX, MOST_SIGMA_GSD, MergeParameters, depths_of_pair, merged
from cityflow.matching.needed import PART_PX, Window, compute_blocks, parts_of_pair, parts_shape, window_of
from cityflow.matching.parallax import VerticalParallax, vertical_parallax
from cityflow.matching.rectification import UnusablePair, rectify
from cityflow.matching.sgm import SgmClock
from cityflow.matching.smoothing import SmoothingParameters, mixed_pixels, smoothed

STRIP_PARTS = 8
"""Pixels are merged in squares of so many parts: bounds memory."""
PARALLAX_LEVEL = 2
"""Vertical parallax is measured at a quarter of the size, over the whole image; set by hand, to save time."""
UNMEASURED_SHARE = 0.3
"""Share of matched pixels from which a pair is taken whose parallax cannot be measured; set by hand."""

PLANE_LEAN = 1.0
"""Reference plane: 0 level, 1 parallel to the reference image, which is kinder to façades (docs/matching.md)."""
LEAST_MATCHED = 0.05
"""A pair with a smaller share of matched pixels at the coarse level is refused; set by hand."""


class MatchParameters(Parameters):
    """Dense matching of one reference image with its partners."""

    lattice: LatticeParameters = LatticeParameters()
    merge: MergeParameters = MergeParameters()
    edges: EdgeParameters = EdgeParameters()
    smoothing: SmoothingParameters = SmoothingParameters()
    most_parallax_px: float = Field(
        4.0,
        gt=0,
        le=50,
        description="a pair whose rows are further apart (90 %), or that keeps a quarter of it after correction, is refused",
    )
    memory_mb: int = Field(400, ge=50, le=100_000, description="bound of decoded image tiles kept, megabytes")


@dataclass(frozen=True, slots=True)
class PairReport:
    """What became of one partner.

    Attributes
    ----------
    used : False where it was refused;  reason : why
    parallax_px, parallax_90_px : median and 90 % of the absolute vertical parallax before correction; NaN where it was not measured
    parallax_rest_px : median of the absolute rest after correction
    disparities : lowest and highest disparity searched at level 0, pixels
    matched : share of the window's pixels of this pair with a disparity
    """

    partner: str
    used: bool
    reason: str = ""
    parallax_px: float = float("nan")
    parallax_90_px: float = float("nan")
    parallax_rest_px: float = float("nan")
    disparities: tuple[int, int] = (0, 0)
    matched: float = 0.0


@dataclass(frozen=True, slots=True)
class Matched:
    """Result of matching one reference image.

    Attributes
    ----------
    depth_map : None where the reference image shows none of the cells, or no partner could be used
    sgm_seconds : time inside the library's matcher
    pixels : pixels with a depth
    """

    depth_map: DepthMap | None
    pairs: tuple[PairReport, ...]
    sgm_seconds: float
    pixels: int


def match(
    reference: OrientedImage,
    reference_pixels: Pixels,
    partners: Sequence[tuple[OrientedImage, Pixels]],
    keep: GroundCells,
    heights: tuple[float, float],
    parameters: MatchParameters,
) -> Matched:
    """Match a reference image with its partners and keep the depths whose points stand in `keep`.

    Parameters
    ----------
    heights : lowest ground and highest object that the reference image can see, world metres; the same for all calls of one reference image
    """
    clock = SgmClock()
    store = TileStore(parameters.memory_mb << 20)
    grey = GreyImage.of(reference.name, reference_pixels, store)
    lattices: list[PairLattice] = []
    reports: list[PairReport] = []
    margin = _margin(reference, heights)
    window = window_of(reference, keep, heights, margin)
    for partner, pixels in partners if window is not None else ():
        images = grey, GreyImage.of(partner.name, pixels, store)
        lattice, report = _prepared(reference, partner, images, heights, parameters, clock)
        reports.append(report)
        if lattice is not None:
            lattices.append(lattice)
    if window is None or not lattices:
        return Matched(None, tuple(reports), clock.seconds, 0)
    needed = _needed(lattices, window, keep, margin)
    for lattice in lattices:
        compute_blocks(lattice, window, needed)
    depth_map = _depth_map(reference, reference_pixels, lattices, window, needed, keep, parameters)
    reports = [_completed(r, lattices) for r in reports]
    return Matched(depth_map, tuple(reports), clock.seconds, int(np.isfinite(depth_map.depth).sum()))


def _margin(reference: OrientedImage, heights: tuple[float, float]) -> float:
    """Ground metres around the cells whose pixels the filters look at: 16 pixels, at the furthest."""
    return 16.0 * 2.0 * (reference.centre[2] - heights[0]) / reference.camera.fx


def _prepared(
    reference: OrientedImage, partner: OrientedImage, images: tuple[GreyImage, GreyImage], heights: tuple[float, float],
    parameters: MatchParameters, clock: SgmClock,
) -> tuple[PairLattice | None, PairReport]:  # fmt: skip
    """A pair's lattice with its vertical parallax corrected, or None; and what was found."""
    low, high = heights
    try:
        pair = rectify(reference, partner, low + 0.2 * (high - low), PLANE_LEAN)
    except UnusablePair as error:
        return None, PairReport(partner.name, False, error.problem)
    draft = PairLattice(pair, images, heights, parameters.lattice, clock)
    level = min(PARALLAX_LEVEL, draft.coarsest)
    share = _matched_share(draft, level)
    if share < LEAST_MATCHED:
        return None, PairReport(partner.name, False, f"only {share:.1%} of the pixels could be matched", matched=share)
    parallax = vertical_parallax(draft, level)
    if parallax is None:
        # much that matches both ways is no accident, even where no patch has texture across the rows
        reason = f"vertical parallax could not be measured; {share:.1%} of the pixels match"
        good = share >= UNMEASURED_SHARE
        return draft if good else None, PairReport(partner.name, good, reason, matched=share)
    report = PairReport(partner.name, True, "", parallax.median_px, parallax.ninety_px, parallax.rest_px, matched=share)
    if _too_far(parallax, parameters):
        reason = f"vertical parallax {parallax.ninety_px:.2f} px (90 %), {parallax.rest_px:.2f} px after correction"
        return None, replace(report, used=False, reason=reason)
    # coarse levels stay as they were matched: the correction is a fraction of their pixels
    blocks = {key: found for key, found in draft.blocks.items() if key[0] >= level}
    ranges = {key: found for key, found in draft.ranges.items() if key[0] >= level}
    return PairLattice(pair.moved(parallax.offset), images, heights, parameters.lattice, clock, ranges, blocks), report


def _too_far(parallax: VerticalParallax, parameters: MatchParameters) -> bool:
    most = parameters.most_parallax_px
    return parallax.ninety_px > most or parallax.rest_px > 0.25 * most


def _matched_share(lattice: PairLattice, level: int) -> float:
    """Share of matched pixels among the blocks of a level that the partner sees."""
    down, right = lattice.grid(level)
    known = total = 0
    for block in [(i, j) for i in range(down) for j in range(right)]:
        if lattice.range(level, block) is not None:
            part = lattice.disparity(level, block)
            known, total = known + int(np.isfinite(part).sum()), total + part.size
    return known / max(total, 1)


def _needed(lattices: Sequence[PairLattice], window: Window, keep: GroundCells, margin: float) -> BoolArray:
    """Parts of the window that can have a point in the cells, by any pair; found at a coarse level first, as finer ranges cost matching."""
    needed = np.ones(parts_shape(window), bool)
    for level in range(min(PARALLAX_LEVEL, lattices[0].coarsest), -1, -1):
        found = [parts_of_pair(lattice, level, window, needed, keep, margin) for lattice in lattices]
        needed = np.logical_or.reduce(found)
    return needed


def _completed(report: PairReport, lattices: Sequence[PairLattice]) -> PairReport:
    for lattice in lattices:
        if lattice.pair.partner.name == report.partner:
            found = [r for (level, _), r in lattice.ranges.items() if level == 0 and r is not None]
            blocks = [b for (level, _), b in lattice.blocks.items() if level == 0]
            if found and blocks:
                known = sum(int(np.isfinite(b).sum()) for b in blocks) / sum(b.size for b in blocks)
                return replace(report, disparities=(min(r[0] for r in found), max(r[1] for r in found)), matched=known)
    return report


def _depth_map(
    reference: OrientedImage, pixels: Pixels, lattices: Sequence[PairLattice], window: Window, needed: BoolArray,
    keep: GroundCells, parameters: MatchParameters,
) -> DepthMap:  # fmt: skip
    """Merge square by square and put together."""
    top, bottom, left, right = window
    shape = (bottom - top, right - left)
    depth, sigma = np.full(shape, np.nan, np.float32), np.full(shape, np.nan, np.float32)
    views = np.zeros(shape, np.uint8)
    edge = STRIP_PARTS * PART_PX
    for r in range(top, bottom, edge):
        for c in range(left, right, edge):
            inner = (r, min(r + edge, bottom), c, min(c + edge, right))
            parts = np.s_[
                (r - top) // PART_PX : (inner[1] - top - 1) // PART_PX + 1,
                (c - left) // PART_PX : (inner[3] - left - 1) // PART_PX + 1,
            ]
            if needed[parts].any():
                at = np.s_[r - top : inner[1] - top, c - left : inner[3] - left]
                depth[at], sigma[at], views[at] = _merged_square(reference, lattices, inner, keep, parameters)
    colour = pixels.window((top, bottom), (left, right))
    return DepthMap(reference.name, top, left, depth, sigma, views, colour)


def _merged_square(
    reference: OrientedImage,
    lattices: Sequence[PairLattice],
    square: Window,
    keep: GroundCells,
    parameters: MatchParameters,
) -> tuple[Float32Array, Float32Array, ByteArray]:
    """Depth, sigma and views of a square, those outside the cells left out."""
    around = _widened(square, reference.camera, parameters)
    rows, cols = np.arange(around[0], around[1]) + 0.5, np.arange(around[2], around[3]) + 0.5
    normal = reference.camera.undistort(np.stack(np.meshgrid(cols, rows), axis=-1))
    depths, sigmas = zip(*(_of_pair(lattice, normal) for lattice in lattices), strict=True)
    depth, sigma, views = merged(depths, sigmas, parameters.merge)
    gsd = _middle_gsd(reference, lattices[0].heights)
    grey = lattices[0].images[0].window((around[0], around[1]), (around[2], around[3]), 0)
    depth = at_image_edges(depth, grey, gsd, parameters.edges)
    depth[mixed_pixels(depth, gsd, parameters.smoothing)] = np.nan
    depth = smoothed(depth, gsd, parameters.smoothing)
    inner = np.s_[square[0] - around[0] : square[1] - around[0], square[2] - around[2] : square[3] - around[2]]
    kept = _kept(reference, normal[inner], depth[inner], keep)
    return (
        np.where(kept, depth[inner], np.float32(np.nan)), np.where(kept, sigma[inner], np.float32(np.nan)),
        np.where(kept, views[inner], np.uint8(0)),
    )  # fmt: skip


def _widened(square: Window, camera: Camera, parameters: MatchParameters) -> Window:
    """The square with all pixels that the filters of one of its own look at."""
    edges, smoothing = parameters.edges, parameters.smoothing
    more = 2 * edges.rounds * edges.radius_px + 2 + smoothing.radius_px
    return (
        max(square[0] - more, 0), min(square[1] + more, camera.height),
        max(square[2] - more, 0), min(square[3] + more, camera.width),
    )  # fmt: skip


def _of_pair(lattice: PairLattice, normal: FloatArray) -> tuple[Float32Array, Float32Array]:
    x, y = lattice.pair.rectified(normal)
    row, col = int(np.floor(y.min())) - 2, int(np.floor(x.min())) - 2
    ends = (row, int(np.ceil(y.max())) + 3), (col, int(np.ceil(x.max())) + 3)
    region = lattice.region(0, *ends, known_only=True)
    most = MOST_SIGMA_GSD * _middle_gsd(lattice.pair.reference, lattice.heights)
    return depths_of_pair(lattice.pair, normal, region, (row, col), DISPARITY_SIGMA_PX, most)


def _middle_gsd(reference: OrientedImage, heights: tuple[float, float]) -> float:
    """Metres per pixel across the ray where the optical axis meets the ground."""
    return float((reference.centre[2] - heights[0]) / -reference.axis[2] / reference.camera.fx)


def _kept(reference: OrientedImage, normal: FloatArray, depth: Float32Array, keep: GroundCells) -> BoolArray:
    known = np.isfinite(depth)
    rays = np.concatenate([normal[known], np.ones((int(known.sum()), 1))], axis=-1) @ reference.rotation
    xy = reference.centre[:2] + depth[known, None].astype(np.float64) * rays[:, :2]
    kept = np.zeros_like(known)
    kept[known] = keep.holds(xy[:, 0], xy[:, 1])
    return kept
