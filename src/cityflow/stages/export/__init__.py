"""Stage ``export``: the buildings of a ground tile, their party walls cut, and the terrain they stand on, in every format."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from cityflow.core.building import Building, Lod, Status
from cityflow.core.grid import Bounds
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.export_rows import ROWS, encode_rows
from cityflow.handover.fallback_block import failed_block
from cityflow.handover.hull_input import Hull
from cityflow.handover.outline_lines import Standing, decode_all
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.texture_files import ATLAS_CELL
from cityflow.io.catalog.products_catalog import COLLECTION
from cityflow.io.city_models.cityjson import read_feature
from cityflow.io.city_models.coarse_scene import coarse_of
from cityflow.io.crs import resolve
from cityflow.io.export_formats.formats import written
from cityflow.io.export_formats.tile import CityTile
from cityflow.reconstruction.party.party_walls import cut_party_walls, differing_walls, wall_areas
from cityflow.stages.export import merge
from cityflow.stages.export.metadata_inputs import metadata_inputs
from cityflow.stages.export.table import table_of, table_path
from cityflow.stages.export.terrain import Draped, DrapeInputs, drape, plans_of, terrain_of
from cityflow.stages.export.textured_faces import texture_sets, with_texture_figures
from cityflow.stages.export.tile_openings import openings_on, with_window_figures
from cityflow.stages.export.tile_summary import leave_summary, row_of
from cityflow.surface.tin_parts import connected_parts
from cityflow.survey.city import EXPORT, City
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import ExportParameters
from cityflow.survey.texture_inputs import atlas_cells_of, tiles_around, windows_are_wanted
from cityflow.survey.unit_entry import UnitEntry

NAME = EXPORT
VERSION = 16
TILES3D = "tiles3d"


@dataclass(frozen=True, slots=True)
class ExportInputs(TaskInputs):
    """What a tile shows.

    Attributes
    ----------
    bounds : of the tile;  city : of all tiles, metres
    own : units that the tile owns;  hulls : of these and of those that share walls with them
    outlines : RUN-relative paths of the units' outlines, of the tile and those around it
    textures : whether there are any;  leaves : RUN-relative paths of what the atlas has left;  bare : unit → why it has none
    windows : unit → RUN-relative path;  unseen : unit → why nobody could look for them
    others : products of other tasks that stand on the tile, path → digest;  parent : path of the catalog that its item hangs on
    table : whether it has a table of units: in a city of many tiles there is no file of all
    """

    bounds: Bounds
    city: Bounds
    surfaces: Surfaces
    metadata: ProductMetadata
    own: tuple[str, ...]
    hulls: Mapping[str, Hull]
    outlines: tuple[str, ...]
    textures: bool
    atlas_cells: tuple[str, ...]
    bare: Mapping[str, str]
    windows: Mapping[str, str]
    unseen: Mapping[str, str]
    orthos: DrapeInputs
    others: Mapping[str, str]
    parent: str
    table: bool


def task(
    survey: Survey, name: str, own: Sequence[str], units: Sequence[UnitEntry], atlas_cells: Sequence[str] = (),
    parent: str = COLLECTION,
) -> Task:  # fmt: skip
    """Export the units `own` of a tile; `units` are these and the neighbours that share walls with them, `atlas_cells` hold their textures.
    The tile's item hangs on the catalog `parent`.
    """
    ring = survey.lattice.ring(name)
    tiles = sorted({*ring, *(u.tile for u in units)})
    outlines = {p: d for t in tiles for p, d in survey.unit_files(t).items()}
    # by tile, not by path: a file that was written again with the same outlines changes nothing
    lines = {f"outlines {t}": digest_of(list(found.values())) for t in tiles if (found := survey.unit_files(t))}
    surfaces = {f"surface {t}": survey.results.digest_of("surface", t) for t in ring}
    pages = {atlas_cell: survey.results.outputs_of("atlas", atlas_cell) for atlas_cell in atlas_cells}
    hulls = {f"hull {u.id}": survey.results.digest_of_hull(u.id) for u in units}
    bare = {u: why for u in sorted(own) if (why := survey.results.failure_of("texture", u))}
    opened = _windows(survey, own)
    unseen = {u: why for u in sorted(own) if (why := survey.results.failure_of("windows", u))}
    metadata = survey.product_metadata(survey.lattice.tiles[name].bounds)
    others = _others(survey, name, pages)
    table = len(survey.lattice.tiles) > survey.parameters.export.join_up_to_tiles
    own_ortho = survey.lattice.product_grid if survey.reads_own_orthos else None
    orthos = DrapeInputs(own_ortho, survey.ortho_inputs, metadata.crs, survey.images.white)
    return KIND.task(
        name, parameters=as_json(survey.parameters_of(NAME, name, survey.parameters.export)),
        inputs={**hulls, **lines, **surfaces, **_textures(survey, name, pages), "own": digest_of(sorted(own)), **metadata_inputs(survey, metadata),
                "others": digest_of(others), **({"parent": parent} if parent != COLLECTION else {}), **({"table": "units"} if table else {}),
                **{what: digest_of(why) for what, why in (("without textures", bare), ("without windows", unseen)) if why},
                **{f"windows {u}": digest for u, (_, digest) in opened.items()}},
        given=ExportInputs(
            survey.lattice.tiles[name].bounds, survey.lattice.bounds, survey.surfaces, metadata, tuple(sorted(own)),
            {u: survey.results.hull(u) for u in sorted(u.id for u in units)},
            tuple(outlines), survey.textures, tuple(p for outputs in pages.values() for p in outputs if p.endswith(ATLAS_CELL)), bare,
            {u: path for u, (path, _) in opened.items()}, unseen, orthos, others, parent, table,
        ), limits=survey.limits(NAME),
    )  # fmt: skip


def _others(survey: Survey, tile: str, pages: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Products of other tasks that stand on a tile, path → digest."""
    rasters = {**survey.results.products_of("surface", tile), **survey.results.products_of("ortho", tile)}
    return rasters | {p: d for outputs in pages.values() for p, d in outputs.items() if p.startswith("products/")}


def _textures(survey: Survey, tile: str, pages: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """What the look of a tile depends on; nothing if textures are not requested."""
    if not survey.textures:
        return {}
    orthos = {k: r.checksum for k, r in survey.given_orthos().items()}
    own = {"ortho": survey.results.digest_of("ortho", tile)} if survey.reads_own_orthos else {}
    if own and survey.images.dtype != "uint8":
        own["white"] = f"{survey.images.white:g}"
    return {
        **orthos,
        **own,
        **{f"atlas {atlas_cell}": digest_of(outputs) for atlas_cell, outputs in sorted(pages.items())},
    }


def _windows(survey: Survey, own: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Unit → path and digest of the windows that were found."""
    found = {u: survey.results.outputs_of("windows", u) for u in sorted(own)}
    return {u: next(iter(outputs.items())) for u, outputs in found.items() if outputs}


def is_made_alike(survey: Survey, record: Record, surface: Record) -> bool:
    """Whether an earlier export has the version and parameters that it would have now, and stands on that surface."""
    parameters = as_json(survey.parameters_of(NAME, record.unit, survey.parameters.export))
    stood_on = record.inputs.get(f"surface {record.unit}")
    return (record.version, dict(record.parameters), stood_on) == (VERSION, parameters, surface.result.get("digest"))


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile in every format that is asked for, and beside them what became of its units."""
    given, parameters = task.arguments_as(ExportInputs), task.parameters_as(ExportParameters)
    standings = {s.outline.id: s for p in given.outlines for s in decode_all(workspace.read(p))}
    finished = with_party_walls(_buildings(workspace.store, given, standings))
    names = [u for u in given.own if u in finished]
    sets = texture_sets(workspace, given.atlas_cells, {u: finished[u] for u in names})
    portable = sets["rectified"].buildings
    opened = {u: openings_on(workspace.read(path), finished[u]) for u, path in given.windows.items() if u in finished}
    textured = {u: with_texture_figures(finished[u], portable.get(u), given.bare.get(u, "")) for u in names}
    own = tuple(with_window_figures(b, opened.get(u), given.unseen.get(u, "")) for u, b in textured.items())
    plans = plans_of(standings.values())
    draped = (
        drape(workspace, given.orthos, task.unit, given.bounds, plans, parameters.drape_px)
        if given.textures else Draped(None)
    )  # fmt: skip
    metadata, terrain = (
        given.metadata,
        terrain_of(workspace.store, given.surfaces, given.bounds, plans, parameters.terrain),
    )
    look = (sets["rectified"] if given.textures else None, draped.drape)
    surface = (terrain.vertices, terrain.triangles)
    coarse = coarse_of(own, *surface, given.bounds, *look, workspace.read) if TILES3D in parameters.formats else None
    tile = CityTile(
        task.unit, given.bounds, own, surface, connected_parts(terrain.vertices, terrain.triangles),
        resolve(metadata.crs), metadata.title, metadata.date, metadata.attribution,
        city=given.city, drape=draped.drape, openings=opened, coarse=coarse,
        **({"raw": sets["raw"], "rectified": sets["rectified"]} if given.textures else {}),
    )  # fmt: skip
    # all of them before the first is replaced: what fails here leaves the products of before as they are
    for path, data in [file for form in parameters.formats for file in written(form, tile)]:
        workspace.publish(path, data)
    unlike = differing_walls({u: b.solids[Lod.LOD22] for u, b in finished.items()})
    finished.update({b.id: b for b in own})
    rows = {u: row_of(finished.get(u), given.hulls[u]) for u in given.own}
    workspace.write(ROWS, encode_rows(rows))
    if given.table:
        outlines = [standings[u].outline for u in given.own]
        workspace.publish(table_path(task.unit), table_of(task.unit, outlines, rows, metadata.crs))
    leave_summary(workspace, task.unit, given.bounds, rows, given.others, metadata, given.parent, coarse)
    return workspace.outcome(
        Status.DEGRADED if draped.lost else Status.DONE,
        f"terrain without ortho: {draped.lost}" if draped.lost else "",
        {"buildings": len(own), "unlike_walls": unlike, "terrain_triangles": len(terrain.triangles)},
    )


def _buildings(store: Store, given: ExportInputs, standings: Mapping[str, Standing]) -> dict[str, Building]:
    """The reconstructed hulls; of units without one a block, marked as failed, where heights are known."""
    hulls = {u: h for u, h in given.hulls.items() if h.status is not Status.REFUSED}
    unit_of = {h.path: u for u, h in hulls.items() if h.path is not None}
    found = {unit_of[path]: read_feature(data) for path, data in store.read_many(list(unit_of))}
    for unit in hulls.keys() - found.keys():
        block = failed_block(store, given.surfaces, standings[unit].outline, hulls[unit].reason)
        if block is not None:
            found[unit] = block
    return {unit: found[unit] for unit in sorted(found)}


def with_party_walls(buildings: Mapping[str, Building]) -> dict[str, Building]:
    """Buildings whose LoD2.2 walls are cut where they touch a neighbour's, with the areas of both kinds of wall."""
    cut = cut_party_walls({u: b.solids[Lod.LOD22] for u, b in buildings.items()})
    finished = {}
    for unit, building in buildings.items():
        areas = wall_areas(cut[unit])
        solids = {**building.solids, Lod.LOD22: cut[unit]}
        finished[unit] = replace(building, solids=solids).with_attributes(
            {"outer_wall_area_m2": round(areas.outer, 2), "shared_wall_area_m2": round(areas.shared, 2)}
        )
    return finished


def _parts(city: City, unit: str) -> Iterable[Node]:
    """For a district or the city: what it is merged of; over tiles, also the frames that look at them."""
    parts = city.districts.parts.get(unit, ())
    tiles = [t for t in parts if t in city.survey.lattice.tiles]
    frames = city.survey.images.tilted.units_over(tiles) if city.survey.source.kind == IMAGES else ()
    return [*((NAME, part) for part in parts), *(("frame", u) for u in frames)]


def _units_of_ring(city: City, tile: str) -> Iterable[Node]:
    return [(city.unit_stage, t) for t in city.survey.lattice.ring(tile)] if tile in city.tile_names else []


def _units_beside(city: City, tile: str) -> Iterable[Node]:
    """Of the tiles that own neighbours of its units, and models around them."""
    if tile not in city.tile_names:
        return []
    survey, own = city.survey, [city.units[u] for u in city.chosen[tile]]
    around = [t for u in own for t in tiles_around(survey, u)] if survey.textures else []
    return [(city.unit_stage, t) for t in (*(t for u in own for t in u.neighbour_tiles), *around)]


def _what_it_shows(city: City, tile: str) -> Iterable[Node]:
    """Terrain, models and pages of textures, and the ortho that lies on the terrain."""
    if tile not in city.tile_names:
        return []
    survey, own = city.survey, city.chosen[tile]
    surfaces = [("surface", t) for t in survey.lattice.ring(tile)]
    models = [*surfaces, *(("reconstruct", u) for u in _units_shown(city, tile))]
    under = [("ortho", tile)] if survey.source.kind == IMAGES else []
    looked = [("windows", u) for u in own] if windows_are_wanted(survey) else []
    atlas_cells = atlas_cells_of(city, tile) if survey.textures else ()
    return [*models, *(("atlas", atlas_cell) for atlas_cell in atlas_cells), *looked, *under]


def _units_shown(city: City, tile: str) -> list[str]:
    """Its own units and those that share walls with them."""
    own = city.chosen[tile]
    city.ask({t for u in own for t in city.units[u].neighbour_tiles}, tile)
    return list(dict.fromkeys([*own, *(n for u in own for n in city.units[u].neighbours if n in city.units)]))


def _task(city: City, unit: str) -> Task:
    if unit in city.districts.parts:
        return merge.task(city, unit)
    atlas_cells = list(atlas_cells_of(city, unit)) if city.survey.textures else []
    shown = [city.units[u] for u in _units_shown(city, unit)]
    return task(city.survey, unit, city.chosen[unit], shown, atlas_cells, merge.parent_of(city, unit))


KIND = TaskKind(NAME, VERSION, run, ExportInputs, in_place=True)

STAGE = Stage(
    name=NAME,
    unit="ground tile; merges of up to 64: districts, the city",
    place=Place.TILE,
    text=(
        "hulls of the tile and of their neighbours, pages of its atlas cells, windows of its units → party walls; CityJSON, CityGML, OBJ, 3D Tiles; "
        "terrain; STAC item; summary. Summaries → trees of tilesets, rasters and catalogs"
    ),
    kinds=(KIND, merge.KIND),
    needs=(_parts, _units_of_ring, _units_beside, _what_it_shows),
    task=_task,
    asked=City.exports,
    begins=lambda _, turn: [turn[1]] if turn[1] else (),
    count=lambda city: len(city.tiles) + len(city.districts.parts),
    parameters=(ExportParameters,),
    cost=Cost(5.0, 600.0, 4.0),
)
