"""A survey of LiDAR files."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import shapely

from cityflow.core.grid import Bounds, Tile, bounds_meet, tiles_over
from cityflow.core.points import BUILDING, GROUND
from cityflow.io.catalog.stac_assets import LidarAsset
from cityflow.survey.surface_source import LIDAR, ZARR
from cityflow.survey.survey_parameters import SurveyParameters


class LidarSurvey:
    """Files by name, and where they lie."""

    kind, zarr, indexed_by, factor = LIDAR, ZARR, "ingest", 1

    def __init__(self, assets: Iterable[LidarAsset], parameters: SurveyParameters) -> None:
        self.files = {f.name: f for f in sorted(assets, key=lambda f: f.name)}
        self.cell_m = parameters.surface.cell_m
        self._tile_m, self._halo_m = parameters.tiles.tile_m, parameters.surface.halo_m
        self._boxes = shapely.STRtree([shapely.box(*f.bounds) for f in self.files.values()])

    @cached_property
    def tiles(self) -> dict[str, Tile]:
        """Ground tiles that meet a file, south-west first."""
        found = {t for f in self.files.values() for t in tiles_over(f.bounds, self._tile_m)}
        return {t.name: t for t in sorted(found, key=lambda t: (t.row, t.col))}

    def assets_over(self, bounds: Bounds | None = None) -> list[LidarAsset]:
        """Files whose extents meet `bounds`, by name; all without them."""
        assets = list(self.files.values())
        if bounds is None:
            return assets
        near = sorted(self._boxes.query(shapely.box(*bounds)).tolist())
        return [assets[i] for i in near if bounds_meet(assets[i].bounds, bounds)]

    def assets_near(self, tile: Tile) -> list[LidarAsset]:
        """Files that hold points of the tile or of its halo."""
        return self.assets_over(tile.buffered(self._halo_m))

    @property
    def has_ground_class(self) -> bool:
        """Whether the survey tells ground from the rest, as its catalog says."""
        return any(GROUND in f.classes for f in self.files.values())

    @property
    def has_building_class(self) -> bool:
        """Whether the survey tells buildings from the rest: a matter of the survey, not of a tile or a single house."""
        return any(BUILDING in f.classes for f in self.files.values())
