"""Height of the geoid above the ellipsoid, from a grid that ships with the package.

EGM96 on 15 minutes (US National Geospatial-Intelligence Agency, public domain), stored as centimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from rasterio.io import MemoryFile

from cityflow.core.arrays import FloatArray

SHIPPED = "egm96_15min.tif"
CENTIMETRES_PER_METRE = 100.0


@dataclass(frozen=True, slots=True, eq=False)
class Geoid:
    """Undulations on a lattice of the whole world.

    Attributes
    ----------
    name : of the model, for people to read
    centimetres : (rows, cols) int16; row 0 is the north pole, column 0 is 180° west, the last column ends one step before it
    step_deg : between rows and between columns
    """

    name: str
    centimetres: NDArray[np.int16]
    step_deg: float

    def undulation(self, lon: FloatArray, lat: FloatArray) -> FloatArray:
        """Height of the geoid above the WGS 84 ellipsoid.

        Parameters
        ----------
        lon, lat : (N,) degrees

        Returns
        -------
        (N,) metres, bilinear between the lattice's points, as PROJ interpolates; NaN where the position is none
        """
        rows, cols = self.centimetres.shape
        places = np.column_stack([np.asarray(lon, np.float64), np.asarray(lat, np.float64)])
        known = np.asarray(np.isfinite(places).all(axis=1))
        lon, lat = np.where(known[:, None], places, 0.0).T
        row, col = np.clip((90.0 - lat) / self.step_deg, 0, rows - 1), ((lon + 180.0) % 360.0) / self.step_deg
        north, west = np.minimum(row.astype(np.int64), rows - 2), col.astype(np.int64) % cols
        s, e = row - north, col - np.floor(col)
        east = (west + 1) % cols
        upper = self.centimetres[north, west] * (1 - e) + self.centimetres[north, east] * e
        lower = self.centimetres[north + 1, west] * (1 - e) + self.centimetres[north + 1, east] * e
        return np.where(known, (upper * (1 - s) + lower * s) / CENTIMETRES_PER_METRE, np.nan)


@lru_cache(maxsize=1)
def shipped_geoid() -> Geoid:
    """EGM96, 15 minutes.

    >>> shipped_geoid().undulation(np.array([4.3676]), np.array([52.0114])).round(1).tolist()
    [43.5]
    """
    data = (files("cityflow.io") / "data" / SHIPPED).read_bytes()
    with MemoryFile(data) as memory, memory.open() as dataset:
        return Geoid("EGM96, 15 minutes (NGA, public domain)", dataset.read(1), float(dataset.res[0]))
