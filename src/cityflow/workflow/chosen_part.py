"""What `rerun` is asked for, found by the records of the chosen units alone: the city is not gone through."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.flow.ledger import Ledger
from cityflow.flow.row import Row
from cityflow.flow.stage import Node, Place
from cityflow.pipeline.city_part import GIVEN, may_begin_with
from cityflow.pipeline.part_reach import Chosen
from cityflow.pipeline.pipeline import STAGES
from cityflow.stages import reconstruct
from cityflow.survey.city import OUTLINE, City

OF_SURFACES = "surface "
"""Begin of the names of the inputs that tell which tiles a unit stands on."""


@dataclass(frozen=True, slots=True)
class Selection:
    """Which units: those that failed (and, if asked, the degraded), those of a stage, those named; all conditions given must hold."""

    failed: bool = False
    degraded: bool = False
    stage: str = ""
    units: tuple[str, ...] = ()

    def is_met_by(self, row: Row) -> bool:
        """Whether a unit of the stage is among them."""
        statuses = (Status.FAILED, Status.DEGRADED) if self.degraded else (Status.FAILED,)
        return (not self.failed or row.status in statuses) and (not self.units or row.unit in self.units)


def part_of(city: City, ledger: Ledger, selection: Selection) -> Chosen | None:
    """The chosen tasks and where they are; None where only a walk over the whole city can tell, or has to follow.

    That is where something is chosen that comes before outlines, an outline that was refused, a unit whose tile has not come so far, or what stands beyond
    the area of interest: its neighbours inside tell whether it is asked for. Units of an earlier request are left out.
    """
    found = {(stage, unit) for stage, unit in _recorded(ledger, selection) if _is_asked(city, stage, unit)}
    if not found or not all(may_begin_with(stage) for stage, _ in found):
        return None
    if any(stage == OUTLINE for stage, _ in found):
        found |= {GIVEN} if city.survey.outlines_given else set()
    places: dict[str, list[Bounds]] = defaultdict(list)
    nodes, known = set[Node](), _Known(city, ledger)
    for stage, unit in found:
        if (stage, unit) == GIVEN:
            nodes.add(GIVEN)
            continue
        if STAGES[stage].place in (Place.TILE, Place.ATLAS_CELL):
            tile = _tile_in(city, unit)
            if tile is not None and tile not in city.tile_names and stage != OUTLINE:
                return None
            if tile is not None:
                places.setdefault(tile, [])
            nodes.add((stage, unit))
            continue
        place = known.place_of(stage, unit)
        if place is None:
            return None
        if place:
            nodes.add((stage, unit))
            places[place[0]].append(place[1])
    if not nodes:
        return None
    return Chosen(frozenset(nodes), {t: tuple(sorted(places[t])) for t in sorted(places)}, selection.units)


def _recorded(ledger: Ledger, selection: Selection) -> Iterator[Node]:
    """Units with records that the selection names, whether or not they are asked for today."""
    for stage in [selection.stage] if selection.stage else ledger.stages():
        if selection.failed:
            yield from ((stage, row.unit) for row in ledger.tally(stage).others if selection.is_met_by(row))
        elif selection.units:
            yield from ((stage, unit) for unit in selection.units if ledger.has(stage, unit))
        else:
            yield from ((stage, unit) for unit in ledger.units(stage))


def _is_asked(city: City, stage: str, unit: str) -> bool:
    """Whether the run has such a task today: a record may be of an earlier request, for textures or for a larger area, or of another program."""
    return stage in STAGES and STAGES[stage].asked(city, unit)


def _tile_in(city: City, unit: str) -> str | None:
    return next((t for t in (unit, unit.rpartition(".")[0]) if t in city.survey.lattice.tiles), None)


@dataclass
class _Known:
    """Units and outlines by tile, read where they are looked for."""

    city: City
    ledger: Ledger
    _bounds: dict[Node, dict[str, Bounds | None] | None] = field(default_factory=dict)

    def place_of(self, stage: str, unit: str) -> tuple[str, Bounds] | tuple[()] | None:
        """The tile that owns a unit, and its bounds; nothing where no tile around owns it any more; None where that cannot be told here."""
        naming = OUTLINE if STAGES[stage].place is Place.OUTLINE else self.city.unit_stage
        on = self._stands_on(stage, unit) or self._stands_on(reconstruct.NAME, unit)
        if not on:
            return None
        for tile in self.city.ring_of(t for t in on if t in self.city.survey.lattice.tiles):
            owned = self._units_of(naming, tile)
            if owned is None:
                return None
            if unit in owned:
                bounds = owned[unit]
                return None if bounds is None else (tile, bounds)
        return ()

    def _stands_on(self, stage: str, unit: str) -> list[str]:
        record = self.ledger.latest(stage, unit)
        names: Iterable[str] = () if record is None else record.inputs
        return [name.removeprefix(OF_SURFACES) for name in names if name.startswith(OF_SURFACES)]

    def _units_of(self, naming: str, tile: str) -> dict[str, Bounds | None] | None:
        """Bounds of what a tile owns, None of what stands beyond the area of interest; None where the tile has no record."""
        if (naming, tile) not in self._bounds:
            record = self.ledger.latest(naming, tile)
            entries: Sequence[dict[str, list[float]]] = () if record is None else record.result.get("units", [])
            holds = self.city.area.holds
            owned = {
                str(e["id"]): _four(e["bounds"]) if holds((e["point"][0], e["point"][1])) else None for e in entries
            }
            self._bounds[naming, tile] = None if record is None else owned
        return self._bounds[naming, tile]


def _four(bounds: Sequence[float]) -> Bounds:
    x_min, y_min, x_max, y_max = bounds
    return x_min, y_min, x_max, y_max
