"""Checks the outlines of a catalog: readable, inside the survey, and of a shape that a building can have."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.catalog.check_results import Seen
from cityflow.catalog.findings import Level
from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import Catalog, OutlineAsset
from cityflow.io.tables.feature_ids import listing
from cityflow.io.tables.outline_file import read_outlines
from cityflow.orientation.views import View, footprint

NO_AREA_M2 = 0.01
"""An outline of less is none: a square decimetre; set by hand."""


def check_outlines(asset: OutlineAsset, catalog: Catalog, seen: Seen) -> None:
    try:
        outlines, notes = read_outlines(asset.href, asset.id_column, asset.id_format, catalog.reference, asset.layer)
    except CatalogError as error:
        if not any(f.where == asset.href and f.level is Level.ERROR for f in seen.findings):
            seen.fail(error, asset.href)
        return
    seen.outlines = outlines
    for note in notes:
        seen.say(Level.NOTE, asset.href, note)
    if asset.id_column is None:
        remedy = "name a column with --id-column to keep the source's ids"
        seen.say(Level.NOTE, asset.href, "no id column: ids come from the geometry", remedy)
    _check_places(asset, catalog, seen)
    _check_shapes(asset, seen)


def _check_places(asset: OutlineAsset, catalog: Catalog, seen: Seen) -> None:
    """Outlines that no LiDAR file's extent covers; those partly covered are told apart."""
    extents = [a.bounds for a in catalog.lidar] or [r.bounds for r in catalog.rasters.values()]
    parts = [shapely.box(*bounds) for bounds in extents]
    parts += [footprint(View(a.oriented, a.heights)) for a in catalog.images if not catalog.lidar]
    survey = shapely.union_all(parts)
    polygons = np.array([o.polygon for o in seen.outlines], object)
    placed = ~shapely.is_empty(polygons)
    shapely.prepare(survey)
    meets = shapely.intersects(survey, polygons)
    boxes = shapely.box(*shapely.bounds(polygons).T)
    # Adjoining files leave gaps of a point spacing between their extents, which are no holes in the survey.
    inside = shapely.covers(survey.buffer(1.0), boxes)
    names = np.array([o.id or f"feature {i}" for i, o in enumerate(seen.outlines, 1)])
    outside = names[placed & ~meets].tolist()
    seen.outside = len(outside)
    if placed.any() and len(outside) == int(placed.sum()):
        seen.say(
            Level.ERROR,
            asset.href,
            "all outlines stand outside the survey",
            "check the CRS of the outlines and of the survey",
        )
    elif outside:
        problem = f"outlines outside the survey: {len(outside)} ({listing(outside)})"
        seen.say(Level.WARNING, asset.href, problem, "they are refused in a run; extend the survey, or remove them")
    partly = names[placed & meets & ~inside].tolist()
    if partly:
        problem = f"outlines over the edge of the survey: {len(partly)} ({listing(partly)})"
        seen.say(Level.WARNING, asset.href, problem, "their roofs will lack points")


def _check_shapes(asset: OutlineAsset, seen: Seen) -> None:
    polygons = np.array([o.polygon for o in seen.outlines], object)
    names = np.array([o.id or f"feature {i}" for i, o in enumerate(seen.outlines, 1)])
    finite = np.array([bool(np.isfinite(shapely.get_coordinates(p)).all()) for p in polygons])
    usable = finite & ~shapely.is_empty(polygons)
    # A figure of eight has the signed area zero; only mended does it show what it encloses.
    mended = shapely.make_valid(np.where(usable, polygons, Polygon()))
    flat = usable & (shapely.area(mended) < NO_AREA_M2)
    invalid = usable & ~flat & ~shapely.is_valid(polygons)
    refused, repaired = "they are refused in a run", "they are repaired where that is possible"
    for found, problem, remedy in (
        (names[~finite].tolist(), "with coordinates that are no finite numbers", refused),
        (names[invalid].tolist(), "that cross themselves or are invalid otherwise", repaired),
        (names[flat].tolist(), "without area", refused),
        (_repeated(polygons, names, usable), "that repeat another", refused),
    ):
        if found:
            seen.say(Level.WARNING, asset.href, f"outlines {problem}: {len(found)} ({listing(found)})", remedy)


def _repeated(polygons: np.ndarray, names: np.ndarray, usable: np.ndarray) -> list[str]:
    known: set[bytes] = set()
    twice = []
    for i in np.flatnonzero(usable).tolist():
        key = shapely.to_wkb(shapely.normalize(polygons[i]))
        if key in known:
            twice.append(str(names[i]))
        known.add(key)
    return twice
