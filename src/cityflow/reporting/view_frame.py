"""The frame of the page that shows a run: metres east, north and up about the city's middle, where its 3D Tiles stand, too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.io.globe import globe_of
from cityflow.io.globe_frame import TileFrame, frame_at

SAMPLES, HEIGHTS_M = 9, (-50.0, 100.0)


@dataclass(frozen=True, slots=True, eq=False)
class PageFrame:
    """Where world positions are on the page.

    Attributes
    ----------
    frame : its axes and origin; height 0 of the survey is 0 in the middle
    to_world : (3, 9) coefficients of 1, e, n, u, e², e·n, n², e·u, n·u that give x, y, z of the survey back
    worst_m : how far these are off, within the bounds
    """

    frame: TileFrame
    to_world: FloatArray
    worst_m: float

    @classmethod
    def over(cls, reference: Reference, bounds: Bounds) -> PageFrame:
        """About the middle of `bounds`."""
        x_min, y_min, x_max, y_max = bounds
        frame = frame_at(globe_of(reference, bounds), ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0))
        x, y = np.linspace(x_min, x_max, SAMPLES), np.linspace(y_min, y_max, SAMPLES)
        world = np.stack(np.meshgrid(x, y, np.array(HEIGHTS_M)), axis=-1).reshape(-1, 3)
        e, n, u = frame.local(world).T
        terms = np.column_stack([np.ones_like(e), e, n, u, e * e, e * n, n * n, e * u, n * u])
        size = np.maximum(np.abs(terms).max(axis=0), 1e-12)
        found = np.linalg.lstsq(terms / size, world, rcond=None)[0] / size[:, None]
        return cls(frame, found.T, float(np.abs(terms @ found - world).max()))

    def local(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) east, north, up."""
        return self.frame.local(xyz)

    def plan(self, xy: FloatArray, height: float) -> FloatArray:
        """(N, 2) world metres, all at one height → (N, 3) east, north, up."""
        xy = np.asarray(xy, np.float64).reshape(-1, 2)
        return self.local(np.column_stack([xy, np.full(len(xy), height)]))
