"""Black margins of image files, from rotation or undistortion: black areas that reach the image border.

Black alone says nothing, as a window may be black. A file that was stored with losses has values near black beside such an edge, so what is told from is
the means of a coarse level, and what lies beside a missing cell goes with it.
"""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.pixels import Pixels, level_shape

COARSE_PX = 1024
"""Pixels along the longer side of the level that is looked at, at most; set by hand."""
NEAR_BLACK = 8.0 / 255.0
"""Share of the white level up to which a mean may be black that was stored with losses."""
BESIDE_PX = 16
"""As far as the blocks of a JPEG with halved colours reach, pixels of level 0."""


class MissingRim:
    """Pixels of an image that show nothing; looked for when it is first asked.

    Parameters
    ----------
    pixels : the image
    white : value that becomes white
    """

    def __init__(self, pixels: Pixels, white: float) -> None:
        self.pixels, self.white = pixels, white
        self.level = max(0, int(np.ceil(np.log2(max(pixels.height, pixels.width) / COARSE_PX))))

    def holds(self, uv: FloatArray, brightest: Float32Array) -> BoolArray:
        """(N,) bool, which places the file shows nothing at.

        Parameters
        ----------
        uv : (N, 2) image coordinates;  brightest : (N,) greatest value of the bands there
        """
        size = np.array([self.pixels.width, self.pixels.height])
        at = np.clip(np.floor(uv), 0, size - 1).astype(np.int64)
        col, row = (at >> self.level).T
        # slivers along the rim, less than a cell wide, are told by the pixels
        sliver = np.minimum(at, size - 1 - at).min(axis=1, initial=self._beside_px) < self._beside_px
        return np.asarray(self.cells[row, col] | (sliver & (brightest <= 0)))

    @cached_property
    def cells(self) -> BoolArray:
        """Cells of the level that are missing, or beside what is missing.

        Those that are near black, and joined by such to one at the rim that is black.
        """
        rows, cols = level_shape(self.pixels.height, self.pixels.width, self.level)
        values = self.pixels.window((0, rows), (0, cols), self.level)[..., :3].max(axis=2)
        dark = values <= NEAR_BLACK * self.white
        rim = np.ones((rows, cols), bool)
        rim[1:-1, 1:-1] = False
        black = rim & (values == 0)
        if not black.any():
            return np.zeros((rows, cols), bool)
        _, parts = cv2.connectedComponents(dark.astype(np.uint8), connectivity=8)
        missing = np.isin(parts, np.unique(parts[black])).astype(np.uint8)
        reach = -(-self._beside_px // (1 << self.level))
        return np.asarray(cv2.dilate(missing, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)).astype(bool))

    @property
    def _beside_px(self) -> int:
        """What lies so near to a missing cell goes; a cell that is missing in part may be between."""
        return BESIDE_PX + ((1 << self.level) if self.level else 0)
