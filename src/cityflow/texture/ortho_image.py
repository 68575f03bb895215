"""A given ortho as an image of a camera at great height, with practically parallel rays."""

from __future__ import annotations

import numpy as np

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Grid

LOWEST_M = 1e7
"""An ortho is an image from so high, at least, m: its rays are parallel,"""
RELIEF_M = 100.0
"""Heights around the ground's for which the image must fit its cells."""
ERROR_CELLS = 5e-3
"""and so high that things within `RELIEF_M` are off by no more, cells."""


def ortho_camera(grid: Grid, name: str, ground_m: float = 0.0) -> OrientedImage:
    """The image whose pixel (row, col) shows cell (row, col) of a north-up ortho.

    Parameters
    ----------
    grid : of the ortho
    ground_m : height of the ground below, world metres; things up to 100 m above and below it are seen within 0.005 cells of their cell
    """
    half_cells = max(grid.rows, grid.cols) / 2
    above = max(LOWEST_M, half_cells * RELIEF_M / ERROR_CELLS)
    middle = grid.x_min + grid.cols * grid.cell / 2, grid.y_max - grid.rows * grid.cell / 2
    focal = above / grid.cell
    camera = Camera(grid.cols, grid.rows, focal, focal, grid.cols / 2, grid.rows / 2)
    return OrientedImage(name, camera, np.diag([1.0, -1.0, -1.0]), np.array([*middle, ground_m + above]))


def is_ortho(image: OrientedImage) -> bool:
    """Whether an image stands as high as `ortho_camera` puts orthos."""
    return float(image.centre[2]) >= LOWEST_M / 2
