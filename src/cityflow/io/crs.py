"""Coordinate reference systems: from a code to a `Reference`, with the requirements of a metric run."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.core.reference import LOCAL, Reference
from cityflow.errors import CatalogError

METRIC_REMEDY = (
    "name a projected CRS in metres, such as EPSG:25833 or EPSG:7415, and reproject the data to it; or use 'local'"
)
FOOT = 0.3048
"""Metres a foot (international)."""
MARGIN_DEG = 1 / 3
"""So far beyond a CRS's area of use, as the register has it, coordinates may still be meant."""


@lru_cache(maxsize=64)
def resolve(code: str) -> Reference:
    """The reference that a code names.

    Parameters
    ----------
    code : ``EPSG:n``, ``EPSG:n+m`` (horizontal and vertical CRS), or ``local``

    Raises
    ------
    CatalogError
        Where the code is unknown, or its coordinates are not projected metres.

    Examples
    --------
    >>> resolve("EPSG:7415").vertical_epsg
    5709
    """
    text = code.strip()
    if text.lower() == LOCAL:
        return Reference(LOCAL, None, None, "local metric frame")
    try:
        crs = CRS.from_user_input(text.upper() if text.lower().startswith("epsg:") else text)
    except CRSError as error:
        remedy = (
            "give a code of the EPSG register, such as EPSG:7415, or 'local' for a metric frame without georeference"
        )
        raise CatalogError(f"the CRS {code!r} is not known", remedy=remedy) from error
    return reference_of(crs)


def reference_of(crs: CRS) -> Reference:
    """The reference of a CRS that a file carries; raises `CatalogError` where it is not projected metres."""
    horizontal, vertical = _parts(crs)
    _refuse_unless_metric(horizontal, vertical)
    horizontal_epsg = horizontal.to_epsg(min_confidence=50)
    vertical_epsg = vertical.to_epsg(min_confidence=50) if vertical is not None else None
    if horizontal_epsg is None:
        raise CatalogError(f"the CRS {crs.name!r} has no EPSG code", remedy="assign one with --crs EPSG:n")
    return Reference(_code(crs, horizontal_epsg, vertical_epsg), horizontal_epsg, vertical_epsg, crs.name)


def _code(crs: CRS, horizontal_epsg: int, vertical_epsg: int | None) -> str:
    if vertical_epsg is None:
        return f"EPSG:{horizontal_epsg}"
    compound = crs.to_epsg(min_confidence=50)
    return f"EPSG:{compound}" if compound is not None else f"EPSG:{horizontal_epsg}+{vertical_epsg}"


def _parts(crs: CRS) -> tuple[CRS, CRS | None]:
    if crs.is_compound:
        first, second = crs.sub_crs_list[:2]
        return _unbound(first), second
    return _unbound(crs), None


def _unbound(crs: CRS) -> CRS:
    return crs.source_crs if crs.is_bound and crs.source_crs is not None else crs


def _refuse_unless_metric(horizontal: CRS, vertical: CRS | None) -> None:
    if not horizontal.is_projected:
        raise CatalogError(
            f"{horizontal.name} is not a projected CRS; its coordinates are no metres", remedy=METRIC_REMEDY
        )
    for crs in (horizontal, vertical):
        for axis in crs.axis_info if crs is not None else []:
            if abs(axis.unit_conversion_factor - 1) > 1e-9:
                raise CatalogError(f"{crs.name} is in {axis.unit_name}, not in metres", remedy=METRIC_REMEDY)  # type: ignore[union-attr]


def crs_of(reference: Reference) -> CRS | None:
    """pyproj's CRS with its heights where known; None for a local frame."""
    return None if reference.is_local else CRS.from_user_input(reference.code)


def horizontal_crs(reference: Reference) -> CRS | None:
    """pyproj's CRS of x and y alone; None for a local frame."""
    return None if reference.horizontal_epsg is None else CRS.from_epsg(reference.horizontal_epsg)


def vertical_datum(reference: Reference) -> str:
    """Name of the heights' reference, or what is known instead, for people to read."""
    if reference.is_local:
        return "local"
    return CRS.from_epsg(reference.vertical_epsg).name if reference.vertical_epsg is not None else "not stated"


def contradiction(reference: Reference, found: CRS) -> str:
    """How a file's CRS contradicts the catalog's reference; empty where it agrees or says less.

    A horizontal CRS without heights agrees with a compound one of the same horizontal part.
    """
    expected = horizontal_crs(reference)
    if expected is None:
        return f"the file says {found.name}, but the catalog is a local frame"
    horizontal, vertical = _parts(found)
    if horizontal.to_epsg(min_confidence=50) != reference.horizontal_epsg and not horizontal.equals(
        expected, ignore_axis_order=True
    ):
        return f"the file says {horizontal.name}, the catalog {expected.name} (EPSG:{reference.horizontal_epsg})"
    if (
        vertical is None
        or reference.vertical_epsg is None
        or vertical.to_epsg(min_confidence=50) in (None, reference.vertical_epsg)
    ):
        return ""
    return f"the file's heights are {vertical.name}, the catalog's {vertical_datum(reference)}"


def horizontal_transform(source: CRS | Reference, target: CRS | Reference) -> Transformer:
    """Transformer of (x, y), east before north whatever the CRS's own axis order.

    Raises
    ------
    CatalogError
        Where one side is a local frame.
    """
    a, b = _horizontal(source), _horizontal(target)
    try:
        return _transformer(a.srs, b.srs)
    except ProjError as error:
        raise CatalogError(
            f"no transformation from {a.name} to {b.name}", remedy="reproject the data beforehand"
        ) from error


@lru_cache(maxsize=64)
def _transformer(source: str, target: str) -> Transformer:
    """Made once: finding the way between two CRSs takes longer than most of what goes along it."""
    return Transformer.from_crs(source, target, always_xy=True)


def _horizontal(side: CRS | Reference) -> CRS:
    crs = horizontal_crs(side) if isinstance(side, Reference) else _parts(side)[0]
    if crs is None:
        raise CatalogError(
            "a local frame cannot be transformed", remedy="assign a CRS to the catalog with --crs EPSG:n"
        )
    return crs


def geographic_bounds(reference: Reference, bounds: Bounds) -> Bounds | None:
    """West, south, east, north in degrees (WGS 84) to 1e-7; None for a local frame or where undefined."""
    if reference.is_local:
        return None
    degrees = horizontal_transform(reference, CRS.from_epsg(4326)).transform_bounds(*bounds, densify_pts=21)
    if not np.isfinite(degrees).all():
        return None
    west, south, east, north = (round(float(v), 7) for v in degrees)
    return west, south, east, north


def fits(reference: Reference, bounds: Bounds) -> bool:
    """True where `bounds` meets the CRS's area of use (with a margin of a third of a degree); always for a local frame."""
    crs = horizontal_crs(reference)
    if crs is None or crs.area_of_use is None:
        return True
    degrees = geographic_bounds(reference, bounds)
    west, south, east, north = crs.area_of_use.bounds
    if degrees is None or west > east:
        return degrees is not None
    away = (degrees[0] - east, west - degrees[2], degrees[1] - north, south - degrees[3])
    return max(away) <= MARGIN_DEG


def suspicion(reference: Reference, bounds: Bounds) -> str:
    """Why coordinates look as if they were not metres of this reference; empty where nothing does.

    Degrees are recognised in any frame, feet where only the shrunk coordinates lie in the CRS's area of use.
    """
    if looks_like_degrees(bounds) and (not reference.is_local or max(bounds[2] - bounds[0], bounds[3] - bounds[1]) < 1):
        return "the coordinates look like degrees, not metres"
    if fits(reference, bounds):
        return ""
    x_min, y_min, x_max, y_max = bounds
    if fits(reference, (x_min * FOOT, y_min * FOOT, x_max * FOOT, y_max * FOOT)):
        return f"the coordinates lie outside the area of {reference.name}, but would lie inside if they were feet"
    return f"the coordinates lie outside the area of use of {reference.name}"


def looks_like_degrees(bounds: Bounds) -> bool:
    """True where every coordinate could be a longitude or latitude."""
    return max(abs(bounds[0]), abs(bounds[2])) <= 180 and max(abs(bounds[1]), abs(bounds[3])) <= 90


def transformed(transformer: Transformer, xy: FloatArray) -> FloatArray:
    """(N, 2) coordinates transformed; NaN where undefined."""
    x, y = transformer.transform(xy[:, 0], xy[:, 1])
    result = np.column_stack([x, y]).astype(np.float64)
    result[~np.isfinite(result).all(axis=1)] = np.nan
    return result
