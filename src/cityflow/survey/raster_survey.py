"""A survey with a given DSM."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from cityflow.core.grid import Bounds, Tile, tiles_over
from cityflow.io.catalog.stac_assets import RasterAsset
from cityflow.surface.overview import overview_factor
from cityflow.survey.surface_source import OVERVIEW, RASTERS
from cityflow.survey.survey_parameters import SurveyParameters, nearest_cell


class RasterSurvey:
    """A given DSM, with its ortho and terrain where there are some."""

    kind, zarr, indexed_by = RASTERS, OVERVIEW, "surface"

    def __init__(self, rasters: Mapping[str, RasterAsset], parameters: SurveyParameters) -> None:
        self._rasters, self._parameters = rasters, parameters

    @cached_property
    def cell_m(self) -> float:
        """As the workflow says, else the usual cell nearest to the finest raster's."""
        cells = [r.cell for kind, r in self._rasters.items() if kind in ("dsm", "ortho")]
        return self._parameters.images.cell_m or nearest_cell(min(cells))

    @property
    def factor(self) -> int:
        return overview_factor(self.cell_m)

    @cached_property
    def tiles(self) -> dict[str, Tile]:
        """Ground tiles that meet the DSM, south-west first."""
        found = set(tiles_over(self._rasters["dsm"].bounds, self._parameters.tiles.tile_m))
        return {t.name: t for t in sorted(found, key=lambda t: (t.row, t.col))}

    def assets_over(self, _bounds: Bounds | None = None) -> list[RasterAsset]:
        """The DSM."""
        return [self._rasters["dsm"]]
