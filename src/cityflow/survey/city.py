"""State of a city in the driver: survey, area of interest, outlines and units of the records so far."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property

from cityflow.core.building import Status
from cityflow.errors import CatalogError
from cityflow.flow.stage import Node
from cityflow.flow.task import Json, Record
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.survey.area import EVERYWHERE, Area
from cityflow.survey.districts import Districts, districts_of
from cityflow.survey.kept_plans import Plans
from cityflow.survey.results import RECONSTRUCT
from cityflow.survey.surface_source import IMAGES, RASTERS
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import SurveyParameters
from cityflow.survey.tiles_in_use import TilesInUse
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_index import UnitIndex

INGEST, DETECT, OUTLINE, SPLIT, UNITS, EXPORT = "ingest", "detect", "outline", "split", "units", "export"
OUTLINES = "outlines"
"""Unit of the stage ``ingest`` that reads given outlines."""


class City:
    """Names and digests, no data: the context of the stages.

    Parameters
    ----------
    catalog, parameters : what there is, and what is asked for
    area : only these units, and what they need
    overrides : (stage, unit) → tree of values laid over the stage's parameters
    plans : where flight plans are kept
    until_export : stages whose results of a unit no task asks for after the export of its tile

    Attributes
    ----------
    units : id → entry of every unit that is known, and may be asked for;  units_of : tile → those that it owns;  chosen : tile → ids of those within the area
    outlines, outlines_of : the same of outlines that are split, until the units of their tile and of all around are known
    count_outlines : tile → how many it owns that are split
    atlas_cells_of : tile → atlas cell → its units, if requested
    refused : outlines that cannot be buildings, or that a person has rejected, with the reason
    past : stage and units whose tasks nobody waits for any more, for whoever drives the city (`forget_by`)
    """

    def __init__(
        self,
        catalog: Catalog,
        parameters: SurveyParameters,
        area: Area = EVERYWHERE,
        overrides: Mapping[Node, Mapping[str, Json]] | None = None,
        plans: Plans | None = None,
        until_export: Sequence[str] = (),
    ) -> None:
        self.survey = Survey(catalog, parameters, overrides or {}, plans)
        self.area = area
        self._until_export = until_export
        self.units: dict[str, UnitEntry] = {}
        self.units_of: dict[str, UnitIndex] = {}
        self.chosen: dict[str, list[str]] = {}
        self.outlines: dict[str, UnitEntry] = {}
        self.outlines_of: dict[str, list[str]] = {}
        self.count_outlines: dict[str, int] = {}
        self._without_units: dict[str, set[str]] = {}
        self.refused: dict[str, str] = {}
        self.atlas_cells_of: dict[str, Mapping[str, list[str]]] = {}
        self.past: list[tuple[str, Sequence[str]]] = []
        self._former: Callable[[str, str], Record | None] | None = None
        self._reach_m = 0.0
        self._in_use, self._forgotten = TilesInUse(), set[str]()

    @cached_property
    def tiles(self) -> tuple[str, ...]:
        """Names of the ground tiles that meet the area, south-west first."""
        return tuple(name for name, tile in self.survey.lattice.tiles.items() if self.area.meets(tile.bounds))

    def refuse_nothing(self) -> None:
        """Raise CatalogError where there is nothing to make a city of."""
        survey = self.survey
        if not _has_something(survey):
            remedy = "make it again with --lidar, --images or --dsm, or set points.source to what it has"
            raise CatalogError("the catalog has no surface source", where=survey.catalog.href, remedy=remedy)
        if not self.tiles:
            remedy = "see `cityflow catalog check` for the extent"
            raise CatalogError("no ground tile meets the area of interest", where="--aoi", remedy=remedy)

    def learn(self, record: Record) -> None:
        """Keep what later tasks ask of a record."""
        self.survey.learn(record)
        self.refused.update(self.refused_by((record.stage, record.unit)))
        if record.stage == OUTLINE and self.survey.splits:
            found = self._entries(record)
            self.outlines.update({o.id: o for o in found})
            self.outlines_of[record.unit] = [o.id for o in found]
            self.count_outlines[record.unit] = len(found)
            self._without_units[record.unit] = self._tiles_touching(record.unit, found) - self.units_of.keys()
        elif record.stage == self.unit_stage:
            found = self._entries(record)
            self.units.update({u.id: u for u in found})
            self.units_of[record.unit] = UnitIndex(found)
            self.atlas_cells_of.pop(record.unit, None)
            self.chosen[record.unit] = [u.id for u in found if self.area.holds(u.point)]
            self._forgotten.discard(record.unit)
            if self._former is not None:
                near = self.survey.lattice.near(record.unit, self._reach_m)
                self._in_use.begin(record.unit, (t for t in near if t in self.tile_names))
            if record.stage == UNITS:
                self._forget_outlines(record.unit, found)
        elif record.stage == EXPORT:
            for stage in self._until_export:
                self._end(stage, self.chosen.get(record.unit, ()))
            for tile in self._in_use.end(record.unit):
                self._forget_units(tile)

    def forget_by(self, former: Callable[[str, str], Record | None], reach_m: float) -> None:
        """From now on units are forgotten when all tiles within `reach_m` have been exported: the memory of a driver does not grow by what is behind it.

        Parameters
        ----------
        former : the newest record of a stage and a unit, for tasks that ask from farther away
        """
        self._former, self._reach_m = former, reach_m

    def ask(self, tiles: Iterable[str], asking: str) -> None:
        """A tile will ask for units of others, and for their models, until it is exported: those that were forgotten are known again."""
        if self._former is None:
            return
        for tile in tiles:
            self._in_use.begin(tile, [asking])
            if tile in self._forgotten:
                self._forgotten.discard(tile)
                self._recall(tile, self._former)

    def _recall(self, tile: str, former: Callable[[str, str], Record | None]) -> None:
        record = former(self.unit_stage, tile)
        for unit in [] if record is None else self._entries(record):
            self.units[unit.id] = unit
            if (model := former(RECONSTRUCT, unit.id)) is not None:
                self.survey.results.learn(model)

    def _forget_units(self, tile: str) -> None:
        if (known := self.units_of.get(tile)) is None:
            return  # asked for, and not come to yet
        names = known.names
        for name in names:
            self.units.pop(name, None)
        self.survey.results.forget(RECONSTRUCT, names)
        self._forgotten.add(tile)

    def _end(self, stage: str, units: Sequence[str]) -> None:
        """Nobody asks for what tasks have left any more."""
        self.survey.results.forget(stage, units)
        if self._former is not None:
            self.past.append((stage, units))

    def _tiles_touching(self, tile: str, entries: Iterable[UnitEntry]) -> set[str]:
        """The tile, those around it, and those that own what touches its outlines."""
        return {*self.survey.lattice.ring(tile), *(t for e in entries for t in e.neighbour_tiles)}

    def _forget_outlines(self, tile: str, found: Iterable[UnitEntry]) -> None:
        """Outlines, and how they were split, are asked for by the units of their tile and of those that touch it."""
        for name in self._tiles_touching(tile, found):
            left = self._without_units.get(name)
            if left is None:
                continue
            left.discard(tile)
            if not left:
                del self._without_units[name]
                outlines = self.outlines_of.pop(name)
                self._end(SPLIT, outlines)
                for outline in outlines:
                    self.outlines.pop(outline, None)

    @staticmethod
    def _entries(record: Record) -> list[UnitEntry]:
        return [UnitEntry.of(record.unit, entry) for entry in record.result.get("units", [])]

    @property
    def unit_stage(self) -> str:
        """The stage whose records name the units."""
        return UNITS if self.survey.splits else OUTLINE

    def names_units(self, node: Node) -> bool:
        """Whether its record has named the units of one of the tiles to export."""
        return node[0] == self.unit_stage and node[1] in self.tile_names

    @cached_property
    def tile_names(self) -> frozenset[str]:
        """The same as `tiles`."""
        return frozenset(self.tiles)

    def tiles_at(self, turn: Node) -> list[str]:
        """The tile whose turn it is to begin, if it is one's."""
        return [turn[1]] if not turn[0] and turn[1] in self.tile_names else []

    def exports(self, name: str) -> bool:
        """Whether a tile is exported; true of what is no tile (a district, the city)."""
        return name in self.tile_names or name not in self.survey.lattice.tiles

    @cached_property
    def districts(self) -> Districts:
        """How the exports of the tiles are merged."""
        return districts_of(self.survey.lattice.tiles.values(), self.tile_names)

    def refused_by(self, node: Node) -> dict[str, str]:
        """Outlines that a task has refused, with the reason: no polygons, where nothing was surveyed, or rejected by a person.

        They belong to no tile, so that an area of interest leaves them out.
        """
        if not self.area.is_everywhere or (node[0] not in (OUTLINE, UNITS) and node != (INGEST, OUTLINES)):
            return {}
        return self.survey.results.refused_by(node)

    def count_units(self) -> int | None:
        """Units of the area: from the records, once they name all, else from the number of given outlines; None if unknown yet."""
        if all(t in self.units_of for t in self.tiles):
            return sum(len(self.chosen[t]) for t in self.tiles)
        survey = self.survey
        given = survey.catalog.outlines if survey.outlines_given and self.area.is_everywhere else None
        return given.count if given is not None and not survey.splits else None

    def ring_of(self, tiles: Iterable[str]) -> list[str]:
        """The tiles and all that touch them."""
        return list(dict.fromkeys(t for name in tiles for t in self.survey.lattice.ring(name)))


def outlines_are_missing(record: Record) -> bool:
    """Given outlines could not be read: nobody knows what to export, and what an earlier run left stays."""
    return (record.stage, record.unit) == (INGEST, OUTLINES) and record.status is Status.FAILED


def _has_something(survey: Survey) -> bool:
    """Whether the catalog has what the surface shall be made of."""
    if survey.source.kind == RASTERS:
        return "dsm" in survey.catalog.rasters
    return bool(survey.images.assets if survey.source.kind == IMAGES else survey.lidar.files)
