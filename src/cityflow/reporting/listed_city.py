"""Buildings of a large city for the report: figures from the summaries of exports, and rows of those that a person shall see."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from heapq import nlargest
from typing import Any

from cityflow.core.building import Status
from cityflow.flow.row import Row
from cityflow.handover.export_rows import ROWS, read_rows
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.summary import SUMMARY, Summary, added, decode_summary, first_of
from cityflow.handover.unit_counts import counts_of
from cityflow.reporting.unit_rows import ReportedCity, rings_of, unit_row
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import export, outline, reconstruct, units
from cityflow.survey.districts import CITY
from cityflow.survey.survey import Survey
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.viewer.report_rows import ProblemRow, UnitRow
from cityflow.viewer.unit_figures import UnitFigures

SUMMED_AT_ONCE = 64
"""Summaries of tiles that are held where no merge has come yet."""


def listed_city(run: Prepared, records: CurrentRecords, survey: Survey) -> ReportedCity:
    """Rows of the worst, the slowest and those that did not end as asked, and figures of all."""
    summary = _summary(run, records)
    wanted = {one.id for one in summary.worst} if summary is not None else set()
    places = _Places.of(run, records, survey)
    ended = _Ended.of(row for row in records.rows(reconstruct.NAME) if row.unit not in places.beyond)
    wanted |= {row.unit for row in ended.listed(run.workflow.city.report)}
    counts = summary.counts if summary is not None else counts_of([])
    return ReportedCity(
        tuple(_rows(run, records, places.of_units(records, wanted))),
        tuple(_rows(run, records, places.densest(records, survey))),
        dict.fromkeys(places.waiting, ()),
        UnitFigures.of_counts(counts, ended.seconds, ended.peak_mb),
        tuple(ProblemRow(r.stage, r.unit, r.status, r.reason) for r in sorted(ended.others, key=lambda r: r.unit)),
    )


def problems_of(records: CurrentRecords, stage: str) -> Iterator[ProblemRow]:
    """Tasks of a stage that did not end as asked; no other record is read."""
    others = [row.unit for row in records.rows(stage) if row.status is not Status.DONE]
    return (ProblemRow(r.stage, r.unit, r.status, r.reason) for r in records.some(stage, others))


def _summary(run: Prepared, records: CurrentRecords) -> Summary | None:
    """Of the city; where its merge has not come yet, of the tiles that are exported."""
    found = list(_summaries(run, records, [CITY]))
    if found:
        return found[0]
    tiles: list[Summary] = []
    for one in _summaries(run, records, run.source().city.tiles):
        tiles.append(one)
        if len(tiles) == SUMMED_AT_ONCE:
            tiles = [_as_one(tiles)]
    return _as_one(tiles) if tiles else None


def _summaries(run: Prepared, records: CurrentRecords, names: Iterable[str]) -> Iterator[Summary]:
    for record in records.some(export.NAME, names):
        for path in (p for p in record.outputs if p.endswith(f"/{SUMMARY}")):
            yield decode_summary(run.store.read_bytes(path), path)


def _as_one(found: list[Summary]) -> Summary:
    worst = first_of(w for s in found for w in s.worst)
    first = found[0]
    return Summary(first.name, first.bounds, len(found), added(s.counts for s in found), None, {}, {}, worst)


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
            if len(found.slowest) == 2 * SUMMED_AT_ONCE:
                found.slowest = found._first()
            if row.status is not Status.DONE:
                found.others.append(row)
        found.slowest = found._first()
        return found

    def _first(self) -> list[Row]:
        return nlargest(SUMMED_AT_ONCE, self.slowest, key=lambda row: (row.seconds, row.unit))

    def listed(self, parameters: ReportParameters) -> list[Row]:
        """The slowest, and of each kind of failure as many as have pages."""
        pages, ordered = parameters.pages, sorted(self.others, key=lambda row: row.unit)
        most = {Status.FAILED: pages.failed, Status.REFUSED: pages.refused, Status.DEGRADED: pages.degraded}
        bad = [row for status, count in most.items() for row in [r for r in ordered if r.status is status][:count]]
        return self.slowest[: parameters.listed] + bad


@dataclass(frozen=True, slots=True)
class _Places:
    """What the records of tiles say of their units: how many each owns, which wait, which were not asked for."""

    counts: Mapping[str, int]
    waiting: list[str]
    beyond: frozenset[str]

    @classmethod
    def of(cls, run: Prepared, records: CurrentRecords, survey: Survey) -> _Places:
        done, area = frozenset(records.units(reconstruct.NAME)), run.area
        counts: dict[str, int] = {}
        waiting, beyond = [], []
        for tile, entries in _entries(records, survey.lattice.tiles):
            counts[tile] = len(entries)
            for entry in entries:
                if not area.holds(tuple(entry["point"])):
                    beyond.append(entry["id"])
                elif entry["id"] not in done:
                    waiting.append(entry["id"])
        return cls(counts, sorted(waiting), frozenset(beyond))

    def of_units(self, records: CurrentRecords, wanted: set[str]) -> dict[str, set[str]]:
        """Tile → those of its units that are wanted."""
        found = {t: {e["id"] for e in entries} & wanted for t, entries in _entries(records, self.counts)}
        return {tile: ids for tile, ids in found.items() if ids}

    def densest(self, records: CurrentRecords, survey: Survey) -> dict[str, set[str]]:
        """The tile that owns most units, and those around it: tile → its units."""
        if not self.counts:
            return {}
        tile = max(sorted(self.counts), key=lambda name: self.counts[name])
        return {
            t: {e["id"] for e in entries} - self.beyond for t, entries in _entries(records, survey.lattice.ring(tile))
        }


def _entries(records: CurrentRecords, tiles: Iterable[str]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Tile → what it owns, one after the other: units, or outlines where those have not been split yet."""
    split = frozenset(records.units(units.NAME))
    wanted = frozenset(tiles)
    for stage, names in ((units.NAME, wanted & split), (outline.NAME, wanted - split)):
        for record in records.some(stage, names):
            yield record.unit, record.result.get("units", [])


def _rows(run: Prepared, records: CurrentRecords, wanted: Mapping[str, set[str]]) -> Iterator[UnitRow]:
    """Rows of some units; tile → its units."""
    entries = {e["id"]: e["path"] for _, found in _entries(records, wanted) for e in found}
    exported = {r.unit: r for r in records.some(export.NAME, wanted)}
    for tile, ids in sorted(wanted.items()):
        standings = {
            s.outline.id: s
            for path in sorted({entries[u] for u in ids})
            for s in decode_all(run.store.read_bytes(path))
        }
        left = [p for p in exported[tile].outputs if p.endswith(f"/{ROWS}")] if tile in exported else []
        said = read_rows(run.store, left)
        for record in records.some(reconstruct.NAME, ids):
            rings = rings_of(standings[record.unit].outline.polygon)
            yield unit_row(record, tile, rings, said.get(record.unit, {}))
