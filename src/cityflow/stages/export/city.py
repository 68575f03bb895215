"""The last export task: what stands once for the whole city."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Building, Outline, Status
from cityflow.core.grid import Bounds, Grid
from cityflow.core.splitting import Splitting
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.export_rows import read_rows
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.handover.refused_outlines import shapes_of
from cityflow.handover.split_lines import read_splits
from cityflow.io.catalog.products_catalog import ProductFile, ProductItem, Source, products_catalog
from cityflow.io.catalog.stac_assets import RASTERS
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.cityjson_sequence import extent_of_headers, header_line, join
from cityflow.io.city_models.tiles3d import FOLDER as TILES3D
from cityflow.io.city_models.tiles3d import PORTABLE, RAW
from cityflow.io.city_models.tiles3d_tree import city_tilesets
from cityflow.io.crs import resolve
from cityflow.io.export_formats import formats
from cityflow.io.export_formats.cityjson import FOLDER as CITYJSON_FOLDER
from cityflow.io.export_formats.tiles3d import about_tiles
from cityflow.io.globe import globe_of
from cityflow.io.rasters.raster import write_vrt
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
from cityflow.survey.city import CITY
from cityflow.survey.city import EXPORT as NAME
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import ExportParameters

VERSION = 7
ATLAS = "atlas"
TITLES = {
    "dsm": "Digital surface model", "dtm": "Digital terrain model", "ortho": "True ortho", "points": "Points with classes (LAZ)",
    **formats.TITLES, "city": formats.TITLES["cityjson"], "outlines": "Outlines, units and their status", "textures": "Pages of textures",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class TileProducts(TaskInputs):
    """A tile: its bounds in metres; RUN-relative path → digest of what its export has left, and of its rasters, points and pages."""

    bounds: Bounds
    exported: Mapping[str, str]
    others: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class CityInputs(TaskInputs):
    """What the tiles have left.

    Attributes
    ----------
    outlines, units, splits : RUN-relative paths
    refused : outline or unit → why;  refused_shapes : RUN-relative paths of their polygons
    tiles : by name
    bounds : of the grid of all tiles, metres;  cell_m : of the rasters
    ortho_bands, ortho_dtype : of the true ortho, without the band that says where it has a colour
    """

    outlines: tuple[str, ...]
    units: tuple[str, ...]
    splits: tuple[str, ...]
    refused: Mapping[str, str]
    refused_shapes: tuple[str, ...]
    tiles: Mapping[str, TileProducts]
    bounds: Bounds
    cell_m: float
    ortho_bands: int
    ortho_dtype: str
    metadata: ProductMetadata

    @property
    def exported(self) -> list[str]:
        """Paths of what all exports have left."""
        return [path for tile in self.tiles.values() for path in tile.exported]


def task(survey: Survey, atlas_cells: Mapping[str, Sequence[str]], refused: Mapping[str, str]) -> Task:
    """Join what the tiles have left, and their atlas cells; `refused` outlines, unit → reason, belong to no tile."""
    tiles = list(atlas_cells)
    shapes = survey.results.refused_files() if refused else {}
    outlines = {p: d for t in tiles for p, d in survey.results.outlines_of("outline", t).items()}
    units = {p: d for t in tiles for p, d in survey.unit_files(t).items()}
    splits = {p: d for t in tiles for p, d in survey.results.split_files(t).items()}
    pages = _pages(survey)
    products = {
        t: TileProducts(
            survey.lattice.tiles[t].bounds,
            survey.results.outputs_of(NAME, t),
            {**survey.results.products_of("surface", t), **survey.results.products_of("ortho", t), **pages.get(t, {})},
        )
        for t in tiles
    }
    metadata = digest_of(as_json(survey.product_metadata))
    return Task(
        NAME, CITY, "cityflow.stages.export.city:run", VERSION,
        parameters=as_json(survey.parameters_of(NAME, CITY, survey.parameters.export)),
        inputs={
            "outlines": digest_of([outlines, units, splits]), "refused": digest_of([dict(refused), shapes]), "said": metadata,
            **{f"tile {t}": digest_of([dict(p.exported), p.others]) for t, p in products.items()},
        },
        arguments=as_json(CityInputs(
            tuple(outlines), tuple(units), tuple(splits), refused, tuple(shapes), products, survey.lattice.grid.bounds, survey.lattice.product_grid.cell,
            *survey.ortho_kind, survey.product_metadata,
        )),
        limits=survey.limits(NAME),
        in_place=True,
    )  # fmt: skip


def _pages(survey: Survey) -> dict[str, dict[str, str]]:
    """Tile → the pages of its atlas cells, path → digest."""
    found: dict[str, dict[str, str]] = {}
    for atlas_cell in sorted(survey.results.of_stage(ATLAS)):
        found.setdefault(atlas_cell.rpartition(".")[0], {}).update(survey.results.products_of(ATLAS, atlas_cell))
    return found


def run(workspace: Workspace, task: Task) -> Outcome:
    """VRTs over the rasters, the map of outlines and units, and for a small area one CityJSON of all tiles."""
    given, parameters = task.arguments_as(CityInputs), task.parameters_as(ExportParameters)
    for path, data in _rasters(given):
        workspace.publish(path, data)
    outlines, units = (
        [s.outline for p in paths for s in decode_all(workspace.read(p))] for paths in (given.outlines, given.units)
    )
    splits = [s for p in given.splits for s in read_splits(workspace.read(p))]
    rows = read_rows(workspace.store, given.exported)
    shapes = shapes_of(workspace.read(p) for p in given.refused_shapes)
    layers = [*_outline_layers(outlines, splits), *_unit_layers(units, rows, shapes, given.refused)]
    workspace.publish("products/outlines.gpkg", write_geopackage(layers, resolve(given.metadata.crs)))
    paths = sorted(p for p in given.exported if p.startswith(CITYJSON_FOLDER))
    if paths and len(paths) <= parameters.join_up_to_tiles:
        workspace.publish("products/city.city.jsonl", b"".join(_joined(workspace, given, paths)))
    for path, data in (*_tilesets(workspace, given, parameters), *_catalog(workspace, given)):
        workspace.publish(path, data)
    return workspace.outcome()


def _tilesets(workspace: Workspace, given: CityInputs, parameters: ExportParameters) -> Iterator[tuple[str, bytes]]:
    """The trees over the tiles' tilesets, one for each set of textures."""
    metadata = given.metadata
    reference = resolve(metadata.crs)
    globe = globe_of(reference, given.bounds)
    about = about_tiles(metadata.title, metadata.attribution, metadata.date, reference, globe)
    for name in (PORTABLE, RAW):
        paths = sorted(p for p in given.exported if p.startswith(f"{TILES3D}/") and p.endswith(f"/{name}"))
        tiles = {p: workspace.read(p) for p in paths}
        yield from city_tilesets(tiles, about, name, parameters.root_transform if globe is None else None).items()


def _catalog(workspace: Workspace, given: CityInputs) -> Iterator[tuple[str, bytes]]:
    """The products as a STAC catalog: an item per tile, and one for what stands once."""
    metadata = given.metadata
    source = Source(metadata.title, licence=metadata.licence, attribution=metadata.attribution, date=metadata.date)
    groups: dict[str, tuple[Bounds, Mapping[str, str]]] = {CITY: (given.bounds, workspace.outputs)}
    groups |= {name: (tile.bounds, {**tile.exported, **tile.others}) for name, tile in sorted(given.tiles.items())}
    items = [ProductItem(name, bounds, _files(found)) for name, (bounds, found) in groups.items()]
    for path, data in products_catalog(items, source, resolve(metadata.crs)).items():
        yield f"products/{path}", data


def _files(found: Mapping[str, str]) -> dict[str, ProductFile]:
    """Asset key → product: the folder's name, or the file's own where it stands alone or where the folder has several of its kind."""
    files: dict[str, ProductFile] = {}
    products = {p.removeprefix("products/"): d for p, d in sorted(found.items()) if p.startswith("products/")}
    several = Counter(map(_key, products))
    for inside, sha256 in products.items():
        key = _key(inside) if several[_key(inside)] == 1 else inside.replace("/", "-")
        files[key] = ProductFile(inside, TITLES.get(inside.split("/")[0].split(".")[0], inside), sha256=sha256)
    return files


def _key(inside: str) -> str:
    """Folder and ending of a file among the products; its name where it is in none."""
    return inside if "/" not in inside else f"{inside.split('/')[0]}-{inside.rsplit('.', 1)[-1]}"


def _rasters(given: CityInputs) -> Iterator[tuple[str, bytes]]:
    reference = resolve(given.metadata.crs)
    for name in RASTERS:
        tiles = [
            (f"{name}/{t}.tif", Grid.covering(tile.bounds, given.cell_m))
            for t, tile in sorted(given.tiles.items())
            if f"products/{name}/{t}.tif" in tile.others
        ]
        if tiles and name == "ortho":
            vrt = write_vrt(tiles, reference, dtype=given.ortho_dtype, nodata=None, bands=given.ortho_bands + 1)
            yield f"products/{name}.vrt", vrt
        elif tiles:
            yield f"products/{name}.vrt", write_vrt(tiles, reference)


def _joined(workspace: Workspace, given: CityInputs, paths: Sequence[str]) -> Iterator[bytes]:
    files, metadata = [workspace.read(p).splitlines(keepends=True) for p in paths], given.metadata
    extent = extent_of_headers(lines[0] for lines in files)
    header = header_line(resolve(metadata.crs), extent, Transform.over(given.bounds), metadata.title, metadata.date)
    return join(files, header, (CITYJSON_FOLDER, "products"))


def _outline_layers(outlines: Iterable[Outline], splits: Iterable[tuple[str, Splitting]]) -> Iterator[Layer]:
    """Outlines as used; how their edges are known, their roofs and cut lines only if searched."""
    ordered = sorted(outlines, key=lambda o: o.id)
    yield outline_layer(ordered)
    found = (outline_edge_layer(ordered), roof_layer(ordered), cut_line_layer(sorted(splits, key=lambda s: s[0])))
    yield from (layer for layer in found if len(layer.geometries))


def _unit_layers(
    units: Iterable[Outline],
    rows: Mapping[str, Mapping[str, Any]],
    refused_shapes: Mapping[str, BaseGeometry],
    refused: Mapping[str, str],
) -> Iterator[Layer]:
    """Units with their attributes, and the status of everything, also of what left no building."""
    ordered = sorted(units, key=lambda o: o.id)
    finished = [_unit(o, rows[o.id]) for o in ordered if o.id in rows and rows[o.id]["attributes"] is not None]
    shapes: dict[str, BaseGeometry] = {**refused_shapes, **{o.id: o.polygon for o in ordered}}
    places = {unit: _place(shape) for unit, shape in shapes.items()}
    fates = {u: (Status(row["status"]), str(row["reason"])) for u, row in rows.items()}
    fates |= {u: (Status.REFUSED, reason) for u, reason in refused.items()}
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
