"""Local frames of tiles (east, north, up), and their position in the frame of the whole city."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.io.globe import Globe


@dataclass(frozen=True, slots=True, eq=False)
class TileFrame:
    """The frame of one tile: metres east, north and up from an origin in its middle.

    Attributes
    ----------
    globe : None in a local frame, whose axes are the tile's
    origin : (3,) in the frame of the whole: metres from the earth's centre (EPSG:4978), or world metres
    axes : (3, 3) rows are east, north and up in the frame of the whole
    """

    globe: Globe | None
    origin: FloatArray
    axes: FloatArray

    def local(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) metres east, north, up; every vertex on its own through the globe."""
        xyz = np.asarray(xyz, np.float64).reshape(-1, 3)
        whole = xyz if self.globe is None else self.globe.geocentric(xyz)
        return np.asarray((whole - self.origin) @ self.axes.T)

    @property
    def matrix(self) -> list[float]:
        """From the tile's frame to that of the whole: 16 numbers, column after column, as 3D Tiles wants them."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.axes.T, self.origin
        return [float(value) for value in matrix.T.reshape(-1)]


def frame_at(globe: Globe | None, xyz: tuple[float, float, float]) -> TileFrame:
    """The frame whose origin is a world position."""
    here = np.array([xyz], np.float64)
    if globe is None:
        return TileFrame(None, here[0], np.eye(3))
    lon, lat = np.radians(globe.geodetic(here)[0, :2])
    east = [-np.sin(lon), np.cos(lon), 0.0]
    north = [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)]
    up = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
    return TileFrame(globe, globe.geocentric(here)[0], np.array([east, north, up]))
