"""A part of a city as a source of tasks: what is run again, and what depends on it. The rest of the city stands as its records say."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import replace
from functools import cached_property

from cityflow.core.grid import Bounds
from cityflow.flow.stage import Node, Place
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.part_outlines import Memory, Outlines, contents
from cityflow.pipeline.part_reach import Chosen, Reach
from cityflow.pipeline.part_walk import PartWalk
from cityflow.pipeline.pipeline import PIPELINE, PLACE_IN_FLOW, STAGES
from cityflow.survey.city import EXPORT, INGEST, OUTLINE, OUTLINES, UNITS, City, outlines_are_missing
from cityflow.survey.districts import CITY
from cityflow.survey.given_outlines import ACCURACY, noded_tile
from cityflow.survey.texture_inputs import atlas_cells_of, tiles_around
from cityflow.survey.unit_entry import UnitEntry

FIRST = PLACE_IN_FLOW[OUTLINE]
"""Place in the flow of the first stage that a part may begin with: what lies before is of a part of the survey, not of the city."""
GIVEN = (INGEST, OUTLINES)
"""The task that deals out given outlines."""
LAST = (EXPORT, CITY)
"""The task that ends a run."""
STANDS_ONCE = "once"
"""Name of an input of that task."""


def may_begin_with(stage: str) -> bool:
    """Whether a part may begin with the stage.

    >>> may_begin_with("outline"), may_begin_with("detect"), may_begin_with("no stage")
    (True, False, False)
    """
    return PLACE_IN_FLOW.get(stage, -1) >= FIRST


class CityPart:
    """The tasks that depend on the chosen ones, in the order in which they become ready; of one stage those first that were named first.

    Parameters
    ----------
    source : of the whole city; its state is filled from the memory as tasks ask for it
    chosen : all of stages that it may begin with
    memory : records of all that has run

    Attributes
    ----------
    walk : tells what was made, what is left for another run, and what waits for that
    renamed : tiles that have other units now
    """

    def __init__(self, source: CitySource, chosen: Chosen, memory: Memory) -> None:
        self.city: City = source.city
        self.chosen: AbstractSet[Node] = chosen.nodes
        self.renamed: set[str] = set()
        self._chosen, self._memory, self._tiles = chosen, memory, tuple(chosen.places)
        self._first = min((PLACE_IN_FLOW[s] for s, _ in chosen.nodes if s != INGEST), default=len(PIPELINE))
        self._reach = Reach.of(source.city, chosen, chosen.places if chosen.may_rename else ())
        self._is_asked_for = self._is_begun = False
        self._before: dict[Node, object] = {}
        self._outlines = Outlines(chosen, memory)
        self._ended: set[Node] = set()
        self._unknown: set[Node] = set()
        self.walk = PartWalk(PIPELINE, source.city, self)
        source.survey.results.recall = self._recall

    def initial(self) -> Iterator[Task]:
        """Raises as `CitySource.initial`."""
        self.city.refuse_nothing()
        _ = self.city.survey.edits
        # where given outlines are dealt out anew, that tells which tiles may have others
        yield from self.walk.want([GIVEN]) if GIVEN in self.chosen else self._want_near()

    def _want_near(self) -> Iterator[Task]:
        """What names outlines and units near what is chosen, and the chosen tasks."""
        city = self.city
        near = [t for t in city.survey.lattice.tiles if t in self._reach.places]
        if any((INGEST, ACCURACY) in step(city, t) for t in near[:1] for step in STAGES[OUTLINE].needs):
            self._recall((INGEST, ACCURACY))
        if city.survey.splits:
            yield from self.walk.want((OUTLINE, t) for t in (*self._outlines.tiles, *near))
        self._before = {n: contents(self._memory.latest(*n)) for n in self._naming(near) if self.may_change(n)}
        yield from self.walk.want(self._naming(near))
        yield from self._want_chosen()
        self._is_asked_for = True
        yield from self._begin()

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        """What a finished task sets free."""
        node = task.stage, task.unit
        self._ended.add(node)
        self.city.learn(record)
        if node == GIVEN:
            yield from () if outlines_are_missing(record) else self._dealt(record)
        elif task.stage != self.city.unit_stage:
            yield from self.walk.ended(node, changed=task.stage != OUTLINE or self._outlines.are_others(record))
        else:
            self._outlines.are_others(record)
            changed = contents(record) != self._before.get(node)
            if changed:
                self.renamed.add(task.unit)
            yield from self.walk.ended(node, changed=changed)
            yield from self._want_chosen()
        yield from self._begin()

    def _dealt(self, record: Record) -> Iterator[Task]:
        """Given outlines are dealt out: what is theirs in tiles that may have others now, and what follows."""
        places = {**self._chosen.places, **dict.fromkeys(sorted(self._outlines.dealt(record)), ())}
        self._chosen, self._tiles = replace(self._chosen, places=places), tuple(places)
        self._reach = Reach.of(self.city, self._chosen, places)
        yield from self._want_near()
        yield from self.walk.ended(GIVEN)

    def _begin(self) -> Iterator[Task]:
        """The exports, once it is known which units there are: where these are as before, only what stands near the chosen ones is looked at."""
        if self._is_begun or not self._is_asked_for:
            return
        waiting, under_way = self.walk.waiting(), self.walk.under_way(self._before)
        if not waiting.issuperset(under_way) or any(
            stage == OUTLINE or STAGES[stage].place is Place.OUTLINE for stage, _ in self.walk.under_way(self.walk.made)
        ):
            return
        self._is_begun = True
        felt = self.renamed | {tile for _, tile in under_way}
        # of tiles whose outlines were looked at, those count that have other units now
        places = {t: b for t, b in self._chosen.places.items() if t in felt or t not in self._outlines.tiles}
        self._tiles = tuple(places)
        self._reach = Reach.of(self.city, replace(self._chosen, places=places), felt, self._outlines.changed)
        yield from self.walk.begin(place for place in self.city.districts.in_order() if place in self._reach.places)

    def may_change(self, node: Node) -> bool:
        """Only what comes later in the flow than the first of the chosen stages, and stands near what is chosen."""
        (stage, unit), city = node, self.city
        if stage == INGEST:
            return GIVEN in self.chosen and (unit == ACCURACY or noded_tile(unit) is not None)
        if PLACE_IN_FLOW[stage] < self._first:
            return False
        if STAGES[stage].place is Place.OUTLINE:
            outline = city.outlines.get(unit)
            return outline is not None and (self._outlines.is_other(outline) or self._outlines.is_edited(city, outline))
        if stage == UNITS:
            return unit in self._named_anew
        entry = self._entry(node)
        if entry is not None:
            return self._reach.meets_unit(entry.bounds)
        tile = self._tile_of(unit)
        if tile is None:
            return unit not in city.districts.parts or unit in self._reach.places
        if tile in self._tiles:
            return True
        known = None if self._reach.renames else city.units_of.get(tile)
        if known is None:
            return self._reach.meets_tile(self._bounds(tile))
        return bool(known.meeting(self._reach.boxes).any())

    @cached_property
    def _named_anew(self) -> frozenset[str]:
        """Tiles whose units may be others: that own a chosen outline, or one that touches it. The outlines are known by then, but for those of chosen
        tiles: what these touch, now or before, is owned by the tiles around.
        """
        asked = {tile for stage, tile in self.chosen if stage == UNITS}.union(self.city.ring_of(self._outlines.tiles))
        outlines = [
            o for stage, u in self.chosen if STAGES[stage].place is Place.OUTLINE and (o := self.city.outlines.get(u))
        ]
        return frozenset(asked.union(*({o.tile, *o.neighbour_tiles} for o in outlines)))

    def has_ended(self, node: Node) -> bool:
        """Whether a task of this walk has ended; one that was wanted and is not has nothing to do."""
        return node in self._ended

    def is_due(self, node: Node) -> bool:
        if node in self.chosen:
            return True
        outline = self.city.outlines.get(node[1]) if STAGES[node[0]].place is Place.OUTLINE else None
        return outline is not None and self._outlines.is_edited(self.city, outline)

    def has(self, node: Node) -> bool:
        return self._memory.has(*node)

    def has_always_a_task(self, node: Node) -> bool:
        """A building without a model has no texture, and no windows; an atlas cell without textures has no pages."""
        return STAGES[node[0]].place not in (Place.UNIT, Place.ATLAS_CELL)

    def stand(self, node: Node) -> None:
        """Outlines and units are known as soon as the task that names them stands; of all others the record is read when it is asked for."""
        if node[0] in (OUTLINE, UNITS) or (node[0] == INGEST and noded_tile(node[1]) is not None):
            self._recall(node)

    def prepare(self, node: Node) -> None:
        """The last merge asks for all outlines that were refused, and in a small city for all that is joined."""
        if node != LAST:
            return
        city = self.city
        is_joined = len(city.tiles) <= city.survey.parameters.export.join_up_to_tiles
        if not is_joined and not (city.area.is_everywhere and self._has_refused()):
            return
        for asked in ((stage, tile) for stage in dict.fromkeys((OUTLINE, city.unit_stage)) for tile in city.tiles):
            record = None if asked in city.survey.results else self._memory.latest(*asked)
            if record is not None:
                city.survey.results.learn(record)

    def _has_refused(self) -> bool:
        """Whether an outline may have been refused: in a large city, the last merge takes in what stands once only where there is one."""
        record = self._memory.latest(*LAST)
        return bool(self.renamed or self._outlines.changed) or record is None or STANDS_ONCE in record.inputs

    def named_by(self, node: Node) -> Iterable[Node]:
        """Who names the outlines of a tile, or its units, has named their tasks, and textures see the units around."""
        name, unit = node
        stage = STAGES[name]
        if stage.place is Place.OUTLINE:
            return [(OUTLINE, self.city.outlines[unit].tile)]
        if node == LAST:
            return [(OUTLINE, tile) for tile in self._outlines.changed]
        if stage.place not in (Place.UNIT, Place.ATLAS_CELL):
            return []
        entry = self._entry(node)
        if entry is None and unit in self.city.refused:
            return [GIVEN, *((OUTLINE, t) for t in self._outlines.changed), *self._naming(sorted(self.renamed))]
        tile = self._tile_of(unit) if entry is None else entry.tile
        around = () if entry is None else stage.sees(self.city, unit)
        return self._naming([*([tile] if tile else []), *around])

    def _entry(self, node: Node) -> UnitEntry | None:
        """The outline or the building that a node is of, where it is known."""
        stage, unit = node
        if STAGES[stage].place is Place.OUTLINE:
            return self.city.outlines.get(unit)
        return self.city.units.get(unit) if STAGES[stage].place is Place.UNIT else None

    def _naming(self, tiles: Iterable[str]) -> list[Node]:
        return [(self.city.unit_stage, t) for t in tiles]

    def _bounds(self, tile: str) -> Bounds:
        return self.city.survey.lattice.tiles[tile].bounds

    def _tile_of(self, unit: str) -> str | None:
        """The tile that a unit of a stage is named after."""
        return next((t for t in (unit, unit.rpartition(".")[0]) if t in self.city.survey.lattice.tiles), None)

    def _want_chosen(self) -> Iterator[Task]:
        """The chosen tasks whose units are known by now."""
        city = self.city
        around = {
            t for own in self._tiles for u in city.chosen.get(own, ()) for t in tiles_around(city.survey, city.units[u])
        }
        yield from self.walk.want(self._naming(sorted(around)))
        rank = {unit: k for k, unit in enumerate(self._chosen.first)}
        known = [node for node in self.chosen if self._is_known(*node)]
        yield from self.walk.want(
            sorted(known, key=lambda node: (PLACE_IN_FLOW[node[0]], rank.get(node[1], len(rank)), node[1]))
        )

    def _is_known(self, stage: str, unit: str) -> bool:
        city, place = self.city, STAGES[stage].place
        if place is Place.ATLAS_CELL:
            tile = unit.rpartition(".")[0]
            return tile in city.chosen and unit in atlas_cells_of(city, tile)
        if place is Place.TILE:
            return unit in city.survey.lattice.tiles
        return self._entry((stage, unit)) is not None

    def _recall(self, node: Node) -> None:
        """Learn what a record says of a task that this walk does not come to."""
        if node in self._unknown or (node in self.walk.made and node not in self._ended):
            return
        record = self._memory.latest(*node) if self._is_asked(*node) else None
        if record is None:
            self._unknown.add(node)
        else:
            self.city.learn(record)

    def _is_asked(self, stage: str, unit: str) -> bool:
        """Whether a walk over the whole city would come to it: a record may be of an earlier request."""
        found = STAGES[stage]
        return found.asked(self.city, unit) and found.supplied(self.city, unit)
