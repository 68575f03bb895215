"""What a small city has as one file: the map of outlines and units, and the city model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Building, Outline, Status
from cityflow.core.grid import Bounds
from cityflow.core.splitting import Splitting
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.handover.export_rows import read_rows
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.handover.refused_outlines import shapes_of
from cityflow.handover.split_lines import read_splits
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.cityjson_sequence import extent_of_headers, header_line, join
from cityflow.io.crs import resolve
from cityflow.io.export_formats.cityjson import FOLDER as CITYJSON_FOLDER
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

MAP, MODEL = "products/outlines.gpkg", "products/city.city.jsonl"


@dataclass(frozen=True, slots=True)
class JoinInputs(TaskInputs):
    """What is written as one file.

    Attributes
    ----------
    outlines, units, splits : RUN-relative paths;  exported : of what the exports of the tiles have left
    """

    outlines: tuple[str, ...]
    units: tuple[str, ...]
    splits: tuple[str, ...]
    exported: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Refused(TaskInputs):
    """Outlines that cannot be buildings: outline or unit → why; RUN-relative paths of their polygons."""

    reasons: Mapping[str, str]
    shapes: tuple[str, ...]

    def read_shapes(self, store: Store) -> dict[str, BaseGeometry]:
        """Id → polygon, of those that are one."""
        return dict(shapes_of(data for _, data in store.read_many(self.shapes)))


def write_joined(
    workspace: Workspace, given: JoinInputs, refused: Refused, metadata: ProductMetadata, bounds: Bounds
) -> None:
    """The map as a GeoPackage, and one CityJSONSeq where the tiles have some."""
    workspace.publish(MAP, write_geopackage(map_layers(workspace.store, given, refused), resolve(metadata.crs)))
    paths = sorted(p for p in given.exported if p.startswith(CITYJSON_FOLDER))
    if paths:
        workspace.publish(MODEL, b"".join(_lines(workspace, paths, metadata, bounds)))


def map_layers(store: Store, given: JoinInputs, refused: Refused) -> list[Layer]:
    """The layers of the map."""
    outlines, units = (
        [s.outline for _, data in store.read_many(paths) for s in decode_all(data)]
        for paths in (given.outlines, given.units)
    )
    splits = [s for _, data in store.read_many(given.splits) for s in read_splits(data)]
    rows = read_rows(store, given.exported)
    return [*_outline_layers(outlines, splits), *_unit_layers(units, rows, refused.read_shapes(store), refused.reasons)]


def _lines(workspace: Workspace, paths: Sequence[str], metadata: ProductMetadata, bounds: Bounds) -> Iterator[bytes]:
    files = [workspace.read(p).splitlines(keepends=True) for p in paths]
    extent = extent_of_headers(lines[0] for lines in files)
    header = header_line(resolve(metadata.crs), extent, Transform.over(bounds), metadata.title, metadata.date)
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
    finished = [unit_of(o, rows[o.id]) for o in ordered if o.id in rows and rows[o.id]["attributes"] is not None]
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


def unit_of(outline: Outline, row: Mapping[str, Any]) -> Building:
    """A building without its solids: what a map shows of it."""
    attributes = row["attributes"]
    ground = attributes.get("ground_height_m")
    floor = float(ground) if isinstance(ground, int | float) else float("nan")
    return Building(outline.id, outline.polygon, floor, {}, (), attributes, Status(row["status"]), str(row["reason"]))
