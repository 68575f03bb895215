"""Ground tiles as the map of a run: which tile a task belongs to, and when a tile is done."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from cityflow.flow.task import Record
from cityflow.stages import export
from cityflow.survey.city import City
from cityflow.workflow.followed import FollowedCity


@dataclass(frozen=True, slots=True)
class TilePlaces:
    """Tiles of a city that is being followed; see `flow.run_news.Places`."""

    followed: FollowedCity

    def all(self) -> Iterable[str]:
        return self.followed.city.city.tiles

    def of(self, stage: str, unit: str) -> str:  # noqa: ARG002 - names of units are of one kind in all stages
        return tile_of(self.followed.city.city, unit)

    def is_closed_by(self, record: Record) -> bool:
        return record.stage == export.NAME


def tile_of(city: City, unit: str) -> str:
    """The tile of a building, of an outline, of a reference image over a tile, of an atlas cell; empty for a file or a tile of a frame."""
    entry = city.units.get(unit) or city.outlines.get(unit)
    name = entry.tile if entry else unit.split(".", 1)[0]
    return name if name in city.survey.lattice.tiles else ""
