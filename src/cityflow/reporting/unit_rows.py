"""Rows of buildings for the report: of all of them, from records, outlines and exports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.verdicts import PROBABILITY_KEY, REASON_KEY, VERDICT_KEY, Verdict
from cityflow.flow.task import Record
from cityflow.handover.export_rows import read_rows
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.refused_outlines import refused_shapes
from cityflow.reporting.asked_area import tile_entries, units_beyond
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import export, ingest, outline, reconstruct, units
from cityflow.viewer.report_rows import ProblemRow, UnitRow
from cityflow.viewer.unit_figures import UnitFigures


@dataclass(frozen=True, slots=True)
class ReportedCity:
    """Buildings for a report.

    Attributes
    ----------
    units : a row for each, or of a large city for those that a person shall see
    shown : rows of those that stand in pictures
    waiting : rings of outlines that are not processed yet, by id; in a large city empty ones
    figures, problems : in a large city: of all buildings; those that did not end as asked
    """

    units: tuple[UnitRow, ...]
    shown: tuple[UnitRow, ...]
    waiting: Mapping[str, tuple[FloatArray, ...]]
    figures: UnitFigures | None = None
    problems: tuple[ProblemRow, ...] = ()


def whole_city(run: Prepared, records: CurrentRecords) -> ReportedCity:
    """A row for every building."""
    outlines = _outlines(run, records)
    rows = tuple(_units(run, records, outlines))
    waiting = sorted(outlines.tiles.keys() - outlines.beyond - {row.id for row in rows})
    return ReportedCity(rows, rows, {unit: outlines.rings[unit] for unit in waiting})


def _units(run: Prepared, records: CurrentRecords, outlines: _Outlines) -> Iterator[UnitRow]:
    """The units that were asked for, without those beyond the area of interest that were modelled for what they share or hide."""
    exported = read_rows(run.store, [p for r in records.of(export.NAME) for p in r.outputs])
    for record in records.of(reconstruct.NAME):
        tile = outlines.tiles.get(record.unit, "")
        if record.unit not in outlines.beyond:
            yield unit_row(record, tile, outlines.rings.get(record.unit, ()), exported.get(record.unit, {}))


def unit_row(record: Record, tile: str, rings: tuple[FloatArray, ...], exported: Mapping[str, Any]) -> UnitRow:
    """A row of a unit; `exported`: what the export of its tile says of it, nothing where that did not run yet."""
    found, attributes = record.result, exported.get("attributes") or {}
    reaches = tuple(float(row[4]) for row in exported.get("overhangs", []))
    more = {k: v for k, v in {**found, **attributes}.items() if k not in ("scores", "notes", "reason", "status")}
    return UnitRow(
        record.unit, tile, record.status, record.reason, str(found.get("method", "")), str(found.get("lod", "")),
        int(found.get("planes", 0)), found.get("nmad"), found.get("rmse"), found.get("bias"), found.get("le95"),
        found.get("share_explained"), record.seconds, record.peak_mb, rings, more, reaches, *_judged(record),
    )  # fmt: skip


def _judged(record: Record) -> tuple[str, str, float | None]:
    """Verdict, reason and probability of a unit; a failed one is poor whatever else is known, a refused one has none."""
    if record.status is Status.REFUSED:
        return "", "", None
    if record.status is Status.FAILED:
        return Verdict.POOR.value, record.reason, 0.0
    found = record.result
    return str(found.get(VERDICT_KEY, "")), str(found.get(REASON_KEY, "")), found.get(PROBABILITY_KEY)


@dataclass(frozen=True, slots=True)
class _Outlines:
    """Rings of every unit and refused outline that is a polygon, the tiles that own the units, and the units that were not asked for."""

    rings: dict[str, tuple[FloatArray, ...]]
    tiles: dict[str, str]
    beyond: frozenset[str]


def _outlines(run: Prepared, records: CurrentRecords) -> _Outlines:
    found = _Outlines({}, {}, frozenset(units_beyond(records, run.area)))
    for tile, entries in tile_entries(records):
        for path in sorted({entry["path"] for entry in entries}):
            for standing in decode_all(run.store.read_bytes(path)):
                found.rings[standing.outline.id] = rings_of(standing.outline.polygon)
                found.tiles[standing.outline.id] = tile
    records_of = [r for stage in (ingest.NAME, outline.NAME, units.NAME) for r in records.of(stage)]
    for unit, shape in refused_shapes(run.store, records_of).items():
        found.rings.setdefault(unit, rings_of(shape))
    return found


def rings_of(shape: shapely.Geometry) -> tuple[FloatArray, ...]:
    """Exterior and holes, (n, 2) world metres."""
    return tuple(np.asarray(r.coords)[:, :2] for r in shapely.get_rings(shape))
