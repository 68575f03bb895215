"""The city as a source of tasks: initial tasks, and tasks that become ready when one ends.

The graph is data-dependent: units are known once the outlines of their tile are; whoever needs a surface asks for it, and a surface asks for the
files it is made of. Everything here runs in the driver and touches names and digests only.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial

from cityflow.flow.stage import Node
from cityflow.flow.task import Json, Record, Task
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.pipeline.pipeline import PIPELINE, UNTIL_EXPORT
from cityflow.pipeline.walk import Walk
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages import match
from cityflow.survey.area import EVERYWHERE, Area
from cityflow.survey.city import City, outlines_are_missing
from cityflow.survey.kept_plans import Plans
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import Survey
from cityflow.survey.texture_inputs import LONGEST_M


class CitySource:
    """Tasks of one run, in the order in which they become ready.

    Parameters
    ----------
    catalog, parameters : what there is, and what is asked for
    area : only these units, and what they need
    overrides : (stage, unit) → tree of values laid over the stage's parameters
    plans : where flight plans are kept
    memory : the records of the RUN, as far as there is one: depth maps of a larger area stand for a smaller one
    """

    def __init__(
        self,
        catalog: Catalog,
        parameters: CityParameters,
        area: Area = EVERYWHERE,
        overrides: Mapping[Node, Mapping[str, Json]] | None = None,
        plans: Plans | None = None,
        memory: match.Memory | None = None,
    ) -> None:
        self.city = City(catalog, parameters, area, overrides, plans, UNTIL_EXPORT)
        self.walk = Walk(PIPELINE, self.city)
        self._foreseen: Counter[str] = Counter()
        if not area.is_everywhere:
            self.survey.matches.foreseen = self._matched_tiles
        if memory is not None:
            self.survey.matches.before = partial(match.ground_before, self.survey, memory)

    @property
    def survey(self) -> Survey:
        return self.city.survey

    @property
    def area(self) -> Area:
        return self.city.area

    def initial(self) -> Iterator[Task]:
        """What can start at once, tile by tile and district by district; everything else follows from `after`.

        Raises
        ------
        CatalogError
            There is nothing to make a city of, no tile meets the area, or a file of edits cannot be read.
        """
        self.city.refuse_nothing()
        # what a person has drawn is read before anything runs: a file that is not there is said at once
        _ = self.survey.edits
        yield from self.walk.begin(self.city.districts.in_order())

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        """What a finished task sets free; what it says is learned at once."""
        self.city.learn(record)
        while self.city.past:
            self.walk.forget(*self.city.past.pop())
        return iter(()) if outlines_are_missing(record) else self.walk.ended((task.stage, task.unit))

    def forget_by(self, former: Callable[[str, str], Record | None]) -> None:
        """For whoever drives a whole city: what lies behind it is forgotten, and read again by `former` where somebody asks for it after all."""
        self.city.forget_by(former, self.survey.parameters.texture.around_m + LONGEST_M)

    def expected_units(self) -> dict[str, int | None]:
        """Tasks per stage as far as one can know now, in the order of the flow; None where the buildings decide and nobody knows them yet.

        What does not depend on records is counted by following what every task reads.
        """
        if not self._foreseen:
            self._foreseen = Counter(stage for stage, _ in self.walk.foreseen(self._under_outlines()))
        wanted = self.walk.wanted()
        found: dict[str, int | None] = {}
        for name, stage in self.walk.stages.items():
            count = stage.count(self.city) if stage.count else self._foreseen[name]
            known = count if count is None else max(count, wanted[name])
            if known != 0:
                found[name] = known
        return found

    def _matched_tiles(self) -> set[str]:
        """Ground tiles whose depth maps are asked for by what follows from the catalog alone, and by buildings that stand before those of the area."""
        survey, area = self.survey, self.city.area
        looked_m = survey.parameters.texture.around_m + LONGEST_M
        beside = [n for n, t in survey.lattice.tiles.items() if survey.textures and area.meets(t.buffered(looked_m))]
        seeds = [*self._under_outlines(), *(("outline", t) for t in beside)]
        units = (unit for stage, unit in self.walk.foreseen(seeds) if stage == match.NAME)
        return {self.survey.matches.flight_tiles(unit)[0].tile for unit in units}

    def _under_outlines(self) -> list[Node]:
        """The tasks that follow from the catalog alone: those for outlines of the tiles and of all that touch them."""
        city, images = self.city, self.survey.source.kind == IMAGES
        ring = city.ring_of(city.tiles)
        frames = self.survey.images.tilted.units_over(city.tiles) if images else []
        pictures = [(s, t) for s in ("ortho", "walls") for t in city.tiles] if images else []
        return [*((s, t) for s in ("surface", "outline") for t in ring), *pictures, *(("frame", u) for u in frames)]
