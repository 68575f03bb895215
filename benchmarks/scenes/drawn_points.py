"""The cells of drawn local frames as points in the world, as matching leaves them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.depth_map import ImagePoints, joined
from cityflow.core.grid import Bounds
from cityflow.core.splitting import FrameRasters
from scenes.drawn_noise import smooth_noise

FAR_M = 3000.0
SIGMA_GSD = 0.5
"""What matching expects of a point that two partners agree on, cells along the ray."""
MOST_VIEWS = 4


def drawn_wall_points(frames: Sequence[FrameRasters], seed: int = 0, bounds: Bounds | None = None) -> ImagePoints:
    """All cells with a height, local frame by local frame, over `bounds` of the world where they are given.

    Each local frame counts as one reference image that stands 3 km away against its viewing direction.

    Parameters
    ----------
    frames : with orthos
    seed : of the numbers of partners that agree
    bounds : world metres
    """
    return joined([_points(rasters, seed + 17 * k, bounds) for k, rasters in enumerate(frames)])


def _points(rasters: FrameRasters, seed: int, bounds: Bounds | None) -> ImagePoints:
    grid, frame = rasters.grid, rasters.frame
    rows, cols = np.nonzero(np.isfinite(rasters.dsm))
    place = np.column_stack([grid.x_centres()[cols], grid.y_centres()[rows], rasters.dsm[rows, cols].astype(float)])
    xyz = frame.to_world(place)
    if bounds is not None:
        x, y = xyz[:, 0], xyz[:, 1]
        inside = (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
        rows, cols, xyz = rows[inside], cols[inside], xyz[inside]
    agreeing = np.clip(np.rint(3.0 + smooth_noise(grid, seed, 4.0)), 2, MOST_VIEWS).astype(np.uint8)[rows, cols]
    middle = np.array([grid.x_min + grid.cols * grid.cell / 2, grid.y_max - grid.rows * grid.cell / 2, FAR_M])
    sigma = (SIGMA_GSD * grid.cell * np.sqrt(2.0 / agreeing)).astype(np.float32)
    colour = np.zeros((len(xyz), 3), np.uint8) if rasters.ortho is None else rasters.ortho[:, rows, cols].T.copy()
    centre = frame.to_world(middle[None, :])
    return ImagePoints(xyz, colour, np.zeros(len(xyz), np.int64), agreeing, sigma, (frame.name,), centre)
