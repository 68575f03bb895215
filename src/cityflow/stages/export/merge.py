"""Merges of exports: a district of its tiles or smaller districts, in the end the city; from their summaries alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from cityflow.core.building import Status
from cityflow.core.grid import Bounds, Grid
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.coarse_files import COARSE, decode_coarse, encode_coarse
from cityflow.handover.export_rows import ROWS
from cityflow.handover.export_summary import SUMMARY, Summary, added, around, decode_summary, encode_summary, first_of
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.io.catalog.products_catalog import COLLECTION, city_files, district_file, district_path, item_path
from cityflow.io.catalog.stac_assets import RASTERS
from cityflow.io.city_models.tiles3d import PORTABLE, RAW
from cityflow.io.city_models.tiles3d_tree import TileRoot, tree_over
from cityflow.io.crs import resolve
from cityflow.io.export_formats.tiles3d import about_tiles
from cityflow.io.globe import globe_of
from cityflow.io.rasters.raster import write_vrt
from cityflow.stages.export.far_contents import FarContents
from cityflow.stages.export.items import PRODUCTS, item_of, source_of
from cityflow.stages.export.joined_products import JoinInputs, Refused, write_joined
from cityflow.stages.export.metadata_inputs import metadata_inputs
from cityflow.stages.export.table import index_of, index_path, refused_index, table_path
from cityflow.survey.city import EXPORT as NAME
from cityflow.survey.city import City
from cityflow.survey.districts import CITY
from cityflow.survey.results import Results
from cityflow.survey.survey_parameters import ExportParameters

VERSION = 12
NOBODY = Refused({}, ())


@dataclass(frozen=True, slots=True)
class MergeInputs(TaskInputs):
    """What is merged.

    Attributes
    ----------
    parts : tile or district → RUN-relative path of its summary; empty where it left none
    coarse : those of the parts that left what they look like from far away → RUN-relative path of it
    tiles : those of the parts that are tiles: name → bounds, metres;  rasters : raster → those of them that have it
    bounds : of all tiles, metres;  cell_m : of the rasters
    ortho_bands, ortho_dtype : of the true ortho, without the band that says where it has a colour
    parent : path of the catalog that a district hangs on
    tables : RUN-relative paths of the tiles' tables of units; none in a small city
    joined : what a small city writes as one file;  refused : for the city, what belongs to no tile
    """

    parts: Mapping[str, str]
    coarse: Mapping[str, str]
    tiles: Mapping[str, Bounds]
    rasters: Mapping[str, tuple[str, ...]]
    bounds: Bounds
    cell_m: float
    ortho_bands: int
    ortho_dtype: str
    metadata: ProductMetadata
    parent: str
    tables: tuple[str, ...]
    joined: JoinInputs | None
    refused: Refused


def parent_of(city: City, name: str) -> str:
    """Path of the catalog that a tile or a district hangs on."""
    above = city.districts.parent.get(name, CITY)
    return COLLECTION if above == CITY else district_path(above)


def task(city: City, unit: str) -> Task:
    """Merge what the parts of a district, or of the city, have left."""
    survey = city.survey
    parts = {name: summary_of(survey.results, name) for name in city.districts.parts[unit]}
    coarse = {name: _left(survey.results, name, COARSE) for name in parts}
    tiles = {name: survey.lattice.tiles[name].bounds for name in parts if name in survey.lattice.tiles}
    rasters = {r: tuple(t for t in tiles if _has(survey.results, r, t)) for r in RASTERS}
    tables = {t: d for t in tiles if (d := survey.results.outputs_of(NAME, t).get(table_path(t)))}
    joined, refused, once = _once(city) if unit == CITY else (None, NOBODY, "")
    parent, cell_m = parent_of(city, unit), survey.lattice.product_grid.cell
    metadata = survey.product_metadata()
    return KIND.task(
        unit, parameters=as_json(survey.parameters_of(NAME, unit, survey.parameters.export)),
        inputs={
            **{f"part {name}": digest for name, (_, digest) in parts.items()},
            **{f"far {name}": digest for name, (path, digest) in coarse.items() if path},
            "rasters": digest_of([rasters, cell_m, *survey.ortho_kind]), **metadata_inputs(survey, metadata),
            **({"bounds": digest_of(survey.lattice.bounds)} if unit == CITY else {}),
            **{what: digest for what, digest in (("tables", digest_of(tables) if tables else ""), ("once", once)) if digest},
            **({"parent": parent} if parent != COLLECTION else {}),
        },
        given=MergeInputs(
            {name: path for name, (path, _) in parts.items()}, {name: path for name, (path, _) in coarse.items() if path},
            tiles, rasters, survey.lattice.bounds, cell_m,
            *survey.ortho_kind, metadata, parent, tuple(map(table_path, tables)), joined, refused,
        ),
        limits=survey.limits(NAME),
    )  # fmt: skip


def summary_of(results: Results, unit: str) -> tuple[str, str]:
    """Path and digest of the summary of a tile or district; an empty path where it left none."""
    return _left(results, unit, SUMMARY)


def _left(results: Results, unit: str, file: str) -> tuple[str, str]:
    found = results.outputs_of(NAME, unit)
    return next(((p, d) for p, d in found.items() if p.endswith(f"/{file}")), ("", "missing"))


def _has(results: Results, raster: str, tile: str) -> bool:
    path = f"{PRODUCTS}{raster}/{tile}.tif"
    return path in results.outputs_of("ortho" if raster == "ortho" else "surface", tile)


def _once(city: City) -> tuple[JoinInputs | None, Refused, str]:
    """What stands once for the whole city, and its digest; nothing is joined in a city of many tiles."""
    survey, tiles, results = city.survey, city.tiles, city.survey.results
    reasons = results.refused_outlines() if city.area.is_everywhere else {}
    shapes = results.refused_files() if reasons else {}
    refused = Refused(reasons, tuple(shapes))
    if len(tiles) > survey.parameters.export.join_up_to_tiles:
        return None, refused, digest_of([reasons, shapes]) if reasons else ""
    outlines = {p: d for t in tiles for p, d in results.outlines_of("outline", t).items()}
    units = {p: d for t in tiles for p, d in survey.unit_files(t).items()}
    splits = {p: d for t in tiles for p, d in results.split_files(t).items()}
    endings = f"/{ROWS}", ".city.jsonl"
    exported = {p: d for t in tiles for p, d in results.outputs_of(NAME, t).items() if p.endswith(endings)}
    joined = JoinInputs(tuple(outlines), tuple(units), tuple(splits), tuple(exported))
    return joined, refused, digest_of([outlines, units, splits, exported, reasons, shapes])


def run(workspace: Workspace, task: Task) -> Outcome:
    """VRTs over the rasters, tilesets over the tiles, the catalog; for a small city the map and one CityJSON."""
    given, parameters = task.arguments_as(MergeInputs), task.parameters_as(ExportParameters)
    is_city = task.unit == CITY
    paths = {path: name for name, path in given.parts.items() if path}
    parts = {paths[p]: decode_summary(data, p) for p, data in workspace.store.read_many(sorted(paths))}
    mosaics = _mosaics(given, parts)
    for path, data in _rasters(task.unit, given, mosaics):
        workspace.publish(path, data)
    if given.joined is not None:
        write_joined(workspace, given.joined, given.refused, given.metadata, given.bounds)
    for path, data in _indexes(workspace, task.unit, given):
        workspace.publish(path, data)
    roots = _tilesets(workspace, task.unit, given, parts, parameters)
    bounds = given.bounds if is_city else around([*(p.bounds for p in parts.values()), *given.tiles.values()])
    box = _catalog(workspace, task.unit, given, parts, bounds)
    summary = Summary(
        task.unit, bounds, sum(p.tiles for p in parts.values()), added(p.counts for p in parts.values()), box, roots,
        {raster: around(found.values()) for raster, found in mosaics.items()}, first_of(w for p in parts.values() for w in p.worst),
    )  # fmt: skip
    workspace.write(SUMMARY, encode_summary(summary))
    return workspace.outcome()


def _indexes(workspace: Workspace, unit: str, given: MergeInputs) -> Iterator[tuple[str, bytes]]:
    """Of the units of the tiles, and where nothing else tells of them, of refused outlines."""
    crs = given.metadata.crs
    if given.tables:
        yield index_path(unit), index_of(workspace.store, given.tables, crs)
    if given.refused.reasons and given.joined is None:
        shapes = given.refused.read_shapes(workspace.store)
        yield index_path(str(Status.REFUSED)), refused_index(given.refused.reasons, shapes, crs)


def _mosaics(given: MergeInputs, parts: Mapping[str, Summary]) -> dict[str, dict[str, Bounds]]:
    """Raster → file beside which the merged one stands → its bounds."""
    found: dict[str, dict[str, Bounds]] = {}
    for raster in RASTERS:
        tiles = {f"{raster}/{t}.tif": given.tiles[t] for t in given.rasters[raster]}
        below = {f"{raster}/{n}.vrt": p.mosaics[raster] for n, p in parts.items() if raster in p.mosaics}
        if tiles or below:
            found[raster] = tiles | below
    return found


def _rasters(unit: str, given: MergeInputs, mosaics: Mapping[str, Mapping[str, Bounds]]) -> Iterator[tuple[str, bytes]]:
    """A VRT for each raster: over files in its folder, where that of a district stands, too."""
    reference, is_city = resolve(given.metadata.crs), unit == CITY
    for raster, files in mosaics.items():
        grids = [(p if is_city else p.split("/")[1], Grid.covering(b, given.cell_m)) for p, b in sorted(files.items())]
        path = f"{PRODUCTS}{raster}.vrt" if is_city else f"{PRODUCTS}{raster}/{unit}.vrt"
        if raster == "ortho":
            yield path, write_vrt(grids, reference, given.ortho_dtype, nodata=None, bands=given.ortho_bands + 1)
        else:
            yield path, write_vrt(grids, reference)


def _tilesets(
    workspace: Workspace, unit: str, given: MergeInputs, parts: Mapping[str, Summary], parameters: ExportParameters
) -> dict[str, TileRoot]:
    """The tilesets over those of the parts, one for each set of textures: written, and as the merge above sees them."""
    metadata = given.metadata
    reference = resolve(metadata.crs)
    globe = globe_of(reference, given.bounds)
    about = about_tiles(metadata.title, metadata.attribution, metadata.date, reference, globe)
    transform = parameters.root_transform if globe is None and unit == CITY else None
    part_of = {path: name for name, path in given.coarse.items()}
    left = {part_of[p]: decode_coarse(data) for p, data in workspace.store.read_many(sorted(part_of))}
    far = FarContents(unit, left, globe, metadata.attribution, workspace.publish)
    found: dict[str, TileRoot] = {}
    for name in (PORTABLE, RAW):
        roots = {n: p.roots[name] for n, p in parts.items() if name in p.roots}
        file = name if unit == CITY else name.replace("tileset", unit, 1)
        tree = tree_over(roots.values(), about, file, transform, far.over({root.uri: n for n, root in roots.items()}))
        if tree is not None:
            found[name] = tree.root
            for path, data in tree.files.items():
                workspace.publish(path, data)
        whole = far.whole(roots)
        if name == PORTABLE and whole is not None:
            workspace.write(COARSE, encode_coarse(whole))
    return found


def _catalog(
    workspace: Workspace, unit: str, given: MergeInputs, parts: Mapping[str, Summary], bounds: Bounds
) -> tuple[float, ...] | None:
    """Item of what stands here once, and the catalog of the parts; returns the box over all items."""
    source = source_of(given.metadata)
    own = item_of(unit, bounds, workspace.outputs, given.metadata, COLLECTION if unit == CITY else district_path(unit))
    items = [own.path, *(item_path(name) for name in sorted(parts) if name in given.tiles)]
    districts = [district_path(name) for name in sorted(parts) if name not in given.tiles]
    boxes = [box for box in (own.box, *(p.box for p in parts.values())) if box is not None]
    made = (
        city_files(items, districts, boxes, source)
        if unit == CITY
        else dict([district_file(unit, items, districts, source, given.parent)])
    )
    for path, data in {**made, own.path: own.data}.items():
        workspace.publish(f"{PRODUCTS}{path}", data)
    return _box_over(boxes)


def _box_over(boxes: Iterable[tuple[float, ...]]) -> tuple[float, ...] | None:
    """West, south, east, north over several."""
    known = [(w, s, e, n) for w, s, e, n in boxes]
    return around(known) if known else None


KIND = TaskKind(NAME, VERSION, run, MergeInputs, in_place=True)
