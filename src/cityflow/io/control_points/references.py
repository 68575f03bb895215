"""CRS of control points, and their coordinates in the CRS of a catalog; what becomes of heights is told."""

from __future__ import annotations

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.control_points import ControlPoints
from cityflow.errors import CatalogError
from cityflow.io.control_points.ways import flat, led

BEYOND_DEG = 6.0
"""Surveys go on beyond the area that a CRS is made for, by no more than a zone of UTM; exchanged coordinates mostly lie farther off."""


def wkt_of(text: str, where: str) -> str:
    """WKT of a code, a PROJ string or WKT; raises CatalogError where it is not known."""
    parts = text.strip().replace("EPSG:EPSG:", "EPSG:")
    try:
        return CRS.from_user_input(parts).to_wkt()
    except CRSError as error:
        raise CatalogError(
            f"the CRS {text.strip()!r} is not known", where=where, remedy="give a code such as EPSG:25832"
        ) from error


def in_crs(
    points: ControlPoints, target: CRS | None, given: CRS | None = None, what: str = "control points"
) -> ControlPoints:
    """Points with their coordinates in the catalog's CRS.

    Parameters
    ----------
    target : the catalog's; None for a local frame, where coordinates stay as they are
    given : CRS of the points, where their file states none (or another is meant)
    what : the points are, for notes and messages

    Raises
    ------
    CatalogError
        Where no transformation exists, or points lie far outside of the area that the catalog's CRS is made for.
    """
    if target is None:
        return points
    stated = CRS.from_wkt(points.crs_wkt) if points.crs_wkt is not None else None
    own = given if given is not None else stated
    if own is None:
        note = f"{what} state no CRS: taken as {target.name} → name their CRS if that is wrong"
        return _inside(points.at(points.coordinates, target.to_wkt(), note), target, what)
    if own.equals(target, ignore_axis_order=True):
        return _inside(points, target, what)
    new, notes = led(points.coordinates, own, target, what)
    return _inside(points.at(new, target.to_wkt(), *notes), target, what)


def _inside(points: ControlPoints, target: CRS, what: str) -> ControlPoints:
    """The points; raises CatalogError where some lie far outside of the area of their CRS."""
    far = _far_outside(points.coordinates, target)
    if far.any():
        names = ", ".join(p.name for p, out in zip(points.points, far, strict=True) if out)
        raise CatalogError(
            f"{what} {names} lie outside of {target.name}",
            remedy="check their CRS and the order of x and y (programs differ in writing latitude or longitude first)",
        )
    return points


def _far_outside(xyz: FloatArray, crs: CRS) -> BoolArray:
    """(N,) which places are none, or lie more than `BEYOND_DEG` from the area that the CRS is made for, where that is known."""
    away = np.asarray(~np.isfinite(xyz[:, :2]).all(axis=1) | np.isinf(xyz[:, 2]))
    area = crs.area_of_use or flat(crs).area_of_use
    if area is None:
        return away
    to_degrees = Transformer.from_crs(flat(crs), CRS.from_epsg(4326), always_xy=True)
    degrees = np.column_stack(to_degrees.transform(xyz[:, 0], xyz[:, 1]))
    # 1000 degrees are no latitude of any place
    longitude, latitude = np.where(np.isfinite(degrees), degrees, 1000.0).T
    width = (area.east - area.west) % 360.0 or 360.0
    east = (longitude - area.west + BEYOND_DEG) % 360.0
    within = (
        (east <= width + 2 * BEYOND_DEG) & (latitude >= area.south - BEYOND_DEG) & (latitude <= area.north + BEYOND_DEG)
    )
    return np.asarray(away | ~within)
