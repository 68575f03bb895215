"""The last export task: what stands once for the whole city."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import shapely

from cityflow.core.building import Building, Outline, Status
from cityflow.core.grid import Grid
from cityflow.flow.task import Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.io.cityjson import Transform
from cityflow.io.cityjson_sequence import extent_of_headers, header_line, join
from cityflow.io.outlines_gpkg import outline_layer, status_layer, unit_layer, write_geopackage
from cityflow.io.products_catalog import ProductFile, ProductItem, Source, products_catalog
from cityflow.io.raster import write_vrt
from cityflow.io.reference import resolve
from cityflow.stages.export import CITY, STAGE
from cityflow.stages.formats import CITYJSON_FOLDER
from cityflow.stages.outline_lines import decode_all
from cityflow.stages.parameters import ExportParameters
from cityflow.stages.survey import Survey

VERSION = 1
RASTERS = ("dsm", "dtm")
TITLES = {
    "dsm": "Digital surface model", "dtm": "Digital terrain model", "cityjson": "City model (CityJSONSeq 2.0)", "city": "City model (CityJSONSeq 2.0)",
    "citygml": "City model (CityGML 2.0)", "obj": "City model (OBJ)", "outlines": "Outlines, units and their status",
}  # fmt: skip


def task(survey: Survey, tiles: Sequence[str], refused: Mapping[str, str]) -> Task:
    """Join what the tiles have left; `refused` outlines, unit → reason, belong to no tile."""
    outlines = {p: d for t in tiles for p, d in survey.outline_files(t).items()}
    records = {t: survey.records[STAGE, t] for t in tiles}
    products = {p: d for r in records.values() for p, d in r.outputs.items()}
    rasters = {p: d for t in tiles for p, d in survey.products_of("surface", t).items()}
    bare = {u: fate for r in records.values() for u, fate in r.result.get("bare", {}).items()}
    bare |= {u: {"status": str(Status.REFUSED), "reason": reason} for u, reason in refused.items()}
    return Task(
        STAGE, CITY, "cityflow.stages.export_city:run", VERSION,
        parameters=survey.parameters_for(STAGE, CITY, survey.parameters.export),
        inputs={**outlines, **products, **rasters, **{f"bare {u}": f"{f['status']}: {f['reason']}" for u, f in bare.items()}},
        arguments={
            "outlines": list(outlines), "units": {u: m for r in records.values() for u, m in r.result.get("units", {}).items()},
            "cityjson": [p for p in products if p.startswith(CITYJSON_FOLDER)], "rasters": list(rasters), "bare": bare,
            "city": list(survey.grid.bounds), "cell_m": survey.parameters.surface.cell_m,
            "tiles": {t: list(survey.tiles[t].bounds) for t in tiles},
            "crs": survey.catalog.reference.code, "title": survey.catalog.title, "date": survey.date,
            "products": {t: {**survey.products_of(STAGE, t), **survey.products_of("surface", t)} for t in tiles},
            "catalog": {"title": survey.catalog.title, "licence": survey.catalog.licence,
                        "attribution": survey.catalog.attribution, "date": survey.date},
        },
        limits=survey.limits(STAGE),
        in_place=True,
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """VRTs over the rasters, the map of outlines and units, and for a small area one CityJSON of all tiles."""
    parameters = ExportParameters.model_validate(task.parameters)
    for path, data in _rasters(task):
        workspace.publish(path, data)
    outlines = [s.outline for p in task.arguments["outlines"] for s in decode_all(workspace.read(p))]
    workspace.publish("products/outlines.gpkg", _map(outlines, task))
    paths = sorted(task.arguments["cityjson"])
    if paths and len(paths) <= parameters.join_up_to_tiles:
        workspace.publish("products/city.city.jsonl", b"".join(_joined(workspace, task, paths)))
    for path, data in _catalog(workspace, task):
        workspace.publish(path, data)
    return workspace.outcome()


def _catalog(workspace: Workspace, task: Task) -> Iterator[tuple[str, bytes]]:
    """The products as a STAC catalog: an item per tile, and one for what stands once."""
    said = task.arguments["catalog"]
    source = Source(said["title"], licence=said["licence"], attribution=said["attribution"], date=said["date"])
    whole = {p: d for p, d in workspace.outputs.items() if p.startswith("products/")}
    groups = {CITY: (tuple(task.arguments["city"]), whole)}
    for tile, bounds in sorted(task.arguments["tiles"].items()):
        groups[tile] = (tuple(bounds), task.arguments["products"].get(tile, {}))
    items = [ProductItem(name, bounds, _files(found)) for name, (bounds, found) in groups.items()]
    for path, data in products_catalog(items, source, resolve(task.arguments["crs"])).items():
        yield f"products/{path}", data


def _files(found: Mapping[str, str]) -> dict[str, ProductFile]:
    """Asset key → file: the folder's name, or the file's own where it stands alone."""
    files = {}
    for path, sha256 in sorted(found.items()):
        inside = path.removeprefix("products/")
        key = (
            inside.replace("/", "-")
            if inside.count("/") == 0
            else f"{inside.split('/')[0]}-{inside.rsplit('.', 1)[-1]}"
        )
        files[key] = ProductFile(inside, TITLES.get(inside.split("/")[0].split(".")[0], inside), sha256=sha256)
    return files


def _rasters(task: Task) -> Iterator[tuple[str, bytes]]:
    reference = resolve(task.arguments["crs"])
    for name in RASTERS:
        tiles = [
            (f"{name}/{t}.tif", Grid.covering(tuple(bounds), task.arguments["cell_m"]))
            for t, bounds in sorted(task.arguments["tiles"].items())
            if f"products/{name}/{t}.tif" in task.arguments["rasters"]
        ]
        if tiles:
            yield f"products/{name}.vrt", write_vrt(tiles, reference)


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
    return join(files, header)


def _map(outlines: Iterable[Outline], task: Task) -> bytes:
    ordered = sorted(outlines, key=lambda o: o.id)
    units: Mapping[str, Mapping[str, Any]] = task.arguments["units"]
    finished = [
        Building(o.id, o.polygon, float("nan"), {}, (), {k: v for k, v in units[o.id].items() if k not in ("status", "reason")},
                 Status(units[o.id]["status"]), units[o.id]["reason"])
        for o in ordered if o.id in units
    ]  # fmt: skip
    places = {o.id: shapely.Point(o.polygon.representative_point()) for o in ordered}
    rows = [(b.id, places[b.id], b.status, b.reason) for b in finished]
    rows += [
        (u, places.get(u), Status(fate["status"]), fate["reason"]) for u, fate in sorted(task.arguments["bare"].items())
    ]
    return write_geopackage(
        [
            outline_layer(ordered),
            unit_layer(replace(b, ground_height=_ground(b)) for b in finished),
            status_layer(rows),
        ],
        resolve(task.arguments["crs"]),
    )


def _ground(building: Building) -> float:
    height = building.attributes.get("ground_height_m")
    return float(height) if isinstance(height, int | float) else float("nan")
