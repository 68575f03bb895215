"""GNSS positions of photographs in a catalog's CRS, known before anything is computed; and a model placed by them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pyproj import CRS

from cityflow.adjustment.line_placing import line_fit
from cityflow.adjustment.placing import Fit, is_line, levelled, robust_fit
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint, ControlPoints
from cityflow.core.photo_metadata import HeightKind, PhotoMetadata
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.control_points.references import in_crs
from cityflow.io.crs import crs_of

FEWEST = 3
"""Points that determine a similarity."""
GNSS_M = 2.0
"""Error of a plain receiver (one standard deviation in plan): positions nearer to where the model has them stay."""
GNSS = "GNSS positions"
ELLIPSOIDAL, SEA_LEVEL = "EPSG:4979", "EPSG:4326+5773"
LEAST_DOWN = 0.5
"""Share of the viewing direction that points to the ground plane of tie points, in the median, for that plane to be the ground."""


@dataclass(frozen=True, slots=True, eq=False)
class GnssPlaces:
    """Where photographs were taken.

    Attributes
    ----------
    names : of N photographs, as their tasks have them
    xyz : (N, 3) metres in the catalog's CRS
    sigmas_m : (N, 3) standard deviations as files state them; NaN where they do not
    axes : (N, 3) viewing directions by gimbal angles: east, north, up; NaN where unknown
    reference : of the coordinates
    heights : what heights count from, for people;  notes : for the user
    """

    names: tuple[str, ...]
    xyz: FloatArray
    sigmas_m: FloatArray
    axes: FloatArray
    reference: Reference
    heights: str
    notes: tuple[str, ...]

    @property
    def least_m(self) -> float:
        """Positions nearer than this to where a model has them are never left out."""
        stated = self.sigmas_m.max(axis=1) if len(self.names) else np.zeros(0)
        return 3.0 * (float(stated.max()) if np.isfinite(stated).all() and len(stated) else GNSS_M)


@dataclass(frozen=True, slots=True, eq=False)
class GnssFit:
    """A model led to positions: `fit` over `images` (N', numbers among the model's), of `places` (N', numbers among the positions); `roll`: how the
    roll about a single line was found, empty where the places do not lie on one."""

    fit: Fit
    images: tuple[int, ...]
    places: tuple[int, ...]
    roll: str


def gnss_places(photos: Mapping[str, PhotoMetadata], reference: Reference) -> GnssPlaces:
    """Positions with heights, in the catalog's CRS.

    Parameters
    ----------
    photos : by the names of their tasks, those whose positions can be true

    Raises
    ------
    CatalogError
        No transformation leads there, or they lie far outside of the CRS's area.
    """
    known = {n: p for n, p in sorted(photos.items()) if p.position is not None and p.position.height_m is not None}
    places = [p.position for p in known.values() if p.position is not None]
    ellipsoidal = sum(p.height_kind is HeightKind.ELLIPSOID for p in places) > len(places) / 2
    points = tuple(
        ControlPoint(name, np.array([p.longitude, p.latitude, p.height_m]))
        for name, p in zip(known, places, strict=True)
    )
    given = ControlPoints(points, CRS.from_user_input(ELLIPSOIDAL if ellipsoidal else SEA_LEVEL).to_wkt())
    led = in_crs(given, crs_of(reference), what=GNSS) if points else given
    kinds = sorted({p.height_kind for p in places})
    told = ", ".join("unknown (taken as mean sea level, EGM96)" if k is HeightKind.UNKNOWN else k for k in kinds)
    nothing = (np.nan,) * 3
    sigmas = np.array([p.sigmas_m or nothing for p in places], np.float64).reshape(-1, 3)
    axes = np.array([nothing if p.axis is None else p.axis for p in known.values()], np.float64).reshape(-1, 3)
    return GnssPlaces(tuple(known), led.coordinates, sigmas, axes, reference, told, led.notes)


def utm(photos: Sequence[PhotoMetadata]) -> str:
    """Code of the UTM zone (WGS 84) in which most of the photographs lie."""
    places = [(p.position.latitude, p.position.longitude) for p in photos if p.position is not None]
    latitude, longitude = np.median(places, axis=0)
    return f"EPSG:{(32600 if latitude >= 0 else 32700) + int((longitude + 180) // 6) % 60 + 1}"


def placed_by_gnss(images: Sequence[OrientedImage], xyz: FloatArray, gnss: GnssPlaces, remedy: str) -> GnssFit:
    """The similarity that leads a model to its positions.

    Parameters
    ----------
    xyz : (P, 3) tie points of the model;  remedy : for the user, where this does not work

    Raises
    ------
    CatalogError
        Too few positions, or they lie on a line, and nothing tells the roll about it.
    """
    number = {n: k for k, n in enumerate(gnss.names)}
    ours = tuple(k for k, i in enumerate(images) if i.name in number)
    theirs = tuple(number[images[k].name] for k in ours)
    if len(ours) < FEWEST:
        problem = f"{len(ours)} oriented images have a usable GNSS position"
        raise CatalogError(problem, where=GNSS, remedy=remedy)
    centres, target = np.array([images[k].centre for k in ours]), gnss.xyz[list(theirs)]
    if not is_line(centres) and not is_line(target):
        return GnssFit(robust_fit(centres, target, gnss.least_m), ours, theirs, "")
    known = np.isfinite(gnss.axes[list(theirs)]).all(axis=1)
    if known.sum() > len(ours) / 2:
        one, other = np.array([images[k].axis for k in ours])[known], gnss.axes[list(theirs)][known]
        roll = "their gimbal angles tell it"
    else:
        up = levelled(images, xyz, 1.0).rotation[2]
        if np.median([-i.axis @ up for i in images]) < LEAST_DOWN:
            problem = "the images lie on one line, which leaves the roll about it open, and look at no level ground"
            raise CatalogError(problem, where=GNSS, remedy=remedy)
        one, other = up[None], np.array([[0.0, 0.0, 1.0]])
        roll = "the ground along the strip is taken as level across it → give control points where it slopes"
    try:
        return GnssFit(line_fit(centres, target, one, other, gnss.least_m), ours, theirs, roll)
    except ValueError as error:
        raise CatalogError(f"the images lie on one line: {error}", where=GNSS, remedy=remedy) from error
