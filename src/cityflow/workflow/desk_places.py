"""What an edit made in the browser concerns: outlines of buildings, and the tasks that have to run again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import shapely
from shapely import Polygon

from cityflow.core.edits import REACH_M, SetRoofType
from cityflow.core.grid import bounds_meet, grown, tile_names_over
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.handover.outline_lines import OutlineAt, decode_all
from cityflow.io.tables.edits_gpkg import CUT_LINES, NO_CUT_LINES, ROOF_TYPES
from cityflow.io.tables.edits_written import Edit
from cityflow.reporting.tile_rows import NO_TILE
from cityflow.runs.prepare import Prepared
from cityflow.stages import outline, reconstruct, split, units
from cityflow.survey.survey import outlines_are_given

Json = Any


@dataclass(frozen=True, slots=True)
class Places:
    """Records of a run by place; the ledger is open as long as this is in use."""

    run: Prepared
    ledger: Ledger

    def polygon(self, unit: str, tile: str) -> Polygon:
        """Outline of a building, world metres. Raises RunError where it has none."""
        for stage in (units.NAME, outline.NAME) if tile != NO_TILE else ():
            for entry in self._entries(stage, [tile]):
                if entry["id"] == unit:
                    found = decode_all(self.run.store.read_bytes(entry["path"]))
                    return next(s.outline.polygon for s in found if s.outline.id == unit)
        raise RunError(f"{unit} has no outline", where=self.run.store.root, remedy="run the workflow again")

    def commands(self, edits: Sequence[Edit], chosen: Sequence[str], settings: Sequence[str]) -> list[list[str]]:
        """Options of `cityflow rerun` that carry out edits, and make chosen buildings again with settings.

        An outline that changes concerns its tile, and all tiles that it may reach into; digests tell what else has to run there. Buildings that an edit is
        of come before those that only stand so near that it might be.
        """
        tiles, cut, roofs = dict[str, None](), set[str](), dict[str, bool]()
        given = outlines_are_given(self.run.catalog, self.run.workflow.city)
        is_whole = given and self.run.workflow.city.split.when != "always"
        for edit in edits:
            over = self._tiles(edit)
            if edit.layer in (CUT_LINES, NO_CUT_LINES) and not is_whole:
                crossed = {e["id"] for e in self._entries(outline.NAME, over) if _meets(e, edit)}
                cut |= {o for o in crossed if self.ledger.has(split.NAME, o)}
            elif edit.layer == ROOF_TYPES:
                named = self._entries(units.NAME, over) or self._entries(outline.NAME, over)
                roof = SetRoofType(edit.shape, edit.value)
                for e in (e for e in named if roof.may_name(e["bounds"])):
                    roofs[e["id"]] = roofs.get(e["id"], False) or roof.names(self._shape(e))
            else:
                # the tiles that it stands in come first; given outlines are dealt out by chains of neighbours, which tell the others. Where they are not split
                # by themselves, the first border has them all looked at, and so has the last one that goes
                reach_m = REACH_M + (0.0 if given else outline.edits_reach_m(self.run.workflow.city))
                around = tile_names_over(grown(edit.shape.bounds, reach_m), self.run.workflow.city.tiles.tile_m)
                tiles |= dict.fromkeys(t for t in (*over, *around) if self.ledger.has(outline.NAME, t))
        first = sorted((u for u in roofs if self.ledger.has(reconstruct.NAME, u)), key=lambda u: (not roofs[u], u))
        asked = (
            (split.NAME, sorted(cut)),
            (reconstruct.NAME, [u for u in first if u not in chosen]),
            (outline.NAME, list(tiles)),
        )
        found = [_options(stage, names) for stage, names in asked if names]
        if chosen:
            found.append([*_options("", sorted(chosen)), *settings])
        return found

    def _shape(self, entry: Mapping[str, Json]) -> Polygon:
        at = OutlineAt(entry["path"], entry["start"], entry["length"])
        return at.read(self.run.store).polygon

    def _tiles(self, edit: Edit) -> list[str]:
        return tile_names_over(grown(edit.shape.bounds, REACH_M), self.run.workflow.city.tiles.tile_m)

    def _entries(self, stage: str, tiles: Iterable[str]) -> list[Mapping[str, Json]]:
        return [*self._read(stage, tiles)]

    def _read(self, stage: str, tiles: Iterable[str]) -> Iterator[Mapping[str, Json]]:
        # an outline at the edge may belong to a tile beside
        around = {
            f"{c + i}_{r + k}"
            for t in tiles
            for c, r in [map(int, t.split("_"))]
            for i in (-1, 0, 1)
            for k in (-1, 0, 1)
        }
        for tile in sorted(around):
            record = self.ledger.latest(stage, tile)
            yield from () if record is None else record.result.get("units", [])


def _meets(entry: Mapping[str, Json], edit: Edit) -> bool:
    x_min, y_min, x_max, y_max = entry["bounds"]
    return bounds_meet((x_min, y_min, x_max, y_max), grown(edit.shape.bounds, REACH_M))


def _options(stage: str, names: Iterable[str]) -> list[str]:
    """With the name behind its option: one may begin with a dash."""
    return [*([f"--stage={stage}"] if stage else []), *(f"--unit={name}" for name in names)]


def shape_of(layer: str, rings: Json) -> shapely.Geometry:
    """What was drawn: one place for a point, else rings of places; a line where the layer is one of lines. Raises ValueError, TypeError, ShapelyError."""
    if layer in (CUT_LINES, NO_CUT_LINES):
        return shapely.LineString(rings[0])
    if len(rings) == 1 and len(rings[0]) == 1:
        return shapely.Point(rings[0][0])
    return Polygon(rings[0], rings[1:])


def rings_of(shape: shapely.Geometry) -> list[list[list[float]]]:
    """Rings of a polygon, else all places in one list; world metres."""
    parts = shapely.get_rings(shape) if shape.geom_type == "Polygon" else [shape]
    return [shapely.get_coordinates(part).tolist() for part in parts]
