"""Buildings of a run by their ground tiles: ids of all of them, rows of a tile when its turn comes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Self

from cityflow.core.building import Status
from cityflow.handover.refused_outlines import refused_shapes
from cityflow.reporting.listed_city import entries_of, rows_of_units
from cityflow.reporting.unit_rows import rings_of, unit_row
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import ingest, outline, reconstruct, units
from cityflow.survey.survey import Survey
from cityflow.viewer.report_rows import UnitRow

NO_TILE = "_"
"""Stands for the tile of what belongs to none: refused outlines."""


@dataclass(frozen=True, slots=True)
class TileRows:
    """Buildings that were asked for and have a record.

    Attributes
    ----------
    ids : tile, or `NO_TILE` → buildings that it owns
    rows : tile → their rows
    """

    ids: Mapping[str, Sequence[str]]
    rows: Callable[[str], Sequence[UnitRow]]

    @classmethod
    def of(cls, rows: Sequence[UnitRow]) -> Self:
        """Of rows that are there."""
        found: dict[str, list[UnitRow]] = defaultdict(list)
        for row in rows:
            found[row.tile or NO_TILE].append(row)
        return cls({tile: [r.id for r in found[tile]] for tile in sorted(found)}, found.__getitem__)

    @classmethod
    def stored(cls, run: Prepared, records: CurrentRecords, survey: Survey) -> Self:
        """Of a large city: the rows of one tile at a time are made from its records."""
        done = frozenset(records.units(reconstruct.NAME))
        ids: dict[str, list[str]] = {}
        owned = set[str]()
        for tile, entries in entries_of(records, survey.lattice.tiles):
            owned.update(e["id"] for e in entries)
            asked = (e["id"] for e in entries if run.area.holds(tuple(e["point"])))
            if made := sorted(unit for unit in asked if unit in done):
                ids[tile] = made
        if others := sorted(done - owned):
            ids[NO_TILE] = others
        return cls(dict(sorted(ids.items())), partial(_stored_rows, run, records, ids))


def _stored_rows(
    run: Prepared, records: CurrentRecords, ids: Mapping[str, Sequence[str]], tile: str
) -> Sequence[UnitRow]:
    if tile != NO_TILE:
        return list(rows_of_units(run, records, {tile: set(ids[tile])}))
    left = (records.of(stage) for stage in (ingest.NAME, outline.NAME, units.NAME))
    shapes = refused_shapes(run.store, chain.from_iterable(left))
    found = records.some(reconstruct.NAME, ids[tile])
    return [unit_row(r, "", rings_of(shapes[r.unit]) if r.unit in shapes else (), {}) for r in found]


def attempts_of(records: CurrentRecords, stage: str) -> dict[str, tuple[int, bool]]:
    """Unit → number of its newest record, and whether it left a result."""
    good = (Status.DONE, Status.DEGRADED)
    return {row.unit: (row.attempt, row.status in good) for row in records.rows(stage)}
