"""The buildings of a RUN as its records have them, tile by tile."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import shapely

from cityflow.core.building import Status
from cityflow.flow.task import Record
from cityflow.handover.epoch_rows import EpochRow
from cityflow.handover.outline_lines import decode_all
from cityflow.reporting.listed_city import entries_of
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import ingest, outline, reconstruct, units
from cityflow.survey.given_outlines import ACCURACY
from cityflow.survey.results import HULL

WITH_MODEL = (Status.DONE, Status.DEGRADED)


def epoch_rows(
    run: Prepared, records: CurrentRecords, is_wanted: Callable[[EpochRow], bool] = lambda _: True
) -> Iterator[tuple[str, list[EpochRow]]]:
    """Tile → its buildings in the area of interest, without refused ones; those whose model failed or is still to come have none.

    Parameters
    ----------
    is_wanted : is asked with a row without its model; only models of those that are wanted are read, tile by tile
    """
    sigma = outline_sigma(run, records)
    for tile, entries in entries_of(records, run.source().survey.lattice.tiles):
        asked = [e for e in entries if run.area.holds(tuple(e["point"]))]
        ended = {r.unit: r for r in records.some(reconstruct.NAME, [e["id"] for e in asked])}
        shapes = {
            s.outline.id: s.outline.polygon
            for path in sorted({e["path"] for e in asked})
            for s in decode_all(run.store.read_bytes(path))
        }
        known = sorted((e["id"], ended.get(e["id"])) for e in asked)
        hulls = {u: _hull(r) for u, r in known if r is None or r.status is not Status.REFUSED}
        rows = [EpochRow(u, tile, shapely.to_wkb(shapes[u], hex=True), d, "", sigma) for u, (_, d) in hulls.items()]
        rows = [row for row in rows if is_wanted(row)]
        features = dict(run.store.read_many([hulls[row.id][0] for row in rows if row.digest]))
        yield tile, [replace(row, feature=features.get(hulls[row.id][0], b"").decode()) for row in rows]


def unlisted_tiles(run: Prepared, records: CurrentRecords) -> set[str]:
    """Ground tiles in the area of interest of which nobody can say which buildings stand there, since tasks failed or have not run."""
    survey = run.source().survey
    for record in records.of(ingest.NAME):
        survey.learn(record)
    tiles = {t for t, tile in survey.lattice.tiles.items() if run.area.meets(tile.bounds)}
    known = {row.unit for row in records.rows(outline.NAME) if row.status is not Status.FAILED}
    known -= {row.unit for row in records.rows(units.NAME) if row.status is Status.FAILED}
    return {t for t in tiles if t not in known or survey.given.lost(t)}


def outline_sigma(run: Prepared, records: CurrentRecords) -> float:
    """How exact the outlines are, metres: as the workflow says, else as the run has found."""
    survey = run.source().survey
    for record in records.some(ingest.NAME, [ACCURACY]):
        survey.given.learn(record)
    return survey.outline_sigma_m


def _hull(record: Record | None) -> tuple[str, str]:
    """Path and digest; empty where it has no model of its own."""
    found = record.outputs.items() if record is not None and record.status in WITH_MODEL else ()
    return next(((path, digest) for path, digest in found if path.endswith(HULL)), ("", ""))
