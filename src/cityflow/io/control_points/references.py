"""CRS of control points, and their coordinates in the CRS of a catalog; what becomes of heights is told."""

from __future__ import annotations

import warnings

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError
from pyproj.transformer import TransformerGroup

from cityflow.core.control_points import ControlPoints
from cityflow.errors import CatalogError


def wkt_of(text: str, where: str) -> str:
    """WKT of a code, a PROJ string or WKT; raises CatalogError where it is not known."""
    parts = text.strip().replace("EPSG:EPSG:", "EPSG:")
    try:
        return CRS.from_user_input(parts).to_wkt()
    except CRSError as error:
        raise CatalogError(
            f"the CRS {text.strip()!r} is not known", where=where, remedy="give a code such as EPSG:25832"
        ) from error


def in_crs(points: ControlPoints, target: CRS | None, given: CRS | None = None) -> ControlPoints:
    """Points with their coordinates in the catalog's CRS.

    Parameters
    ----------
    target : the catalog's; None for a local frame, where coordinates stay as they are
    given : CRS of the points, where their file states none (or another is meant)

    Raises
    ------
    CatalogError
        Where no CRS is known, no transformation exists, or points lie outside of it.
    """
    if target is None:
        return points
    stated = CRS.from_wkt(points.crs_wkt) if points.crs_wkt is not None else None
    own = given if given is not None else stated
    if own is None:
        note = f"control points state no CRS: taken as {target.name} → name their CRS if that is wrong"
        return points.at(points.coordinates, target.to_wkt(), note)
    if own.equals(target, ignore_axis_order=True):
        return points
    heights = _has_heights(own) and _has_heights(target)
    source, goal = (own, target) if heights else (_flat(own), _flat(target))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of grids that are missing, which the notes tell
        group = TransformerGroup(source, goal, always_xy=True)
    if not group.transformers:
        raise CatalogError(
            f"no transformation from {own.name} to {target.name}", remedy="transform the points beforehand"
        )
    best, old = group.transformers[0], points.coordinates
    plan = old if heights else old[:, :2]
    new = np.column_stack([*best.transform(*plan.T), *([] if heights else [old[:, 2]])])
    out = [p.name for p, xyz in zip(points.points, new, strict=True) if not np.isfinite(xyz).all()]
    if out:
        raise CatalogError(
            f"control points {', '.join(out)} lie outside of {target.name}",
            remedy="check their CRS and the order of x and y",
        )
    return points.at(new, target.to_wkt(), *_notes(own, target, heights, group))


def _notes(own: CRS, target: CRS, heights: bool, group: TransformerGroup) -> tuple[str, ...]:
    way = group.transformers[0].description
    notes = [f"control points led from {own.name} to {target.name} ({way})"]
    if not heights:
        notes.append(
            f"heights of control points are kept as they are ({_datum(own)}); the catalog's are {_datum(target)}"
        )
    elif "ballpark" in way.lower() or not group.best_available:
        missing = sorted({g.short_name for op in group.unavailable_operations for g in op.grids if not g.available})
        notes.append(
            "the best transformation needs a grid that is not installed" + (f" ({', '.join(missing[:3])})" if missing else "")
            + ": heights may be off by metres → install it (projsync), or give heights in the catalog's datum"
        )  # fmt: skip
    return tuple(notes)


def _has_heights(crs: CRS) -> bool:
    return crs.is_compound or len(crs.axis_info) == 3


def _flat(crs: CRS) -> CRS:
    return crs.sub_crs_list[0] if crs.is_compound else crs.to_2d() if len(crs.axis_info) == 3 else crs


def _datum(crs: CRS) -> str:
    if crs.is_compound:
        return str(crs.sub_crs_list[1].name)
    return "ellipsoidal" if len(crs.axis_info) == 3 else "not stated"
