"""Outlines of chosen ground tiles that are made anew in a part of a city: which of them are others than before."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from cityflow.flow.task import Record
from cityflow.pipeline.part_reach import Chosen
from cityflow.survey.city import INGEST, OUTLINE, OUTLINES, SPLIT, City
from cityflow.survey.point_files import stem
from cityflow.survey.unit_entry import UnitEntry

EDITS = "edits"
"""Name of an input of tasks that edits act on."""


class Memory(Protocol):
    """The records of a RUN, as `flow.ledger.Ledger` has them."""

    def has(self, stage: str, unit: str) -> bool: ...

    def latest(self, stage: str, unit: str) -> Record | None: ...


class Outlines:
    """The tasks of outlines of those tiles that may have others than before.

    Parameters
    ----------
    chosen : names these tiles, unless it has given outlines dealt out anew (`dealt`)
    memory : as it is before any task runs

    Attributes
    ----------
    tiles : those that were named first come first
    changed : those of them whose task has left something else than before
    """

    def __init__(self, chosen: Chosen, memory: Memory) -> None:
        self.tiles: tuple[str, ...] = ()
        self.changed: set[str] = set()
        self._rank = {unit: k for k, unit in enumerate(chosen.first)}
        self._memory = memory
        self._contents: dict[str, object] = {}
        self._digests: dict[str, str] = {}
        self._dealt = memory.latest(INGEST, OUTLINES) if (INGEST, OUTLINES) in chosen.nodes else None
        self._add({t for s, t in chosen.nodes if s == OUTLINE})

    def _add(self, tiles: set[str]) -> None:
        every = {*self.tiles, *tiles}
        self.tiles = tuple(sorted(every, key=lambda t: (self._rank.get(t, len(self._rank)), t)))
        for tile in self.tiles:
            if tile not in self._contents:
                record = self._memory.latest(OUTLINE, tile)
                self._contents[tile] = contents(record)
                units = [] if record is None else record.result.get("units", [])
                self._digests |= {str(e["id"]): str(e["digest"]) for e in units}

    def dealt(self, record: Record) -> tuple[str, ...]:
        """Given outlines are dealt out by chains of neighbours: the tiles that may own outlines of other chains than before."""
        before, now = ({} if r is None else _chains(r) for r in (self._dealt, record))
        others = [s for s in before.keys() | now.keys() if before.get(s) != now.get(s)]
        self._add({tile for s in others for of in (before, now) if s in of for tile in of[s].reached})
        return self.tiles

    def are_others(self, record: Record) -> bool:
        """Whether the task of a tile, which has ended, has left something else than before; true of one that was not chosen."""
        tile = record.unit
        is_same = tile in self._contents and contents(record) == self._contents[tile]
        if not is_same and tile in self._contents:
            self.changed.add(tile)
        return not is_same

    def is_other(self, outline: UnitEntry) -> bool:
        """Whether an outline of these tiles is not as it was."""
        return outline.tile in self._contents and self._digests.get(outline.id) != outline.digest

    def is_edited(self, city: City, outline: UnitEntry) -> bool:
        """Whether edits act on an outline of these tiles, or did when it was split."""
        if outline.tile not in self._contents:
            return False
        record = self._memory.latest(SPLIT, outline.id)
        return record is None or EDITS in record.inputs or bool(len(city.survey.edits.of_splits.within(outline.bounds)))


class _Chains(NamedTuple):
    """The outlines dealt to a tile, and the tiles that may own them."""

    digest: str
    taken: tuple[str, ...]
    reached: tuple[str, ...]


def _chains(record: Record) -> dict[str, _Chains]:
    taken, reached = record.result.get("taken", {}), record.result.get("reached", {})
    digests = {stem(path): digest for path, digest in record.outputs.items()}
    return {t: _Chains(digests.get(t, ""), tuple(taken.get(t, ())), tuple(over)) for t, over in reached.items()}


def contents(record: Record | None) -> object:
    """What a task that names outlines or units has told."""
    if record is None:
        return None
    return record.status, record.reason, dict(record.outputs), record.result.get("units"), record.result.get("refused")
