"""The city as a source of tasks: what is ready at the start, and what becomes ready when something finishes.

The graph is data-dependent: units are known once the outlines of their tile are; whoever needs a surface asks for it, and a surface asks for the
files it is made of. Everything here runs in the driver and touches names and digests only.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from cityflow.core.building import Status
from cityflow.errors import CatalogError
from cityflow.flow.gates import Gates
from cityflow.flow.task import Json, Record, Task
from cityflow.io.stac_assets import Catalog
from cityflow.stages import (
    atlas,
    calibration,
    export,
    export_city,
    frame,
    fuse,
    ingest,
    ingest_image,
    match,
    ortho,
    outline,
    outline_accuracy,
    outline_walls,
    reconstruct,
    split,
    surface,
    surface_images,
    surface_rasters,
    texture,
    units,
    walls,
    windows,
)  # fmt: skip
from cityflow.stages.area import EVERYWHERE, Area
from cityflow.stages.depth_reader import reach_of
from cityflow.stages.flow_order import in_flow_order
from cityflow.stages.parameters import CityParameters
from cityflow.stages.survey import ACCURACY, IMAGES, LIDAR, RASTERS, Survey, UnitEntry

Node = tuple[str, str]
"""Stage and unit. Some stages are no tasks: ``gather`` stands for 'the units of this tile and of its ring are known', ``adjoin`` for 'all units
that share walls with them are known'; and where outlines are split, ``outlined`` for 'the outlines of this tile are known', ``beside`` for 'those that
touch them, too', ``cut`` for 'all of these are split'; and where outlines are given, ``sampled`` for 'it is known which file tells how exact
they are', ``measured`` for 'that file is read'."""

PICTURES = {
    match.STAGE: match.task, fuse.STAGE: fuse.task, ortho.STAGE: ortho.task, frame.STAGE: frame.task, walls.STAGE: walls.task,
}  # fmt: skip
"""Stages that only a survey of images has."""

SURFACES = {LIDAR: surface.task, IMAGES: surface_images.task, RASTERS: surface_rasters.task}

CITY: Node = ("export", export.CITY)


class CitySource:
    """Tasks of one run, in the order in which they become ready.

    Parameters
    ----------
    catalog, parameters : what there is, and what is asked for
    area : only these units, and what they need
    overrides : (stage, unit) → tree of values laid over the stage's parameters
    """

    def __init__(
        self,
        catalog: Catalog,
        parameters: CityParameters,
        area: Area = EVERYWHERE,
        overrides: Mapping[Node, Mapping[str, Json]] | None = None,
    ) -> None:
        self.survey = Survey(catalog, parameters, overrides or {})
        self.area = area
        self._gates: Gates[Node, Node] = Gates()
        self._wanted: set[Node] = set()
        self._known: dict[str, UnitEntry] = {}
        self._chosen: dict[str, list[str]] = {}
        self._units_of: dict[str, list[UnitEntry]] = {}
        self._leaves: dict[str, list[str]] = {}
        self._leaves_of: dict[str, list[str]] = {}
        self._outlines: dict[str, UnitEntry] = {}
        self._outlines_of: dict[str, list[str]] = {}
        self._exports: dict[Node, None] = {}
        self._foreseen: Counter[str] = Counter()

    def initial(self) -> Iterator[Task]:
        """What can start at once; everything else follows from `after`."""
        tiles = self.tiles_of_area()
        # what a person has drawn is read before anything runs: a file that is not there is said at once
        _ = self.survey.edits
        self._exports = {("export", name): None for name in tiles}
        pictures = list(self._pictures(tiles))
        self._gates.wait(CITY, [*self._exports, *pictures])
        if self.survey.outlines_given:
            yield from self._want([(ingest.STAGE, ingest.OUTLINES)])
        yield from self._want([("surface", name) for name in tiles])
        yield from self._want(pictures)
        yield from self._want([("gather", name) for name in tiles])

    def tiles_of_area(self) -> list[str]:
        """Names of the ground tiles to export.

        Raises
        ------
        CatalogError
            There is none.
        """
        survey = self.survey
        if not _has_something(survey):
            remedy = "make it again with --lidar, --images or --dsm, or set points.source to what it has"
            raise CatalogError(
                "the catalog names nothing that a surface can be made of", where=survey.catalog.href, remedy=remedy
            )
        tiles = [name for name, tile in survey.tiles.items() if self.area.meets(tile.bounds)]
        if not tiles:
            remedy = "see `cityflow catalog check` for the extent"
            raise CatalogError("no ground tile meets the area of interest", where="--aoi", remedy=remedy)
        return tiles

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        """What a finished task sets free."""
        node = (task.stage, task.unit)
        self.survey.learn(record)
        if node == (ingest.STAGE, ingest.OUTLINES):
            if record.status is Status.FAILED:
                return  # without outlines nobody knows what to export: what an earlier run left stays
            yield from self._refuse_broken(record)
        if task.stage in (outline.STAGE, units.STAGE):
            yield from self._refuse_broken(record)
        if task.stage == outline.STAGE and self.survey.splits:
            self._learn_outlines(task.unit, record)
        elif task.stage in (outline.STAGE, units.STAGE):
            yield from self._learn_units(task.unit, record)
        yield from self._open(node)

    def expected_units(self) -> dict[str, int | None]:
        """Tasks per stage as far as one can know now, in the order of the flow; None where the buildings decide and nobody knows them yet.

        What does not depend on records is counted by following what every task reads; the rest from the outlines, given or read already.
        """
        tiles = [name for name, tile in self.survey.tiles.items() if self.area.meets(tile.bounds)]
        if not self._foreseen:
            self._foreseen = Counter(stage for stage, _ in self._foreseen_tasks(tiles))
        buildings = self._expected_buildings(tiles)
        expected: dict[str, int | None] = {**self._foreseen, **buildings, "export": len(tiles) + 1}
        wanted = Counter(stage for stage, _ in self._wanted)
        return {s: n if (n := expected[s]) is None else max(n, wanted[s]) for s in in_flow_order(expected)}

    def _foreseen_tasks(self, tiles: list[str]) -> set[Node]:
        """The tasks under the outlines: they follow from the catalog alone."""
        ring = list(dict.fromkeys(t for name in tiles for t in self.survey.ring(name)))
        nodes = [*(("surface", t) for t in ring), *self._pictures(tiles), *((outline.STAGE, t) for t in ring)]
        nodes += [(walls.STAGE, t) for t in tiles] if self.survey.door == IMAGES else []
        found = set(nodes)
        while nodes:
            below = [n for n in self._needs(nodes.pop()) if n not in found]
            found.update(below)
            nodes.extend(below)
        return found | ({(units.STAGE, t) for t in ring} if self.survey.splits else set())

    def _expected_buildings(self, tiles: list[str]) -> dict[str, int | None]:
        """Tasks of single buildings and of their pages: from the units, once the records name all of them, else from the number of given outlines."""
        survey = self.survey
        known = all(t in self._units_of for t in tiles)
        given = survey.catalog.outlines if survey.outlines_given and self.area.is_everywhere else None
        chosen = [u for t in tiles for u in self._chosen.get(t, [])] if known else []
        count = len(chosen) if known else given.count if given is not None and not survey.splits else None
        found: dict[str, int | None] = {reconstruct.STAGE: count}
        if survey.splits:
            outlined = all(t in self._outlines_of for t in tiles)
            found[split.STAGE] = sum(len(self._outlines_of[t]) for t in tiles) if outlined else None
        if survey.textures:
            found[texture.STAGE] = count
            found[atlas.STAGE] = len({atlas.leaf_of(survey, self._known[u]) for u in chosen}) if known else None
            if windows.are_wanted(survey):
                found[windows.STAGE] = count
        return found

    def _pictures(self, tiles: list[str]) -> Iterator[Node]:
        """Orthos of the tiles and of the frames that look at them."""
        if self.survey.door == IMAGES:
            yield from ((ortho.STAGE, name) for name in tiles)
            yield from ((frame.STAGE, unit) for unit in self.survey.images.frame_units_over(tiles))

    def _open(self, event: Node) -> Iterator[Task]:
        for node in self._gates.fire(event):
            yield from self._free(node)

    def _want(self, nodes: Iterable[Node]) -> Iterator[Task]:
        for node in nodes:
            if node in self._wanted:
                continue
            self._wanted.add(node)
            if node[0] == units.STAGE:
                # what it reads is known only when the outlines are
                yield from self._want([("outlined", node[1])])
                continue
            if node == (ingest.STAGE, ACCURACY):
                # the file that it reads is known only when the outlines are
                yield from self._want([("sampled", ingest.OUTLINES)])
                continue
            needs = self._needs(node)
            yield from self._want(needs)
            if self._gates.wait(node, needs):
                yield from self._free(node)

    def _needs(self, node: Node) -> list[Node]:
        """The nodes whose results this one reads."""
        stage, name = node
        survey = self.survey
        if stage in PICTURES or (stage == surface.STAGE and survey.door == IMAGES):
            return self._needs_of_images(node)
        if stage == surface.STAGE:
            return [(ingest.STAGE, f.name) for f in survey.files_near(survey.tiles[name])]
        if stage == outline.STAGE:
            if survey.outlines_given:
                return [(ingest.STAGE, ingest.OUTLINES), *self._needs_of_given_walls(name)]
            near = survey.near(name, survey.parameters.outline.found.halo_m)
            seen = [(walls.STAGE, t) for t in near] if survey.sees_walls else []
            reach = outline_walls.reach_of_found(survey, name)
            files = survey.files_over(reach) if reach else []
            return [*((surface.STAGE, t) for t in near), *seen, *((ingest.STAGE, f.name) for f in files)]
        if stage == "sampled":
            return [(ingest.STAGE, ingest.OUTLINES)]
        if stage == "measured":
            return [(ingest.STAGE, name)] if name else []
        if stage in ("outlined", "beside", "cut", split.STAGE):
            return self._needs_of_splitting(node)
        if stage == reconstruct.STAGE:
            return self._needs_of_unit(self._known[name])
        if stage == "gather":
            return [(self._unit_stage, t) for t in survey.ring(name)]
        if stage == "adjoin":
            return [(self._unit_stage, t) for u in self._chosen[name] for t in self._tiles_beside(self._known[u])]
        if stage == ingest.STAGE:
            return self._needs_of_ingest(name)
        if stage == texture.STAGE:
            return self._needs_of_texture(self._known[name])
        if stage == windows.STAGE:
            return [(texture.STAGE, name)]
        if stage == atlas.STAGE:
            return [(texture.STAGE, u) for u in self._leaves[name]]
        return [
            *((surface.STAGE, t) for t in survey.ring(name)),
            *((reconstruct.STAGE, u) for u in self._units_of_export(name)),
            *self._needs_of_textures(name),
        ]

    def _needs_of_given_walls(self, tile: str) -> list[Node]:
        """Where façades may tell that given outlines are rims of roofs: the points and façades around them."""
        survey = self.survey
        if not outline_walls.are_looked_for(survey):
            return []
        if survey.door == LIDAR:
            around = survey.tiles[tile].buffered(outline_walls.REACH_M)
            return [(ingest.STAGE, ACCURACY), *((ingest.STAGE, f.name) for f in survey.files_over(around))]
        near = survey.near(tile, outline_walls.REACH_M)
        return [*((surface.STAGE, t) for t in near), *((walls.STAGE, t) for t in near)]

    @property
    def _unit_stage(self) -> str:
        """The stage whose records name the units."""
        return units.STAGE if self.survey.splits else outline.STAGE

    def _needs_of_splitting(self, node: Node) -> list[Node]:
        stage, name = node
        survey = self.survey
        if stage == "outlined":
            return [(outline.STAGE, name)]
        if stage == "beside":
            return [(outline.STAGE, t) for o in self._outlines_of[name] for t in self._outlines[o].neighbour_tiles]
        if stage == "cut":
            return [(split.STAGE, o) for o in self._touched_by(name)]
        under = survey.tiles_under(self._outlines[name])
        pictures = [(ortho.STAGE, t) for t in under] if survey.door == IMAGES else []
        frames = [(frame.STAGE, u) for u in split.frame_units(survey, self._outlines[name])]
        return [*((surface.STAGE, t) for t in under), *pictures, *frames]

    def _needs_of_unit(self, unit: UnitEntry) -> list[Node]:
        """Surfaces under a unit, and what images show of it."""
        under = self.survey.tiles_under(unit)
        pictures = [(s, t) for s in (ortho.STAGE, walls.STAGE) for t in under] if self.survey.door == IMAGES else []
        return [*((surface.STAGE, t) for t in under), *pictures]

    def _needs_of_textures(self, tile: str) -> list[Node]:
        """The pages of a tile's units, and the ortho that lies on its terrain."""
        if not self.survey.textures:
            return []
        found: dict[str, list[str]] = {}
        for unit in self._chosen[tile]:
            found.setdefault(atlas.leaf_of(self.survey, self._known[unit]), []).append(unit)
        self._leaves.update(found)
        self._leaves_of[tile] = sorted(found)
        under = [(ortho.STAGE, tile)] if self.survey.door == IMAGES else []
        looked = [(windows.STAGE, u) for u in self._chosen[tile]] if windows.are_wanted(self.survey) else []
        return [*((atlas.STAGE, leaf) for leaf in self._leaves_of[tile]), *looked, *under]

    def _needs_of_texture(self, unit: UnitEntry) -> list[Node]:
        """The models and surfaces that may stand between a unit and the cameras, and the images."""
        survey = self.survey
        hulls = [(reconstruct.STAGE, u) for u in (unit.id, *self._around(unit))]
        surfaces = [(surface.STAGE, t) for t in texture.surfaces_around(survey, unit)]
        return [*hulls, *surfaces, *((ingest.STAGE, n) for n in texture.images_of(survey, unit))]

    def _tiles_beside(self, unit: UnitEntry) -> list[str]:
        """Tiles whose units must be known, beyond the ring: those that own its neighbours, and those of the models around it."""
        return [*unit.neighbour_tiles, *(texture.tiles_around(self.survey, unit) if self.survey.textures else [])]

    def _around(self, unit: UnitEntry) -> list[str]:
        """Units near this one, whatever tiles they are in: these tiles' units are all known."""
        near = [u for t in texture.tiles_around(self.survey, unit) for u in self._units_of.get(t, [])]
        return [u for u in texture.hulls_around(self.survey, unit, near) if u in self._known]

    def _touched_by(self, tile: str) -> list[str]:
        """The outlines of a tile and those that touch them."""
        own = self._outlines_of[tile]
        beside = [n for o in own for n in self._outlines[o].neighbours if n in self._outlines]
        return list(dict.fromkeys([*own, *beside]))

    def _needs_of_ingest(self, name: str) -> list[Node]:
        """Raw frames wait for the calibration of their camera."""
        unit = calibration.unit_of(self.survey, name) if name in self.survey.images.assets else None
        return [(ingest.STAGE, unit)] if unit else []

    def _needs_of_images(self, node: Node) -> list[Node]:
        stage, name = node
        survey, images = self.survey, self.survey.images
        if stage == match.STAGE:
            flight_tile = images.flight_tile(name)
            return [(ingest.STAGE, n) for n in (flight_tile.base, *flight_tile.partners)]
        if stage == ortho.STAGE:
            over = [(surface.STAGE, t) for t in survey.ring(name)]
            return [*over, *((ingest.STAGE, n) for n in images.ortho_images(survey.tiles[name]))]
        wanted = survey.parameters.image_surface
        if stage == surface.STAGE:
            return [(fuse.STAGE, t) for t in survey.near(name, wanted.context_m)]
        reach = {fuse.STAGE: wanted.fuse.reach_m(survey.product_grid.cell), walls.STAGE: survey.wall_parameters.halo_m}
        around = (
            survey.near(name, reach_of(survey, reach[stage])) if stage in reach else frame.ground_around(survey, name)
        )
        return [(match.STAGE, f.name) for t in around for f in images.flight_tiles(survey.tiles[t])]

    def _free(self, node: Node) -> Iterator[Task]:
        """All that the node needs is there."""
        stage, name = node
        survey = self.survey
        if stage == "gather":
            self._chosen.setdefault(name, [])
            yield from self._want([("adjoin", name)])
        elif stage == "adjoin":
            yield from self._want([("export", name)])
        elif stage in ("outlined", "beside"):
            yield from self._want([("beside" if stage == "outlined" else "cut", name)])
        elif stage == "sampled":
            yield from self._want([("measured", survey.outline_sample[0])])
        elif stage == "measured":
            yield outline_accuracy.task(survey)
        elif stage == "cut":
            every = [self._outlines[o] for o in self._touched_by(name)]
            own = len(self._outlines_of[name])
            yield units.task(survey, name, every[:own], every[own:])
        elif stage == split.STAGE:
            yield split.task(survey, self._outlines[name])
        elif stage == ingest.STAGE:
            yield self._ingest_task(name)
        elif stage == surface.STAGE:
            yield SURFACES[survey.door](survey, name)
        elif stage in PICTURES:
            yield PICTURES[stage](survey, name)
        elif stage == outline.STAGE:
            yield outline.task(survey, name)
        elif stage == reconstruct.STAGE:
            yield reconstruct.task(survey, self._known[name])
        elif stage == texture.STAGE:
            unit = self._known[name]
            around = [self._known[u] for u in self._around(unit)]
            made = texture.task(survey, unit, around) if survey.hull(name)["path"] else None
            yield from self._unless_none(node, made)
        elif stage == windows.STAGE:
            yield from self._unless_none(node, windows.task(survey, self._known[name]))
        elif stage == atlas.STAGE:
            yield from self._unless_none(node, atlas.task(survey, name, self._leaves[name]))
        elif node == CITY:
            refused = survey.refused_outlines() if self.area.is_everywhere else {}
            leaves = {tile: self._leaves_of.get(tile, []) for _, tile in self._exports}
            yield export_city.task(survey, leaves, refused)
        else:
            shown = [self._known[u] for u in self._units_of_export(name)]
            yield export.task(survey, name, self._chosen[name], shown, self._leaves_of.get(name, []))

    def _unless_none(self, node: Node, task: Task | None) -> Iterator[Task]:
        """A task, or, where there is nothing to do, what waits for it."""
        if task is None:
            yield from self._open(node)
        else:
            yield task

    def _ingest_task(self, name: str) -> Task:
        if name == ingest.OUTLINES:
            return ingest.outlines_task(self.survey)
        if name.startswith(calibration.UNIT) and name not in self.survey.images.assets:
            return calibration.task(self.survey, name)
        make = ingest_image.image_task if name in self.survey.images.assets else ingest.points_task
        return make(self.survey, name)

    def _units_of_export(self, tile: str) -> list[str]:
        own = self._chosen[tile]
        return list(dict.fromkeys([*own, *(n for u in own for n in self._known[u].neighbours if n in self._known)]))

    def _learn_outlines(self, tile: str, record: Record) -> None:
        found = [UnitEntry.of(tile, entry) for entry in record.result.get("units", [])]
        self._outlines.update({o.id: o for o in found})
        self._outlines_of[tile] = [o.id for o in found]

    def _learn_units(self, tile: str, record: Record) -> Iterator[Task]:
        """Units of the area start at once; neighbours outside it only because an export needs their walls."""
        mine = [UnitEntry.of(tile, entry) for entry in record.result.get("units", [])]
        self._known.update({u.id: u for u in mine})
        self._units_of[tile] = mine
        self._chosen[tile] = [u.id for u in mine if self.area.holds(u.point)]
        if ("export", tile) in self._exports:
            yield from self._want([(reconstruct.STAGE, u) for u in self._chosen[tile]])

    def _refuse_broken(self, record: Record) -> Iterator[Task]:
        """Outlines that are no polygons, stand where nothing was surveyed, or were rejected, leave a record all the same."""
        if self.area.is_everywhere:
            for unit, reason in record.result.get("refused", []):
                yield reconstruct.refused_task(self.survey, str(unit), str(reason))


def _has_something(survey: Survey) -> bool:
    """Whether the catalog has what the surface shall be made of."""
    if survey.door == RASTERS:
        return "dsm" in survey.catalog.rasters
    return bool(survey.images.assets if survey.door == IMAGES else survey.files)
