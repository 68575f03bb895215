"""Edits without effect, with their causes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Status
from cityflow.core.edits import Edits
from cityflow.core.grid import grown, tiles_over
from cityflow.handover.outline_lines import decode
from cityflow.handover.refused_outlines import refused_shapes
from cityflow.io.tables.edits_gpkg import CUT_LINES, LOCKED, NO_CUT_LINES, OUTLINES, REJECTED, ROOF_TYPES
from cityflow.outlines.given import edited
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import ingest, outline, units
from cityflow.survey.city import OUTLINES as GIVEN_OUTLINES
from cityflow.survey.survey import Survey
from cityflow.viewer.report_rows import EditRow

NEAR_M = 10.0
"""A unit this near to an edit is named: it may be the one that was meant."""

INTO_A_UNIT = "move the point into the unit, or let the polygon cover half of it or more"
REMEDIES = {
    ROOF_TYPES: INTO_A_UNIT,
    REJECTED: "move the point into a found or given outline, or let the polygon cover half of it or more; a drawn one is deleted from the edits",
    CUT_LINES: "draw it across an outline, from border to border",
    NO_CUT_LINES: "draw it along a cut line of products/outlines.gpkg",
    OUTLINES: "draw it inside the surveyed area",
    LOCKED: "draw it inside the surveyed area",
}


@dataclass(frozen=True, slots=True)
class _Drawn:
    """One edit: its layer, what its row says beside the geometry."""

    layer: str
    name: str
    shape: BaseGeometry


def unused_edits(run: Prepared, records: CurrentRecords) -> tuple[EditRow, ...]:
    """Edits that touch nothing, in the order of the layers; those where outlines are not known yet, or outside the area, are left out."""
    survey = run.source().survey
    if not len(survey.edits):
        return ()
    found = _Found(run, survey, records, [d.shape for d in _drawn(survey.edits)])
    rows = (_judged(drawn, found) for drawn in _drawn(survey.edits) if found.knows(drawn.shape))
    return tuple(row for row in rows if row is not None)


def _drawn(edits: Edits) -> Iterator[_Drawn]:
    yield from (_Drawn(LOCKED if o.locked else OUTLINES, o.id, o.polygon) for o in edits.outlines)
    yield from (_Drawn(CUT_LINES, "", g) for g in edits.cut_lines)
    yield from (_Drawn(NO_CUT_LINES, "", g) for g in edits.no_cut_lines)
    yield from (_Drawn(ROOF_TYPES, r.roof_type, r.place) for r in edits.roof_types)
    yield from (_Drawn(REJECTED, "", g) for g in edits.rejected)


def _judged(drawn: _Drawn, found: _Found) -> EditRow | None:
    """Why an edit has no effect; None where it has one."""
    never = found.survey.parameters.split.when == "never"
    if drawn.layer in (CUT_LINES, NO_CUT_LINES) and never:
        return _row(drawn, "outlines are not split", "set split.when to found or always")
    if found.acts(drawn):
        return None
    return _row(drawn, found.reason(drawn), REMEDIES[drawn.layer])


def _row(drawn: _Drawn, reason: str, remedy: str) -> EditRow:
    place = drawn.shape.representative_point()
    return EditRow(drawn.layer, drawn.name, (round(place.x, 2), round(place.y, 2)), reason, remedy)


class _Found:
    """What a run has found where somebody has drawn something."""

    def __init__(self, run: Prepared, survey: Survey, records: CurrentRecords, places: Sequence[BaseGeometry]) -> None:
        self.survey = survey
        self._run = run
        self._records = records
        self._places = shapely.STRtree(list(places))

    @cached_property
    def _of_tiles(self) -> dict[str, Any]:
        """The records that name units, by tile, of those tasks that gave a result."""
        every = self._records.of(units.NAME if self.survey.splits else outline.NAME)
        return {r.unit: r for r in every if r.status in (Status.DONE, Status.DEGRADED)}

    @cached_property
    def units(self) -> dict[str, Polygon]:
        """Id → polygon, of units near an edit."""
        lines: dict[str, list[tuple[int, int]]] = defaultdict(list)
        for record in self._of_tiles.values():
            for entry in record.result.get("units", []):
                if len(self._places.query(shapely.box(*grown(tuple(entry["bounds"]), NEAR_M)))):
                    lines[entry["path"]].append((entry["start"], entry["length"]))
        texts = self._run.store.read_many(sorted(lines))
        near = (decode(text[start : start + n]).outline for path, text in texts for start, n in lines[path])
        return {o.id: o.polygon for o in near}

    @cached_property
    def _refused(self) -> dict[str, tuple[str, BaseGeometry]]:
        """Id → reason and shape."""
        given = [r for r in self._records.of(ingest.NAME) if r.unit == GIVEN_OUTLINES]
        records = [*given, *self._records.of(outline.NAME), *self._records.of(units.NAME)]
        why = {str(u): str(reason) for r in records for u, reason in r.result.get("refused", [])}
        shapes = refused_shapes(self._run.store, records)
        return {u: (reason, shapes[u]) for u, reason in why.items() if u in shapes}

    def knows(self, place: BaseGeometry) -> bool:
        """Whether all outlines that a place may touch are known, and the place is in the area asked for."""
        over = [t.name for t in tiles_over(place.bounds, self.survey.parameters.tiles.tile_m)]
        tiles = [
            t
            for t in over
            if t in self.survey.lattice.tiles and self._run.area.meets(self.survey.lattice.tiles[t].bounds)
        ]
        if not tiles:
            return self._run.area.is_everywhere
        return all(t in self._of_tiles for name in tiles for t in self.survey.lattice.ring(name))

    def acts(self, drawn: _Drawn) -> bool:
        if drawn.layer == REJECTED:
            rejected = (s for why, s in self._refused.values() if why == edited.REJECTED)
            return any(shapely.intersects(s, drawn.shape) for s in rejected)
        if drawn.layer == ROOF_TYPES:
            alone = Edits(roof_types=tuple(r for r in self.survey.edits.roof_types if r.place is drawn.shape))
            return any(alone.roof_type_of(p) for p in self.units.values())
        return any(shapely.intersects(p, drawn.shape) for p in self.units.values())

    def reason(self, drawn: _Drawn) -> str:
        shape = drawn.shape
        shares = [
            (shapely.intersection(p, shape).area / p.area, u) for u, p in self.units.items() if p.intersects(shape)
        ]
        if shares:
            share, unit = max(shares)
            drawn_too = f"stands in {unit}, which is drawn and not refused"
            return f"covers {100 * share:.0f} % of unit {unit}, less than half" if share else drawn_too
        for unit, (why, place) in sorted(self._refused.items()):
            if shapely.intersects(place, shape):
                return f"stands on outline {unit}, which is refused: {why}"
        if not self._is_surveyed(shape):
            return "stands outside the survey"
        gap, unit = min(((float(shapely.distance(p, shape)), u) for u, p in self.units.items()), default=(np.inf, ""))
        return "touches no building" + (f"; the nearest is {unit}, {gap:.1f} m away" if gap <= NEAR_M else "")

    def _is_surveyed(self, place: BaseGeometry) -> bool:
        return any(
            t.name in self.survey.lattice.tiles for t in tiles_over(place.bounds, self.survey.parameters.tiles.tile_m)
        )
