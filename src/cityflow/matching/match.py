"""Depth maps of one reference image, one for each ground tile that it answers for, from several partners."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pydantic import Field

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.core.ground_cells import GroundCells
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import Pixels
from cityflow.matching.block_use import BlockUse, Square, squares_of
from cityflow.matching.depth_edges import RADIUS_PX as EDGE_RADIUS_PX
from cityflow.matching.depth_edges import EdgeParameters, at_image_edges
from cityflow.matching.grey import GreyImage, TileStore
from cityflow.matching.lattice import LatticeParameters, PairLattice
from cityflow.matching.merge_depths import DISPARITY_SIGMA_PX, MOST_SIGMA_GSD, MergeParameters, depths_of_pair, merged
from cityflow.matching.needed import PART_PX, NeededParts, Window
from cityflow.matching.pairs import PairReport, coarse_level, prepared_pair
from cityflow.matching.sgm import SgmClock
from cityflow.matching.smoothing import SmoothingParameters, mixed_pixels, smoothed
from cityflow.matching.tile_depths import Merged, TileDepths


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
        description="a pair is refused if its vertical parallax (90 %) is larger, or a quarter of it remains after correction, pixels",
    )
    memory_mb: int = Field(
        400, ge=50, le=100_000, description="largest memory of decoded image tiles that are kept, megabytes"
    )


@dataclass(frozen=True, slots=True)
class BlockCount:
    """Blocks of all pairs at one level: how many were matched, and how many different ones these are."""

    matched: int
    different: int


@dataclass(frozen=True, slots=True)
class Matched:
    """Result of matching one reference image.

    Attributes
    ----------
    pairs : what became of each partner; none where the reference image shows none of the cells
    sgm_seconds : processor time of census, costs and paths
    points : name of the ground tile → pixels with a depth, of those that have one
    blocks : level → blocks that were matched
    """

    pairs: tuple[PairReport, ...]
    sgm_seconds: float
    points: Mapping[str, int] = field(default_factory=dict)
    blocks: Mapping[int, BlockCount] = field(default_factory=dict)


def match(
    reference: OrientedImage,
    reference_pixels: Pixels,
    partners: Sequence[tuple[OrientedImage, Pixels]],
    grounds: Mapping[str, GroundCells],
    heights: tuple[float, float],
    parameters: MatchParameters,
    leave: Callable[[str, DepthMap], None],
) -> Matched:
    """Match a reference image with its partners, each block of a pair once.

    The depth map of a ground tile depends on no other tile that is asked for. Memory is that of a strip of squares and of the depth maps that are not
    complete.

    Parameters
    ----------
    grounds : name of a ground tile → its cells; a tile gets the depths whose points stand in its cells
    heights : lowest ground and highest object that the reference image can see, world metres; the same for all calls of one reference image
    leave : gets the depth map of each tile that has a point, as soon as it is complete
    """
    clock = SgmClock()
    store = TileStore(parameters.memory_mb << 20)
    needed = NeededParts(reference, grounds, heights, _margin(reference, heights))
    if not needed.of_tile:
        return Matched((), 0.0)
    grey = GreyImage.of(reference.name, reference_pixels, store)
    lattices, reports = list[PairLattice](), list[PairReport]()
    for partner, pixels in partners:
        images = grey, GreyImage.of(partner.name, pixels, store)
        lattice, report = prepared_pair(
            reference, partner, images, heights, parameters.lattice, parameters.most_parallax_px, clock
        )
        reports.append(report)
        if lattice is not None:
            lattices.append(lattice)
    if not lattices:
        return Matched(tuple(reports), clock.seconds)
    uses, depths = _go_through(
        lattices, needed, grounds, parameters, TileDepths(reference.name, reference_pixels), leave
    )
    found = {lattice.pair.partner.name: (lattice, use) for lattice, use in zip(lattices, uses, strict=True)}
    pairs = tuple(_completed(r, *found[r.partner]) if r.partner in found else r for r in reports)
    return Matched(pairs, clock.seconds, dict(depths.points), _counts(lattices))


def _go_through(
    lattices: Sequence[PairLattice], needed: NeededParts, grounds: Mapping[str, GroundCells], parameters: MatchParameters,
    depths: TileDepths, leave: Callable[[str, DepthMap], None],
) -> tuple[list[BlockUse], TileDepths]:  # fmt: skip
    """Square by square: find what is needed, match it, merge it, hand it to its tiles, drop what no later square needs."""
    reference, coarse = lattices[0].pair.reference, coarse_level(lattices[0])
    wanted = needed.narrow(lattices, coarse)
    squares = squares_of(reference.camera, wanted)
    around = _reach_px(parameters)
    uses = [BlockUse(lattice, squares, wanted, around, coarse) for lattice in lattices]
    complete = _complete_after(squares, needed)
    for number, square in enumerate(squares):
        # finer ranges cost matching: they are asked for where coarser ones leave something
        for level in range(coarse - 1, -1, -1):
            wanted[square.parts] = needed.narrow(lattices, level, square.parts)
        parts = wanted[square.parts]
        if parts.any():
            for use in uses:
                use.match(square, parts)
            found, normal = _merged_square(reference, lattices, square.window, parameters)
            _deal(reference, found, normal, square, needed, grounds, depths)
        for use in uses:
            use.drop(number)
        for tile in complete.get(number, ()):
            if (depth_map := depths.take(tile)) is not None:
                leave(tile, depth_map)
    return uses, depths


def _margin(reference: OrientedImage, heights: tuple[float, float]) -> float:
    """Ground metres around the cells that count as theirs: 16 pixels, at the furthest."""
    return 16.0 * 2.0 * (reference.centre[2] - heights[0]) / reference.camera.fx


def _complete_after(squares: Sequence[Square], needed: NeededParts) -> dict[int, list[str]]:
    """Number of a square → the tiles that get nothing from later ones."""
    found: dict[int, list[str]] = {}
    for tile, mask in needed.of_tile.items():
        own = [number for number, square in enumerate(squares) if mask[square.parts].any()]
        if own:
            found.setdefault(own[-1], []).append(tile)
    return found


def _merged_square(
    reference: OrientedImage, lattices: Sequence[PairLattice], square: Window, parameters: MatchParameters
) -> tuple[Merged, FloatArray]:
    """Depths of a square, right where all blocks around are known; and its `_normal`."""
    around = _widened(square, reference.camera, parameters)
    normal = _normal(reference.camera, around)
    found, sigmas = zip(*(_of_pair(lattice, normal) for lattice in lattices), strict=True)
    depth, sigma, views = merged(found, sigmas, parameters.merge)
    gsd = _middle_gsd(reference, lattices[0].heights)
    grey = lattices[0].images[0].window((around[0], around[1]), (around[2], around[3]), 0)
    depth = at_image_edges(depth, grey, gsd, parameters.edges)
    depth[mixed_pixels(depth, gsd, parameters.smoothing)] = np.nan
    depth = smoothed(depth, gsd, parameters.smoothing)
    inner = np.s_[square[0] - around[0] : square[1] - around[0], square[2] - around[2] : square[3] - around[2]]
    return Merged(square[0], square[2], depth[inner], sigma[inner], views[inner]), normal[inner]


def _deal(
    reference: OrientedImage, found: Merged, normal: FloatArray, square: Square, needed: NeededParts, grounds: Mapping[str, GroundCells],
    depths: TileDepths,
) -> None:  # fmt: skip
    """Give each tile the pixels of its needed parts whose points stand in its cells; `normal` is that of the square."""
    known = np.isfinite(found.depth)
    x, y = _places(found.depth, normal, reference.rotation, reference.centre)
    for tile, mask in needed.of_tile.items():
        if mask[square.parts].any():
            own = np.repeat(np.repeat(mask[square.parts], PART_PX, axis=0), PART_PX, axis=1)
            kept = known & own[: known.shape[0], : known.shape[1]]
            kept[kept] = grounds[tile].holds(x[kept], y[kept])
            depths.add(tile, found, kept)


@njit(cache=True, nogil=True, error_model="numpy")
def _places(depth, normal, rotation, centre):  # type: ignore[no-untyped-def]
    """(h, w) each, x and y of the points of pixels, world metres; NaN where there is no depth."""
    h, w = depth.shape
    x, y = np.empty((h, w)), np.empty((h, w))
    for i in range(h):
        for j in range(w):
            u, v, z = normal[i, j, 0], normal[i, j, 1], np.float64(depth[i, j])
            x[i, j] = centre[0] + z * (u * rotation[0, 0] + v * rotation[1, 0] + rotation[2, 0])
            y[i, j] = centre[1] + z * (u * rotation[0, 1] + v * rotation[1, 1] + rotation[2, 1])
    return x, y


def _normal(camera: Camera, window: Window) -> FloatArray:
    """(h, w, 2) undistorted normalised coordinates of the middles of the pixels of a window."""
    rows, cols = np.arange(window[0], window[1]) + 0.5, np.arange(window[2], window[3]) + 0.5
    return camera.undistort(np.stack(np.meshgrid(cols, rows), axis=-1))


def _reach_px(parameters: MatchParameters) -> int:
    """How far the filters of a pixel look."""
    edges, smoothing = parameters.edges, parameters.smoothing
    return 2 * edges.rounds * EDGE_RADIUS_PX + 2 + smoothing.radius_px


def _widened(square: Window, camera: Camera, parameters: MatchParameters) -> Window:
    """The square with all pixels that the filters of one of its own look at."""
    more = _reach_px(parameters)
    return (
        max(square[0] - more, 0), min(square[1] + more, camera.height),
        max(square[2] - more, 0), min(square[3] + more, camera.width),
    )  # fmt: skip


def _of_pair(lattice: PairLattice, normal: FloatArray) -> tuple[Float32Array, Float32Array]:
    # what is farthest out lies on the rim: no line of the window folds back
    rim = np.concatenate([normal[0], normal[-1], normal[:, 0], normal[:, -1]])
    x, y = lattice.pair.rectified(rim)
    row, col = int(np.floor(y.min())) - 2, int(np.floor(x.min())) - 2
    ends = (row, int(np.ceil(y.max())) + 3), (col, int(np.ceil(x.max())) + 3)
    region = lattice.region(0, *ends, known_only=True)
    most = MOST_SIGMA_GSD * _middle_gsd(lattice.pair.reference, lattice.heights)
    return depths_of_pair(lattice.pair, normal, region, (row, col), DISPARITY_SIGMA_PX, most)


def _middle_gsd(reference: OrientedImage, heights: tuple[float, float]) -> float:
    """Metres per pixel across the ray where the optical axis meets the ground."""
    return float((reference.centre[2] - heights[0]) / -reference.axis[2] / reference.camera.fx)


def _completed(report: PairReport, lattice: PairLattice, use: BlockUse) -> PairReport:
    found = [r for (level, _), r in lattice.ranges.items() if level == 0 and r is not None]
    if not found or not use.matched:
        return report
    disparities = min(r[0] for r in found), max(r[1] for r in found)
    return replace(report, disparities=disparities, matched=use.known / use.matched)


def _counts(lattices: Sequence[PairLattice]) -> dict[int, BlockCount]:
    """Of all pairs together, the finest level first."""
    levels = sorted({level for lattice in lattices for level, _ in lattice.matched})
    every = {
        level: [n for lattice in lattices for (at, _), n in lattice.matched.items() if at == level] for level in levels
    }
    return {level: BlockCount(sum(found), len(found)) for level, found in every.items()}
