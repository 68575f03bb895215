"""What the exports of a city have left for merges: figures of all buildings and of each district. No building is read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict
from cityflow.handover.export_summary import SUMMARY, Summary, added, decode_summary, first_of
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import export
from cityflow.survey.districts import CITY
from cityflow.viewer.report_rows import DistrictRow
from cityflow.viewer.unit_figures import UnitFigures, quantile

PART = "part "
"""Begins the names of a merge's inputs."""
SUMMED_AT_ONCE = 64
"""Summaries of tiles that are held where no merge has come yet."""


@dataclass(frozen=True, slots=True)
class SummedCity:
    """Summaries of what is exported.

    Attributes
    ----------
    whole : None where nothing is exported
    parts : what the whole was merged of: districts or, of a small city, tiles; none where the last merge has not come yet
    fullest : the tile of most buildings, where there are no parts; may be empty
    """

    whole: Summary | None
    parts: tuple[Summary, ...]
    fullest: str = ""

    @classmethod
    def read(cls, run: Prepared, records: CurrentRecords) -> Self:
        merged = list(_summaries(run, records, [CITY]))
        if merged:
            return cls(merged[0], _parts(run, records, CITY))
        tiles: list[Summary] = []
        fullest = (0, "")
        for one in _summaries(run, records, run.source().city.tiles):
            tiles.append(one)
            fullest = max(fullest, (_buildings(one), one.name))
            if len(tiles) == SUMMED_AT_ONCE:
                tiles = [_as_one(tiles)]
        return cls(_as_one(tiles) if tiles else None, (), fullest[1])

    def densest(self, run: Prepared, records: CurrentRecords) -> str:
        """The tile of most buildings, of the district of most; empty where nothing is exported."""
        parts, name = self.parts, self.fullest
        while parts:
            name = max(parts, key=lambda part: (_buildings(part), part.name)).name
            parts = _parts(run, records, name)
        return name

    def rows(self) -> tuple[DistrictRow, ...]:
        """Of the parts, those with the smallest share of good buildings first."""
        return tuple(sorted(map(_row, self.parts), key=lambda row: (row.good / max(row.buildings, 1), row.name)))

    @property
    def has_districts(self) -> bool:
        return any(part.tiles > 1 for part in self.parts)


def _parts(run: Prepared, records: CurrentRecords, name: str) -> tuple[Summary, ...]:
    """What a merge was made of, as its record names it; nothing below a tile."""
    merges = records.some(export.NAME, [name])
    below = [key.removeprefix(PART) for merge in merges for key in merge.inputs if key.startswith(PART)]
    return tuple(_summaries(run, records, below))


def _summaries(run: Prepared, records: CurrentRecords, names: Iterable[str]) -> Iterator[Summary]:
    for record in records.some(export.NAME, names):
        for path in (p for p in record.outputs if p.endswith(f"/{SUMMARY}")):
            yield decode_summary(run.store.read_bytes(path), path)


def _as_one(found: list[Summary]) -> Summary:
    worst = first_of(w for s in found for w in s.worst)
    first = found[0]
    return Summary(first.name, first.bounds, len(found), added(s.counts for s in found), None, {}, {}, worst)


def _buildings(part: Summary) -> int:
    return sum(part.counts["status"].values())


def _row(part: Summary) -> DistrictRow:
    found = UnitFigures.of_counts(part.counts, (), None)
    verdicts, status = found.verdicts, found.status
    return DistrictRow(
        part.name, part.bounds, part.tiles, found.units, verdicts[Verdict.GOOD], verdicts[Verdict.LOOK], verdicts[Verdict.POOR],
        status[Status.DEGRADED], status[Status.FAILED], status[Status.REFUSED], quantile(found.values["nmad"], 0.5),
    )  # fmt: skip
