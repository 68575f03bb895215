"""From one CRS to another, plan and heights each by the best way at hand.

PROJ's own transformation in three dimensions is taken where its grids are installed and its accuracy is known. Else places go from flat CRS to flat CRS, and
heights by way of the ellipsoid: with the shipped geoid, and the step that the EPSG register knows between a datum and the European one. The ones that PROJ
offers without its grids ("ballpark") shift nothing, and may be off by a hundred metres in plan.
"""

from __future__ import annotations

import numpy as np
from pyproj import CRS, Transformer

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.errors import CatalogError
from cityflow.io.geoid import Geoid, shipped_geoid
from cityflow.io.globe import GEODETIC, OTHER_STEP_M, above_ellipsoid, known_operation, operations

WORLD = CRS.from_epsg(4326)


def has_heights(crs: CRS) -> bool:
    return crs.is_compound or len(crs.axis_info) == 3


def flat(crs: CRS) -> CRS:
    """The CRS without its heights."""
    return crs.sub_crs_list[0] if crs.is_compound else crs.to_2d() if len(crs.axis_info) == 3 else crs


def height_datum(crs: CRS) -> str:
    """What heights count from, for people to read."""
    if crs.is_compound:
        return str(crs.sub_crs_list[1].name)
    return "ellipsoidal" if len(crs.axis_info) == 3 else "not stated"


def led(xyz: FloatArray, own: CRS, target: CRS, what: str) -> tuple[FloatArray, tuple[str, ...]]:
    """(N, 3) places in another CRS, and notes for the user; heights that are NaN stay so, and all stay where one of the CRSs has none.

    Parameters
    ----------
    xyz : east before north, whatever the CRS's own order
    what : the places are, for notes

    Raises
    ------
    CatalogError
        No transformation exists.
    """
    unknown = np.isnan(xyz[:, 2])
    filled = np.where(np.isnan(xyz), 0.0, xyz)
    heights = has_heights(own) and has_heights(target)
    area = _area(filled, own)
    whole = known_operation(operations(own, target, area)) if heights else None
    if whole is not None:
        x, y, z = filled.T
        new = np.column_stack(whole.transform(x, y, z))
        notes = [f"{what} led from {own.name} to {target.name} ({whole.description})"]
    else:
        way, sure = _flat_way(own, target, area)
        notes = [f"{what} led from {own.name} to {target.name} ({way.description})", *sure]
        up, told = _heights(filled, own, target, area, what) if heights else (xyz[:, 2], _kept(own, target, what))
        new = np.column_stack([*way.transform(filled[:, 0], filled[:, 1]), up])
        notes.append(told)
    new[unknown, 2] = np.nan
    return np.asarray(new, np.float64), tuple(notes)


def _kept(own: CRS, target: CRS, what: str) -> str:
    return f"heights of {what} are kept as they are ({height_datum(own)}); the catalog's are {height_datum(target)}"


def _flat_way(own: CRS, target: CRS, area: Bounds | None) -> tuple[Transformer, tuple[str, ...]]:
    """The way of x and y, and what is unsure of it."""
    found = operations(flat(own), flat(target), area)
    known = known_operation(found)
    if known is not None:
        return known, ()
    if not found:
        raise CatalogError(
            f"no transformation from {own.name} to {target.name}", remedy="transform the points beforehand"
        )
    note = (
        f"no transformation of known accuracy leads from {own.name} to {target.name}: their datums are taken as equal, and places may be off by "
        "a hundred metres → name the CRS by its EPSG code"
    )
    return found[0], (note,)


def _heights(xyz: FloatArray, own: CRS, target: CRS, area: Bounds | None, what: str) -> tuple[FloatArray, str]:
    """(N,) heights in the target's datum, by way of the ellipsoid, and how."""
    if own.is_compound and target.is_compound and own.sub_crs_list[1].equals(target.sub_crs_list[1]):
        return xyz[:, 2], f"heights of {what} stay in {height_datum(target)}"
    degrees = np.column_stack(_flat_way(own, WORLD, area)[0].transform(xyz[:, 0], xyz[:, 1]))
    up, told, sure = xyz[:, 2], [], []
    if own.is_compound:
        up = up * own.sub_crs_list[1].axis_info[0].unit_conversion_factor
        step, geoid, name, accuracy = _datum(own, area)
        up = up + step + geoid.undulation(*degrees.T)
        told, sure = [name], [accuracy]
    elif (way := known_operation(operations(own, CRS.from_epsg(GEODETIC), area))) is not None:
        x, y, z = xyz.T
        up = way.transform(x, y, z)[2]
    if target.is_compound:
        step, geoid, name, accuracy = _datum(target, area)
        up = up - step - geoid.undulation(*degrees.T)
        told, sure = [*told, name], [*sure, accuracy]
    by = " and ".join(dict.fromkeys(told)) or "the ellipsoid"
    return np.asarray(up), (
        f"heights of {what} led from {height_datum(own)} to {height_datum(target)} by {by}: all may be off together by up to {max(sure, default=0.0):g} m "
        "→ install PROJ's grid (projsync), or give heights in the catalog's datum"
    )


def _datum(crs: CRS, area: Bounds | None) -> tuple[float, Geoid, str, float]:
    """Of a compound CRS's heights: metres to add before the geoid, that, what to say, accuracy in metres; without a code, the datum is taken for the geoid."""
    code = crs.sub_crs_list[1].to_epsg(min_confidence=50)
    step, geoid, (name, accuracy) = above_ellipsoid(code, area)
    if geoid is None:
        geoid = shipped_geoid()
        return 0.0, geoid, f"{geoid.name}, the datum taken for the geoid", OTHER_STEP_M
    return step, geoid, name, accuracy


def _area(xyz: FloatArray, own: CRS) -> Bounds | None:
    """West, south, east, north of the places, degrees; None where they are nowhere."""
    way = Transformer.from_crs(flat(own), WORLD, always_xy=True)
    degrees = np.column_stack(way.transform(xyz[:, 0], xyz[:, 1]))
    degrees = degrees[np.isfinite(degrees).all(axis=1) & (np.abs(degrees) <= (180.0, 90.0)).all(axis=1)]
    if not len(degrees):
        return None
    west, south, east, north = (round(float(v), 4) for v in (*degrees.min(axis=0), *degrees.max(axis=0)))
    return west, south, east, north
