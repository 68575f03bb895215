"""The last export task: what stands once for the whole city."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Building, Outline, Status
from cityflow.core.grid import Grid
from cityflow.core.splitting import Splitting
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.export_rows import read_rows
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.refused_outlines import shapes_of
from cityflow.handover.split_lines import read_splits
from cityflow.io.catalog.products_catalog import ProductFile, ProductItem, Source, products_catalog
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.cityjson_sequence import extent_of_headers, header_line, join
from cityflow.io.city_models.tiles3d import FOLDER as TILES3D
from cityflow.io.city_models.tiles3d import PORTABLE, RAW
from cityflow.io.city_models.tiles3d_tree import city_tilesets
from cityflow.io.export_formats import formats
from cityflow.io.export_formats.cityjson import FOLDER as CITYJSON_FOLDER
from cityflow.io.export_formats.tiles3d import about_tiles
from cityflow.io.globe import globe_of
from cityflow.io.rasters.raster import write_vrt
from cityflow.io.reference import resolve
from cityflow.io.tables.outlines_gpkg import (
    Layer,
    cut_line_layer,
    outline_edge_layer,
    outline_layer,
    overhang_layer,
    roof_layer,
    status_layer,
    unit_layer,
    write_geopackage,
)  # fmt: skip
from cityflow.stages import atlas
from cityflow.survey.city import CITY
from cityflow.survey.city import EXPORT as NAME
from cityflow.survey.parameters import ExportParameters
from cityflow.survey.survey import Survey

VERSION = 7
RASTERS = ("dsm", "dtm", "ortho")
TITLES = {
    "dsm": "Digital surface model", "dtm": "Digital terrain model", "ortho": "True ortho", "points": "Points with classes (LAZ)",
    **formats.TITLES, "city": formats.TITLES["cityjson"], "outlines": "Outlines, units and their status", "textures": "Pages of textures",
}  # fmt: skip


def task(survey: Survey, leaves: Mapping[str, Sequence[str]], refused: Mapping[str, str]) -> Task:
    """Join what the tiles have left, and their leaves; `refused` outlines, unit → reason, belong to no tile."""
    tiles = list(leaves)
    shapes = survey.results.refused_files() if refused else {}
    outlines = {p: d for t in tiles for p, d in survey.results.outlines_of("outline", t).items()}
    units = {p: d for t in tiles for p, d in survey.unit_files(t).items()}
    splits = {p: d for t in tiles for p, d in survey.results.split_files(t).items()}
    exports = {t: survey.results.records[NAME, t].outputs for t in tiles}
    pages = _pages(survey)
    surfaces = {
        t: {**survey.results.products_of("surface", t), **survey.results.products_of("ortho", t), **pages.get(t, {})}
        for t in tiles
    }
    return Task(
        NAME, CITY, "cityflow.stages.export.city:run", VERSION,
        parameters=survey.parameters_for(NAME, CITY, survey.parameters.export),
        inputs={
            "outlines": digest_of([outlines, units, splits]), "refused": digest_of([dict(refused), shapes]), "said": digest_of(survey.product_metadata),
            **{f"tile {t}": digest_of([dict(exports[t]), surfaces[t]]) for t in tiles},
        },
        arguments={
            "outlines": list(outlines), "units": list(units), "splits": list(splits),
            "refused": dict(refused), "refused_shapes": list(shapes), "exports": {t: dict(exports[t]) for t in tiles},
            "surfaces": surfaces, "city": list(survey.lattice.grid.bounds), "cell_m": survey.lattice.product_grid.cell,
            "ortho": {"dtype": survey.ortho_kind[1], "nodata": None, "bands": survey.ortho_kind[0] + 1},
            "tiles": {t: list(survey.lattice.tiles[t].bounds) for t in tiles}, **survey.product_metadata,
        },
        limits=survey.limits(NAME),
        in_place=True,
    )  # fmt: skip


def _pages(survey: Survey) -> dict[str, dict[str, str]]:
    """Tile → the pages of its leaves, path → digest."""
    found: dict[str, dict[str, str]] = {}
    for stage, leaf in sorted(survey.results.records):
        if stage == atlas.NAME:
            found.setdefault(leaf.rpartition(".")[0], {}).update(survey.results.products_of(stage, leaf))
    return found


def run(workspace: Workspace, task: Task) -> Outcome:
    """VRTs over the rasters, the map of outlines and units, and for a small area one CityJSON of all tiles."""
    parameters = ExportParameters.model_validate(task.parameters)
    for path, data in _rasters(task):
        workspace.publish(path, data)
    outlines, units = (
        [s.outline for p in task.arguments[kind] for s in decode_all(workspace.read(p))]
        for kind in ("outlines", "units")
    )
    exported = [p for outputs in task.arguments["exports"].values() for p in outputs]
    splits = [s for p in task.arguments["splits"] for s in read_splits(workspace.read(p))]
    rows = read_rows(workspace.store, exported)
    refused = shapes_of(workspace.read(p) for p in task.arguments["refused_shapes"])
    layers = [*_outline_layers(outlines, splits), *_unit_layers(units, rows, refused, task)]
    workspace.publish("products/outlines.gpkg", write_geopackage(layers, resolve(task.arguments["crs"])))
    paths = sorted(p for p in exported if p.startswith(CITYJSON_FOLDER))
    if paths and len(paths) <= parameters.join_up_to_tiles:
        workspace.publish("products/city.city.jsonl", b"".join(_joined(workspace, task, paths)))
    for path, data in (*_tilesets(workspace, task, exported), *_catalog(workspace, task)):
        workspace.publish(path, data)
    return workspace.outcome()


def _tilesets(workspace: Workspace, task: Task, exported: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    """The trees over the tiles' tilesets, one for each set of textures."""
    said = task.arguments
    reference = resolve(said["crs"])
    globe = globe_of(reference, tuple(said["city"]))
    transform = ExportParameters.model_validate(task.parameters).root_transform
    about = about_tiles(said["title"], said["attribution"], said["date"], reference, globe)
    for name in (PORTABLE, RAW):
        paths = sorted(p for p in exported if p.startswith(f"{TILES3D}/") and p.endswith(f"/{name}"))
        tiles = {p: workspace.read(p) for p in paths}
        yield from city_tilesets(tiles, about, name, transform if globe is None else None).items()


def _catalog(workspace: Workspace, task: Task) -> Iterator[tuple[str, bytes]]:
    """The products as a STAC catalog: an item per tile, and one for what stands once."""
    said = task.arguments
    source = Source(said["title"], licence=said["licence"], attribution=said["attribution"], date=said["date"])
    whole = {p: d for p, d in workspace.outputs.items() if p.startswith("products/")}
    groups = {CITY: (tuple(task.arguments["city"]), whole)}
    for tile, bounds in sorted(task.arguments["tiles"].items()):
        made = {**said["exports"][tile], **said["surfaces"][tile]}
        groups[tile] = (tuple(bounds), {p: d for p, d in made.items() if p.startswith("products/")})
    items = [ProductItem(name, bounds, _files(found)) for name, (bounds, found) in groups.items()]
    for path, data in products_catalog(items, source, resolve(task.arguments["crs"])).items():
        yield f"products/{path}", data


def _files(found: Mapping[str, str]) -> dict[str, ProductFile]:
    """Asset key → file: the folder's name, or the file's own where it stands alone or where the folder has several of its kind."""
    files: dict[str, ProductFile] = {}
    several = Counter(_key(path.removeprefix("products/")) for path in found)
    for path, sha256 in sorted(found.items()):
        inside = path.removeprefix("products/")
        key = _key(inside) if several[_key(inside)] == 1 else inside.replace("/", "-")
        files[key] = ProductFile(inside, TITLES.get(inside.split("/")[0].split(".")[0], inside), sha256=sha256)
    return files


def _key(inside: str) -> str:
    """Folder and ending of a file among the products; its name where it is in none."""
    return inside if "/" not in inside else f"{inside.split('/')[0]}-{inside.rsplit('.', 1)[-1]}"


def _rasters(task: Task) -> Iterator[tuple[str, bytes]]:
    reference = resolve(task.arguments["crs"])
    for name in RASTERS:
        tiles = [
            (f"{name}/{t}.tif", Grid.covering(tuple(bounds), task.arguments["cell_m"]))
            for t, bounds in sorted(task.arguments["tiles"].items())
            if f"products/{name}/{t}.tif" in task.arguments["surfaces"][t]
        ]
        if tiles:
            kind = task.arguments["ortho"] if name == "ortho" else {}
            yield f"products/{name}.vrt", write_vrt(tiles, reference, **kind)


def _joined(workspace: Workspace, task: Task, paths: Sequence[str]) -> Iterator[bytes]:
    x_min, y_min, x_max, y_max = task.arguments["city"]
    files = [workspace.read(p).splitlines(keepends=True) for p in paths]
    extent = extent_of_headers(lines[0] for lines in files)
    header = header_line(
        resolve(task.arguments["crs"]),
        extent,
        Transform.over((x_min, y_min, x_max, y_max)),
        task.arguments["title"],
        task.arguments["date"],
    )
    return join(files, header, (CITYJSON_FOLDER, "products"))


def _outline_layers(outlines: Iterable[Outline], splits: Iterable[tuple[str, Splitting]]) -> Iterator[Layer]:
    """Outlines as used; how their edges are known, their roofs and cut lines only where somebody looked for them."""
    ordered = sorted(outlines, key=lambda o: o.id)
    yield outline_layer(ordered)
    found = (outline_edge_layer(ordered), roof_layer(ordered), cut_line_layer(sorted(splits, key=lambda s: s[0])))
    yield from (layer for layer in found if len(layer.geometries))


def _unit_layers(
    units: Iterable[Outline], rows: Mapping[str, Mapping[str, Any]], refused: Mapping[str, BaseGeometry], task: Task
) -> Iterator[Layer]:
    """Units with their attributes, and the status of everything, also of what left no building."""
    ordered = sorted(units, key=lambda o: o.id)
    finished = [_unit(o, rows[o.id]) for o in ordered if o.id in rows and rows[o.id]["attributes"] is not None]
    shapes: dict[str, BaseGeometry] = {**refused, **{o.id: o.polygon for o in ordered}}
    places = {unit: _place(shape) for unit, shape in shapes.items()}
    fates = {u: (Status(row["status"]), str(row["reason"])) for u, row in rows.items()}
    fates |= {u: (Status.REFUSED, reason) for u, reason in task.arguments["refused"].items()}
    yield unit_layer(finished)
    yield overhang_layer((u, out) for u, row in sorted(rows.items()) for out in row.get("overhangs", []))
    yield status_layer([(u, places.get(u), *fate) for u, fate in sorted(fates.items())])


def _place(shape: BaseGeometry) -> BaseGeometry:
    """A point inside; what is no valid polygon has a middle, too."""
    return shape.representative_point() if shape.is_valid else shape.centroid


def _unit(outline: Outline, row: Mapping[str, Any]) -> Building:
    """A building without its solids: what a map shows of it."""
    attributes = row["attributes"]
    ground = attributes.get("ground_height_m")
    floor = float(ground) if isinstance(ground, int | float) else float("nan")
    return Building(outline.id, outline.polygon, floor, {}, (), attributes, Status(row["status"]), str(row["reason"]))
