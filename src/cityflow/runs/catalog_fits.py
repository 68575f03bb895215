"""Checks whether a workflow can use a catalog, and names one that can. Nothing heavy is imported: commands look before they load the rest."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cityflow.errors import CatalogError

if TYPE_CHECKING:
    from cityflow.io.catalog.stac_assets import Catalog
    from cityflow.pipeline.workflow_parameters import CityParameters

SOURCES = {"lidar": "LiDAR files", "images": "oriented images", "rasters": "a DSM"}


@dataclass(frozen=True, slots=True)
class Holding:
    """What a catalog has.

    Attributes
    ----------
    href : of the catalog, for messages
    sources : those of `SOURCES` that it has, in their order
    """

    href: str
    sources: tuple[str, ...]
    has_outlines: bool

    @classmethod
    def of(cls, catalog: Catalog) -> Holding:
        has = {"lidar": bool(catalog.lidar), "images": bool(catalog.images), "rasters": "dsm" in catalog.rasters}
        return cls(catalog.href, tuple(s for s in SOURCES if has[s]), catalog.outlines is not None)

    @classmethod
    def of_kinds(cls, href: str, kinds: Collection[str]) -> Holding:
        """`kinds`: of its items."""
        has = {"lidar": "lidar" in kinds, "images": "image" in kinds, "rasters": "dsm" in kinds}
        return cls(href, tuple(s for s in SOURCES if has[s]), "outlines" in kinds)

    @property
    def workflow(self) -> str:
        """The workflow, of those that ship, for what it has."""
        of_lidar = "lidar_city" if self.has_outlines else "lidar_city_no_outlines"
        of_lidar = "lidar_photos_city" if "images" in self.sources else of_lidar
        other = "oblique_city" if "images" in self.sources else "ortho_city"
        return f"workflows/{of_lidar if 'lidar' in self.sources else other}.yaml"


def refuse_unfit(city: CityParameters, catalog: Catalog) -> None:
    """As `refuse_holding`."""
    refuse_holding(city.points.source, city.outline.source, Holding.of(catalog), city.texture.when)


def refuse_holding(source: str, outlines: str, held: Holding, textures: str = "auto") -> None:
    """Make sure that the catalog has what the workflow takes its surface and its outlines from.

    Parameters
    ----------
    source, outlines, textures : ``points.source``, ``outline.source`` and ``texture.when`` of the workflow

    Raises
    ------
    CatalogError
        It has not; the workflow for what it has is named.
    """
    if not held.sources:
        problem = "the catalog has no surface source: no LiDAR, no images, no DSM"
        raise CatalogError(problem, where=held.href, remedy="make it again with --lidar, --images or --dsm")
    if source != "auto" and source not in held.sources:
        there = " and ".join(SOURCES[s] for s in held.sources)
        raise CatalogError(
            f"this workflow makes its surface of {SOURCES[source]}, and the catalog has {there}",
            where=held.href,
            remedy=f"use {held.workflow}, or --set points.source=auto",
        )
    if textures == "photographs" and "images" not in held.sources:
        raise CatalogError(
            "this workflow takes textures from photographs, and the catalog has none",
            where=held.href,
            remedy=f"use {held.workflow}, or make it again with --images",
        )
    if outlines == "given" and not held.has_outlines:
        raise CatalogError(
            "this workflow takes given outlines, and the catalog has none", where=held.href,
            remedy=f"make it again with --outlines, use {held.workflow}, or --set outline.source=found",
        )  # fmt: skip
