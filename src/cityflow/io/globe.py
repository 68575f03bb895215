"""From a projected CRS to the globe: every vertex through geodetic coordinates to earth-centred ones (EPSG:4978).

PROJ's own transformation in three dimensions is taken where its grids are installed. Where they are not, x and y take the
best transformation at hand, and heights the shipped geoid, after a step that the EPSG register knows between the heights'
datum and the European one where there is such a step (Ostend's zero is 2.3 m below Amsterdam's).
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from pyproj import CRS, Transformer
from pyproj.aoi import AreaOfInterest
from pyproj.exceptions import CRSError, ProjError
from pyproj.transformer import TransformerGroup

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import crs_of, geographic_bounds, horizontal_crs, vertical_datum
from cityflow.io.geoid import Geoid, shipped_geoid

GEODETIC, GEOCENTRIC = 4979, 4978
EUROPEAN = (5730, 5621)
"""EVRF2000 and EVRF2007, whose zero is Amsterdam's and within decimetres of the geoid's."""

NEAR_THE_GEOID = (*EUROPEAN, 3855, 5773, 5798)
"""Datums that are the European one, or a model of the geoid itself (EGM2008, EGM96, EGM84): no step to take."""

KNOWN_STEP_M, OTHER_STEP_M = 1.0, 2.0
"""Accuracy stated of a height above the ellipsoid by the shipped geoid: with the datum's step known, and without."""


@dataclass(frozen=True, slots=True)
class Placing:
    """How positions came to the globe; what a product says of itself.

    Attributes
    ----------
    horizontal : name of the transformation of x and y
    horizontal_accuracy_m : as the EPSG register states it, NaN where it does not
    datum : of the heights that went in
    geoid : what the heights were shifted by; empty where they were taken as they are
    height_accuracy_m : metres, NaN where unknown
    """

    horizontal: str
    horizontal_accuracy_m: float
    datum: str
    geoid: str
    height_accuracy_m: float

    @property
    def is_shifted(self) -> bool:
        return bool(self.geoid)

    def as_metadata(self) -> dict[str, str | float]:
        """For reports and metadata; unknown figures are left out."""
        figures = {
            "horizontal_accuracy_m": self.horizontal_accuracy_m, "height_accuracy_m": self.height_accuracy_m,
        }  # fmt: skip
        shift = self.geoid or "no geoid shift: the height datum is unknown, heights are used as ellipsoidal ones"
        return {
            "horizontal_operation": self.horizontal,
            "vertical_datum": self.datum,
            "geoid": shift,
            **{name: round(value, 3) for name, value in figures.items() if math.isfinite(value)},
        }


@dataclass(frozen=True, slots=True, eq=False)
class Globe:
    """Positions of a CRS on the globe.

    Attributes
    ----------
    to_geodetic : x, y, height → longitude, latitude, height; heights go through as they are where `geoid` shifts them
    geoid : None where `to_geodetic` shifts the heights, or if the datum of the heights is unknown
    step_m : added to heights before the geoid
    placing : what was done
    """

    to_geodetic: Transformer
    geoid: Geoid | None
    step_m: float
    placing: Placing

    def geodetic(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) longitude, latitude (degrees, WGS 84), height above the ellipsoid (metres)."""
        x, y, z = np.asarray(xyz, np.float64).reshape(-1, 3).T
        if self.placing.is_shifted and self.geoid is None:
            return np.column_stack(self.to_geodetic.transform(x, y, z))
        lon, lat = self.to_geodetic.transform(x, y)
        height = z + self.step_m
        if self.geoid is not None:
            height = height + self.geoid.undulation(lon, lat)
        return np.column_stack([lon, lat, height])

    def geocentric(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 3) metres from the earth's centre (EPSG:4978).

        Raises
        ------
        CatalogError
            Where a position is nowhere on the globe.
        """
        lon, lat, height = self.geodetic(xyz).T
        found = np.column_stack(_geocentric().transform(lon, lat, height))
        lost = ~np.isfinite(found).all(axis=1)
        if lost.any():
            x, y, z = np.asarray(xyz, np.float64).reshape(-1, 3)[np.argmax(lost)]
            raise CatalogError(
                f"the position {x:.1f}, {y:.1f}, {z:.1f} has no position on the globe in {self.placing.horizontal!r}",
                remedy="check the CRS of the catalog, or leave the 3D Tiles out",
            )
        return found


def globe_of(reference: Reference, bounds: Bounds) -> Globe | None:
    """The way from a run's CRS to the globe; None for a local frame.

    Parameters
    ----------
    bounds : of the whole city, so that all of its tiles take the same way

    Raises
    ------
    CatalogError
        Where PROJ knows no transformation.
    """
    return _globe_of(reference, (*bounds,))


@lru_cache(maxsize=8)
def _globe_of(reference: Reference, bounds: Bounds) -> Globe | None:
    """Every tile of a city, its report and its view ask for the same, and PROJ looks for it in its register each time: 30 ms."""
    horizontal = horizontal_crs(reference)
    if horizontal is None:
        return None
    area = geographic_bounds(reference, bounds)
    whole = crs_of(reference)
    if reference.vertical_epsg is not None and whole is not None:
        complete = known_operation(operations(whole, CRS.from_epsg(GEODETIC), area))
        if complete is not None:
            operation = f"PROJ: {complete.description}"
            placing = Placing(
                complete.description, complete.accuracy, vertical_datum(reference), operation, complete.accuracy
            )
            return Globe(complete, None, 0.0, placing)
    flat = _flat(horizontal, area)
    step, geoid, heights = above_ellipsoid(reference.vertical_epsg, area)
    accuracy = flat.accuracy if flat.accuracy >= 0 else math.nan
    placing = Placing(flat.description, accuracy, vertical_datum(reference), *heights)
    return Globe(flat, geoid, step, placing)


def above_ellipsoid(vertical: int | None, area: Bounds | None) -> tuple[float, Geoid | None, tuple[str, float]]:
    """From heights of a datum to those above the ellipsoid: metres to add first, the geoid, and what to say: the geoid with its accuracy.

    Parameters
    ----------
    vertical : EPSG code of the datum's CRS; None: unknown, nothing is done
    area : degrees, in whose middle the step is taken; None: no step
    """
    if vertical is None:
        return 0.0, None, ("", math.nan)
    geoid = shipped_geoid()
    if vertical in NEAR_THE_GEOID:
        return 0.0, geoid, (geoid.name, KNOWN_STEP_M)
    found = _step(vertical, area)
    if found is None:
        return 0.0, geoid, (f"{geoid.name}, the datum taken for the geoid", OTHER_STEP_M)
    step, operation = found
    return step, geoid, (f"{geoid.name}, after {operation} ({step:+.2f} m)", KNOWN_STEP_M)


def _step(vertical: int, area: Bounds | None) -> tuple[float, str] | None:
    """Metres from a datum's heights to European ones in the middle of an area, whole centimetres; by the EPSG register, and by which entry."""
    if area is None:
        return None
    lon, lat = (area[0] + area[2]) / 2, (area[1] + area[3]) / 2
    for target in EUROPEAN:
        operation = known_operation(operations(CRS.from_epsg(vertical), CRS.from_epsg(target), area))
        if operation is not None:
            step = operation.transform(lon, lat, 0.0)[2]
            if math.isfinite(step):
                return round(float(step), 2), operation.description
    return None


def _flat(horizontal: CRS, area: Bounds | None) -> Transformer:
    found = operations(horizontal, CRS.from_epsg(GEODETIC), area)
    chosen = known_operation(found) or (found[0] if found else None)
    if chosen is None:
        raise CatalogError(
            f"no transformation from {horizontal.name} to WGS 84",
            remedy="leave the 3D Tiles out, or reproject the data",
        )
    return chosen


def known_operation(found: list[Transformer]) -> Transformer | None:
    """The first whose accuracy is known: those without are PROJ's ballpark ones, which shift nothing and do not say so."""
    return next((o for o in found if o.accuracy >= 0 and "ballpark" not in o.description.lower()), None)


def operations(source: CRS, target: CRS, area: Bounds | None) -> list[Transformer]:
    """What this installation of PROJ can do, best first."""
    interest = AreaOfInterest(*area) if area is not None else None
    try:
        with warnings.catch_warnings():
            # That a better one lacks its grid is what `Placing` says.
            warnings.simplefilter("ignore", UserWarning)
            group = TransformerGroup(source, target, always_xy=True, area_of_interest=interest)  # type: ignore[arg-type]
            return group.transformers
    except (CRSError, ProjError):
        return []


@lru_cache(maxsize=1)
def _geocentric() -> Transformer:
    return Transformer.from_crs(GEODETIC, GEOCENTRIC, always_xy=True)
