"""Buildings of a large city for the report: figures from the summaries of exports, and rows of those that a person shall see."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field
from heapq import nlargest
from typing import Any, Self

from cityflow.core.building import Status
from cityflow.flow.row import Row
from cityflow.handover.export_rows import ROWS, read_rows
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.unit_counts import counts_of
from cityflow.reporting.summed_city import SummedCity
from cityflow.reporting.unit_rows import ReportedCity, rings_of, unit_row
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import export, outline, reconstruct, units
from cityflow.survey.survey import Survey
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.viewer.report_rows import ProblemRow, UnitRow
from cityflow.viewer.unit_figures import UnitFigures

SURFACE = "surface "
"""Begins the names of a reconstruction's inputs that are surfaces of tiles."""
SLOWEST = 64
"""Held while rows are gone through."""


def listed_city(run: Prepared, records: CurrentRecords, survey: Survey, summed: SummedCity) -> ReportedCity:
    """Rows of the worst, the slowest and those that did not end as asked, and figures of all."""
    summary, places = summed.whole, _Places.of(run, records, survey)
    ended = _Ended.of(row for row in records.rows(reconstruct.NAME) if row.unit not in places.beyond)
    listed = [row.unit for row in ended.listed(run.workflow.city.report)]
    worst = summary.worst if summary is not None else ()
    tiles = {w.tile for w in worst} | _tiles_under(records, listed)
    wanted = {w.id for w in worst} | set(listed)
    counts = summary.counts if summary is not None else counts_of([])
    ring = survey.lattice.ring(dense) if (dense := summed.densest(run, records)) in survey.lattice.tiles else ()
    return ReportedCity(
        tuple(rows_of_units(run, records, _owned(records, tiles, wanted))),
        tuple(rows_of_units(run, records, _owned(records, ring, None, places.beyond))),
        dict.fromkeys(places.waiting, ()),
        UnitFigures.of_counts(counts, ended.seconds, ended.peak_mb),
        tuple(ProblemRow(r.stage, r.unit, r.status, r.reason) for r in sorted(ended.others, key=lambda r: r.unit)),
    )


def _tiles_under(records: CurrentRecords, units: Iterable[str]) -> set[str]:
    """Tiles whose surface some units were made from: each is owned by one of its own."""
    names = (name for r in records.some(reconstruct.NAME, units) for name in r.inputs if name.startswith(SURFACE))
    return {name.removeprefix(SURFACE) for name in names}


def _owned(
    records: CurrentRecords, tiles: Iterable[str], wanted: set[str] | None, beyond: Set[str] = frozenset()
) -> dict[str, set[str]]:
    """Tile → those of its units that are wanted, or all, without those beyond the area."""
    owned = {t: {e["id"] for e in entries} - beyond for t, entries in entries_of(records, tiles)}
    found = {t: ids if wanted is None else ids & wanted for t, ids in owned.items()}
    return {t: ids for t, ids in found.items() if ids}


def problems_of(records: CurrentRecords, stage: str) -> Iterator[ProblemRow]:
    """Tasks of a stage that did not end as asked; no other record is read."""
    others = (row.unit for row in records.tally(stage).others)
    return (ProblemRow(r.stage, r.unit, r.status, r.reason) for r in records.some(stage, others))


@dataclass(slots=True)
class _Ended:
    """How reconstructions ended: seconds of all, the slowest first, those that are not done."""

    seconds: list[float] = field(default_factory=list)
    others: list[Row] = field(default_factory=list)
    slowest: list[Row] = field(default_factory=list)
    peak_mb: float | None = None

    @classmethod
    def of(cls, rows: Iterable[Row]) -> _Ended:
        found = cls()
        for row in rows:
            found.seconds.append(row.seconds)
            found.peak_mb = max(row.peak_mb, found.peak_mb or 0.0)
            found.slowest.append(row)
            if len(found.slowest) == 2 * SLOWEST:
                found.slowest = found._first()
            if row.status is not Status.DONE:
                found.others.append(row)
        found.slowest = found._first()
        return found

    def _first(self) -> list[Row]:
        return nlargest(SLOWEST, self.slowest, key=lambda row: (row.seconds, row.unit))

    def listed(self, parameters: ReportParameters) -> list[Row]:
        """The slowest, and of each kind of failure as many as have pages."""
        pages, ordered = parameters.pages, sorted(self.others, key=lambda row: row.unit)
        most = {Status.FAILED: pages.failed, Status.REFUSED: pages.refused, Status.DEGRADED: pages.degraded}
        bad = [row for status, count in most.items() for row in [r for r in ordered if r.status is status][:count]]
        return self.slowest[: parameters.listed] + bad


@dataclass(frozen=True, slots=True)
class _Places:
    """Units that wait, and those that were not asked for. Both stand on tiles without an export, or across the edge of the area of interest."""

    waiting: list[str]
    beyond: frozenset[str]

    @classmethod
    def of(cls, run: Prepared, records: CurrentRecords, survey: Survey) -> Self:
        area, exported = run.area, frozenset(records.units(export.NAME))
        tiles = survey.lattice.tiles
        unsure = [t for t, tile in tiles.items() if t not in exported or not area.covers(tile.bounds)]
        found = [e for _, entries in entries_of(records, unsure) for e in entries]
        done = frozenset(records.units(reconstruct.NAME)) if found else frozenset()
        asked = {e["id"]: area.holds(tuple(e["point"])) for e in found}
        return cls(
            sorted(u for u, is_asked in asked.items() if is_asked and u not in done),
            frozenset(u for u, is_asked in asked.items() if not is_asked),
        )


def entries_of(records: CurrentRecords, tiles: Iterable[str]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Tile → what it owns, one after the other: units, or outlines where those have not been split yet."""
    split = frozenset(records.units(units.NAME))
    wanted = frozenset(tiles)
    for stage, names in ((units.NAME, wanted & split), (outline.NAME, wanted - split)):
        for record in records.some(stage, names):
            yield record.unit, record.result.get("units", [])


def rows_of_units(run: Prepared, records: CurrentRecords, wanted: Mapping[str, set[str]]) -> Iterator[UnitRow]:
    """Rows of some units; tile → its units."""
    entries = {e["id"]: e["path"] for _, found in entries_of(records, wanted) for e in found}
    exported = {r.unit: r for r in records.some(export.NAME, wanted)}
    for tile, ids in sorted(wanted.items()):
        standings = {
            s.outline.id: s
            for path in sorted({entries[u] for u in ids})
            for s in decode_all(run.store.read_bytes(path))
        }
        left = [p for p in exported[tile].outputs if p.endswith(f"/{ROWS}")] if tile in exported else []
        rows = read_rows(run.store, left)
        for record in records.some(reconstruct.NAME, ids):
            rings = rings_of(standings[record.unit].outline.polygon)
            yield unit_row(record, tile, rings, rows.get(record.unit, {}))
