"""The file of edits: a GeoPackage with a layer for each kind (docs/edits.md)."""

from __future__ import annotations

import difflib
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from cityflow.core.edits import DrawnOutline, Edits, SetRoofType, as_outline
from cityflow.core.reference import Reference
from cityflow.core.roof_type_names import RoofType
from cityflow.errors import CatalogError
from cityflow.io.fetch import local_file
from cityflow.io.tables.feature_ids import format_id
from cityflow.io.tables.vector import Layer, read_layer, to_reference

OUTLINES, CUT_LINES, NO_CUT_LINES, LOCKED, REJECTED, ROOF_TYPES = LAYERS = (
    "outlines", "cut_lines", "no_cut_lines", "locked", "rejected", "roof_types",
)  # fmt: skip
ID_COLUMN, TYPE_COLUMN = "id", "roof_type"

_KINDS: Mapping[str, tuple[str, ...]] = {
    OUTLINES: ("Polygon",), CUT_LINES: ("LineString",), NO_CUT_LINES: ("LineString",),
    LOCKED: ("Polygon",), REJECTED: ("Point", "Polygon"), ROOF_TYPES: ("Point", "Polygon"),
}  # fmt: skip
_BEND_M = 0.1
"""A line that a person means to be straight bends less."""
_SHORTEST_M = 0.1
"""Shorter lines, and smaller areas, are slips of the hand."""
_SMALLEST_M2 = 0.1


ONE_LIBRARY = threading.RLock()
"""GDAL and Python have an SQLite each, and two in one process do not see each other's locks: whoever reads or writes a file of edits holds this."""


def read_edits(href: str, target: Reference) -> Edits:
    """All edits of a file, in the world frame.

    Parameters
    ----------
    href : path or URL of a GeoPackage; its layers are `LAYERS`, all optional. Tables without geometry are passed over
    target : reference of the result; another CRS is reprojected to it

    Raises
    ------
    CatalogError
        Where the file is missing or unreadable, has a layer of another name or none, or a feature of the wrong kind,
        without extent, crossing itself, or (a cut line) not straight.
    """
    with ONE_LIBRARY:
        found = [read_layer(href, name) for name in _layers(href)]
    notes: list[str] = []
    drawn: dict[str, list[tuple[str, BaseGeometry]]] = {name: [] for name in LAYERS}
    for layer in found:
        if not any(g is not None and not g.is_empty for g in layer.geometry):
            continue
        geometry, remarks = to_reference(layer, target)
        notes += [f"layer {layer.name} of {note}" for note in remarks]
        drawn[layer.name] = _features(layer, geometry, TYPE_COLUMN if layer.name == ROOF_TYPES else ID_COLUMN)
    shapes = {layer: tuple(g for _, g in features) for layer, features in drawn.items()}
    outlines = [DrawnOutline(g, name, layer == LOCKED) for layer in (LOCKED, OUTLINES) for name, g in drawn[layer]]
    roofs = tuple(SetRoofType(g, known_type(href, name)) for name, g in drawn[ROOF_TYPES])
    edits = Edits(tuple(outlines), shapes[CUT_LINES], shapes[NO_CUT_LINES], shapes[REJECTED], tuple(notes), roofs)
    return edits if len(edits) else Edits(notes=(*notes, f"{href} holds no edit"))


def _layers(href: str) -> list[str]:
    import pyogrio
    from pyogrio.errors import DataSourceError

    remedy = f"name the layers {', '.join(LAYERS)}"
    if "://" not in href and not Path(href).is_file():
        raise CatalogError(
            "the file of edits is not there", where=href,
            remedy="put it back; or run the workflow with another edits.path, or with an empty one for no edits",
        )  # fmt: skip
    with local_file(href) as path:
        try:
            rows = pyogrio.list_layers(path).tolist()
        except DataSourceError as error:
            raise CatalogError(f"the edits cannot be read ({error})", where=href, remedy="give a GeoPackage") from error
    names = [str(name) for name, kind in rows if kind is not None]
    if not names:
        raise CatalogError("the file of edits has no layer with geometries", where=href, remedy=remedy)
    for name in names:
        if name not in LAYERS:
            near = difflib.get_close_matches(name, LAYERS, n=1)
            advice = f"did you mean {near[0]!r}?" if near else f"{remedy}; keep other layers in another file"
            raise CatalogError(f"edits know no layer {name!r}", where=href, remedy=advice)
    return sorted(names, key=LAYERS.index)


ROOFS = tuple(t.value for t in RoofType if t is not RoofType.UNKNOWN)
"""Types that a person may give a roof."""


def known_type(href: str, name: str) -> str:
    """The roof type of that name. Raises CatalogError where there is none."""
    if name not in ROOFS:
        near = difflib.get_close_matches(name, ROOFS, n=1)
        advice = f"did you mean {near[0]!r}?" if near else f"column {TYPE_COLUMN} takes {', '.join(ROOFS)}"
        raise CatalogError(f"layer {ROOF_TYPES} knows no roof type {name!r}", where=href, remedy=advice)
    return name


def _features(layer: Layer, geometry: NDArray[np.object_], column: str) -> list[tuple[str, BaseGeometry]]:
    """What a column says (id, roof type) and the geometry of each part that is not empty."""
    values = layer.columns.get(column, [None] * len(geometry))
    result = []
    for number, (value, shape) in enumerate(zip(values, geometry, strict=True), 1):
        parts = [p for p in shapely.get_parts(shape) if not p.is_empty] if shape is not None else []
        for k, part in enumerate(parts, 1):
            name = format_id(value, None)
            numbered = name and len(parts) > 1 and column == ID_COLUMN
            result.append((f"{name}-{k}" if numbered else name, _checked(layer, number, part)))
    _refuse_repeated(layer, [name for name, _ in result if name])
    return result


def _refuse_repeated(layer: Layer, names: list[str]) -> None:
    repeated = sorted(name for name, n in Counter(names).items() if n > 1)
    if repeated and layer.name in (OUTLINES, LOCKED):
        raise CatalogError(
            f"the id {repeated[0]!r} occurs more than once in layer {layer.name}", where=layer.path,
            remedy="give every outline an id of its own, or leave the column empty",
        )  # fmt: skip


def _checked(layer: Layer, number: int, shape: BaseGeometry) -> BaseGeometry:
    """A feature fit for use, on the lattice."""

    def refuse(problem: str, remedy: str) -> CatalogError:
        return CatalogError(f"feature {number} of layer {layer.name} {problem}", where=layer.path, remedy=remedy)

    return checked(layer.name, shape, refuse)


Refuse = Callable[[str, str], CatalogError]
"""What is wrong with a shape, and what to do → the error."""


def checked(layer: str, shape: BaseGeometry, refuse: Refuse) -> BaseGeometry:
    """A shape as a layer takes it, on the lattice. Raises what `refuse` makes where it is of another kind, without extent, crossing itself, or a bent line."""
    wanted = _KINDS[layer]
    if shape.geom_type not in wanted:
        raise refuse(f"is a {shape.geom_type}", f"draw it as {' or '.join(wanted)}")
    if not np.isfinite(shapely.get_coordinates(shape)).all():
        raise refuse("has a coordinate that is no number", "draw it again")
    if shape.geom_type == "Polygon":
        return _checked_polygon(shape, refuse)
    return _checked_line(shape, refuse) if shape.geom_type == "LineString" else shapely.force_2d(shape)


def _checked_polygon(shape: BaseGeometry, refuse: Refuse) -> BaseGeometry:
    if not shape.is_valid:
        raise refuse(f"is no valid polygon ({shapely.is_valid_reason(shape)})", "fix it with “Fix geometries”")
    if shape.area < _SMALLEST_M2:
        raise refuse(f"has an area of {shape.area:.3f} m²", "draw it larger or delete it")
    rounded = as_outline(shape)
    if not rounded.is_valid:
        raise refuse("has vertices nearer to each other than 0.1 mm", "simplify it")
    return rounded


def _checked_line(shape: BaseGeometry, refuse: Refuse) -> BaseGeometry:
    xy = shapely.get_coordinates(shape)
    straight = LineString(xy[[0, -1]])
    if straight.length < _SHORTEST_M:
        raise refuse(f"has a length of {straight.length:.3f} m", "draw it longer or delete it")
    bend = float(shapely.distance(shapely.points(xy), straight).max())
    if bend > _BEND_M:
        raise refuse(
            f"is not straight (it bends by {bend:.2f} m)",
            f"draw straight lines, or the units as polygons in layer {OUTLINES} or {LOCKED}",
        )
    return straight
