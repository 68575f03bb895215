"""State of a run in the driver: catalog, parameters, surface source, lattice, results so far. Names and digests, no data."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TypeVar

from cityflow.core.building import OUTLINE_SIGMA_M
from cityflow.core.edits import Edits
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters, merged
from cityflow.flow.stage import Node
from cityflow.flow.task import Json, Limits, Record
from cityflow.handover.layer_files import GivenOrtho
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.handover.surfaces import Surfaces
from cityflow.io.catalog.stac_assets import Catalog, RasterAsset
from cityflow.io.tables.edits_gpkg import read_edits
from cityflow.outlines.from_walls.wall_lines import WallLineParameters
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.reconstruction.model import ModelParameters
from cityflow.survey.given_outlines import GivenOutlines
from cityflow.survey.image_survey import ImageSurvey
from cityflow.survey.kept_plans import Plans
from cityflow.survey.lidar_survey import LidarSurvey
from cityflow.survey.match_units import MatchUnits
from cityflow.survey.point_files import PointIndex
from cityflow.survey.raster_survey import RasterSurvey
from cityflow.survey.results import Results
from cityflow.survey.surface_source import IMAGES, LIDAR, RASTERS, Source
from cityflow.survey.survey_parameters import OutlineParameters, SurveyParameters, WallParameters
from cityflow.survey.tile_lattice import Lattice
from cityflow.texture.unit import TextureParameters

M = TypeVar("M", bound=Parameters)

UNREAD = "without the points of {}, which could not be read"
WALL_MARGIN_M = 1.0
"""Files this near to an outline are named as the sources of its unit."""


_LAST: list[tuple[Catalog, SurveyParameters, Plans | None, ImageSurvey]] = []
"""The images that were asked for last."""


def images_of(catalog: Catalog, parameters: SurveyParameters, plans: Plans | None) -> ImageSurvey:
    """The images of a catalog; for the same catalog and parameters again the same object, since all that it knows follows from these.

    A command makes several surveys of one catalog, and the images of a large city take a second each time.
    """
    for of, asked, kept, found in _LAST:
        if of is catalog and asked is parameters and kept == plans:
            return found
    _LAST[:] = [(catalog, parameters, plans, ImageSurvey(catalog, parameters, plans))]
    return _LAST[0][-1]


class Survey:
    """Catalog, parameters and the records so far, with the questions that tasks are built from.

    Attributes
    ----------
    lidar : files, none where the surface has another source;  images : all that the catalog has, for textures at least
    matches : which task matches what of the images
    source : of the surface;  lattice : how the world is cut
    results, given, index : what tasks have left: records, given outlines, points of buildings
    """

    def __init__(
        self, catalog: Catalog, parameters: SurveyParameters, overrides: Mapping[Node, Mapping[str, Json]], plans: Plans | None = None
    ) -> None:  # fmt: skip
        self.catalog, self.parameters, self.overrides = catalog, parameters, overrides
        kind = source_kind_of(catalog, parameters.points.source)
        self.lidar = LidarSurvey(catalog.lidar if kind == LIDAR else (), parameters)
        self.images = images_of(catalog, parameters, plans)
        self.matches = MatchUnits(self.images)
        others: dict[str, Source] = {LIDAR: self.lidar, IMAGES: self.images}
        self.source = others.get(kind) or RasterSurvey(catalog.rasters, parameters)
        self.lattice = Lattice(self.source, parameters.tiles.tile_m, catalog.reference.code)
        self.results, self.given = Results(), GivenOutlines()
        self._model: ModelParameters | None = None
        self._limits: dict[str, Limits] = {}
        self.index = PointIndex(self.source, parameters.tiles, self.results)

    def learn(self, record: Record) -> None:
        """Keep what later tasks ask of a record."""
        for knows in (self.results, self.given, self.index):
            knows.learn(record)

    @property
    def outlines_given(self) -> bool:
        return outlines_are_given(self.catalog, self.parameters)

    @property
    def splits(self) -> bool:
        """Whether outlines are split into units: those that a cadastre gives are units already."""
        drawn = bool(self.edits.cut_lines) and self.parameters.split.when != "never"
        return self.looks_for_borders or drawn

    @property
    def looks_for_borders(self) -> bool:
        """Whether borders of units are looked for, and not only taken from what a person drew."""
        when = self.parameters.split.when
        return when == "always" or (when == "found" and not self.outlines_given)

    @property
    def sees_walls(self) -> bool:
        """Whether façades take part in finding outlines."""
        return self.source.kind == IMAGES and not self.outlines_given

    @property
    def sees_facades(self) -> bool:
        """Whether points on façades may tell where walls stand: those of images, or a laser's echoes."""
        return self.source.kind in (LIDAR, IMAGES)

    @property
    def reads_own_orthos(self) -> bool:
        """Whether orthos are made from the survey's images; else those that the catalog names are looked at."""
        return self.source.kind == IMAGES

    def given_orthos(self) -> dict[str, RasterAsset]:
        """Orthos that the catalog names, one for each epoch, by kind."""
        if self.reads_own_orthos:
            return {}
        return {k: r for k, r in sorted(self.catalog.rasters.items()) if k.startswith("ortho")}

    @cached_property
    def ortho_inputs(self) -> tuple[GivenOrtho, ...]:
        """The same as a task is given them."""
        return tuple(GivenOrtho(kind, r.href, r.cell) for kind, r in self.given_orthos().items())

    @cached_property
    def surfaces(self) -> Surfaces:
        """Where the rasters of the run stand, as a task is given it."""
        return Surfaces(self.lattice.grid, self.source.zarr, self.lattice.product_grid)

    @cached_property
    def outline_parameters(self) -> OutlineParameters:
        """Those of the workflow; lines of walls, too, go by the survey's own ground sampling distance unless the workflow states one."""
        asked = self.parameters.outline
        if states_gsd(asked.found.walls) or self.source.kind != IMAGES:
            return asked
        lines = asked.found.walls.model_copy(update={"gsd_m": self.images.cell_m})
        return asked.model_copy(update={"found": asked.found.model_copy(update={"walls": lines})})

    @cached_property
    def wall_parameters(self) -> WallParameters:
        """Those of the workflow, with the survey's own ground sampling distance unless the workflow states one."""
        asked = self.parameters.walls
        return asked if states_gsd(asked) else asked.model_copy(update={"gsd_m": self.images.cell_m})

    @cached_property
    def edits(self) -> Edits:
        """What a person has drawn; nothing where no file is named. Raises CatalogError where it cannot be read."""
        path = self.parameters.edits.path
        return read_edits(path, self.catalog.reference) if path else Edits()

    @property
    def ortho_kind(self) -> tuple[int, str]:
        """Bands and dtype of the ortho."""
        return (self.images.bands, self.images.dtype) if self.source.kind == IMAGES else (3, "uint8")

    @property
    def textures(self) -> bool:
        """Whether faces get textures: where the catalog has images or orthos to take them from."""
        return self.parameters.texture.when != "never" and bool(self.images.assets or self.given_orthos())

    @property
    def outline_sigma_m(self) -> float:
        """How exact given outlines are (standard deviation): as the workflow says, else by the survey's own buildings, else as outlines are in general."""
        stated = self.parameters.reconstruct.overhangs.outline_sigma_m
        own = OUTLINE_SIGMA_M if self.given.sigma_m is None else self.given.sigma_m
        return own if stated is None else stated

    @property
    def model_parameters(self) -> ModelParameters:
        """Those of the workflow for reconstruction, with how exact the survey's outlines are where it does not say; one object for all units."""
        if self._model is None or self._model.overhangs.outline_sigma_m != self.outline_sigma_m:
            self._model = self.parameters.reconstruct.of_outlines(self.outline_sigma_m)
        return self._model

    @cached_property
    def fitting_textures(self) -> TextureParameters:
        """Those of the workflow, one object for nearly all units."""
        return self.fitted(self.parameters.texture)

    def fitted(self, asked: TextureParameters) -> TextureParameters:
        """The same, with patches that are never larger than a page of the atlas."""
        page_px = min(asked.placement.page_px, self.parameters.atlas.placement.page_px)
        if asked.patches.largest_px <= page_px:
            return asked
        return asked.model_copy(update={"patches": asked.patches.model_copy(update={"largest_px": page_px})})

    def unread(self, bounds: Bounds) -> dict[str, str]:
        """Name → why: the files that should hold points within `bounds` but could not be read."""
        found: dict[str, str] = {}
        if not self.lidar.files:
            return found
        for asset in self.lidar.assets_over(bounds):
            if self.results.has_failed("ingest", asset.name):
                found[asset.name] = self.results.reason_of("ingest", asset.name)
        return found

    def unit_files(self, tile: str) -> dict[str, str]:
        """Path → digest of the file that holds the units of a tile: its outlines where nothing is split."""
        return self.results.outlines_of("units" if self.splits else "outline", tile)

    def parameters_of(self, stage: str, unit: str, model: M) -> M:
        """The stage's parameters with the unit's overrides laid over them."""
        over = self.overrides.get((stage, unit))
        return type(model).model_validate(merged(model.model_dump(mode="json"), over)) if over else model

    @property
    def date(self) -> str:
        """Of the newest survey, YYYY-MM-DD; empty where none is known."""
        return self._date_over(None)

    def _date_over(self, bounds: Bounds | None) -> str:
        return max(self._dates_over(bounds), default="")

    def _dates_over(self, bounds: Bounds | None) -> frozenset[str]:
        """Days on which data within `bounds` was taken; where the source does not tell by place, those of the whole survey."""
        over = None if self.source.kind == IMAGES else bounds
        return self._all_dates if over is None else frozenset(a.date for a in self.source.assets_over(over) if a.date)

    @cached_property
    def _all_dates(self) -> frozenset[str]:
        return frozenset(a.date for a in self.source.assets_over() if a.date)

    def product_metadata(self, bounds: Bounds | None = None) -> ProductMetadata:
        """What products say of the survey, as a whole or over a tile; part of the digest of whatever writes it."""
        c = self.catalog
        return ProductMetadata(c.reference.code, c.title, self._date_over(bounds), c.licence, c.attribution)

    def source_attributes(self, bounds: Bounds) -> dict[str, str | None]:
        """What is known of the data that a unit was made from."""
        return {"source": self.catalog.title, "source_date": self._date_over(bounds) or None}

    def limits(self, stage: str) -> Limits:
        if stage not in self._limits:
            self._limits[stage] = self.parameters.execution.limits_of(stage)
        return self._limits[stage]


def source_kind_of(catalog: Catalog, asked: str) -> str:
    """What the surface is made from: as the workflow says, else the first of LiDAR, images and rasters that the catalog has."""
    if asked != "auto":
        return asked
    if catalog.lidar:
        return LIDAR
    return IMAGES if catalog.images or "dsm" not in catalog.rasters else RASTERS


def states_gsd(parameters: WallPointParameters | WallLineParameters) -> bool:
    """Whether a workflow states a sampling distance: the default stands for the survey's own, also where a run's description lists all defaults."""
    return bool(parameters.gsd_m != type(parameters).model_fields["gsd_m"].default)


def outlines_are_given(catalog: Catalog, parameters: SurveyParameters) -> bool:
    """Whether outlines come from a file, and are not found in the surface."""
    source = parameters.outline.source
    return source == "given" or (source == "auto" and catalog.outlines is not None)
