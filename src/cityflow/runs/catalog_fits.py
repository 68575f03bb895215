"""Checks whether a workflow can use a catalog, and names one that can."""

from __future__ import annotations

from cityflow.errors import CatalogError
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.pipeline.workflow_parameters import CityParameters

SOURCES = {"lidar": "LiDAR files", "images": "oriented images", "rasters": "a DSM"}


def refuse_unfit(city: CityParameters, catalog: Catalog) -> None:
    """Make sure that the catalog has what the workflow takes its surface and its outlines from.

    Raises
    ------
    CatalogError
        It has not; the workflow for what it has is named.
    """
    has = {"lidar": bool(catalog.lidar), "images": bool(catalog.images), "rasters": "dsm" in catalog.rasters}
    wanted = city.points.source
    if not any(has.values()):
        problem = "the catalog has no surface source: no LiDAR, no images, no DSM"
        raise CatalogError(problem, where=catalog.href, remedy="make it again with --lidar, --images or --dsm")
    if wanted != "auto" and not has[wanted]:
        there = " and ".join(name for source, name in SOURCES.items() if has[source])
        raise CatalogError(
            f"this workflow makes its surface of {SOURCES[wanted]}, and the catalog has {there}",
            where=catalog.href,
            remedy=f"use {workflow_for(catalog)}, or --set points.source=auto",
        )
    if city.outline.source == "given" and catalog.outlines is None:
        raise CatalogError(
            "this workflow takes given outlines, and the catalog has none", where=catalog.href,
            remedy=f"make it again with --outlines, use {workflow_for(catalog)}, or --set outline.source=found",
        )  # fmt: skip


def workflow_for(catalog: Catalog) -> str:
    """The workflow, of those that ship, for what a catalog has."""
    of_lidar = "lidar_city" if catalog.outlines is not None else "lidar_city_no_outlines"
    return f"workflows/{of_lidar if catalog.lidar else 'oblique_city' if catalog.images else 'ortho_city'}.yaml"
