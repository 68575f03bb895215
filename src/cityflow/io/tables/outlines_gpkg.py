"""``outlines.gpkg``: outlines with their edges and cut lines, units and status as layers of a GeoPackage, with every attribute in a typed column."""

from __future__ import annotations

import math
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np
import shapely
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Building, Outline, OutlineEdge, Scalar, Status
from cityflow.core.reference import Reference
from cityflow.core.splitting import CutLine, Splitting
from cityflow.io.attributes import GROUND_KEY, described, scalars
from cityflow.io.crs import horizontal_crs, vertical_datum
from cityflow.io.tables.typed_columns import Keys, columns_of

_LINE = "LineString"
_RESERVED = ("fid", "geom")
"""Names of the format's own."""
_NO_TIME = "2000-01-01T00:00:00.000Z"
"""GeoPackage wants a time of last change; the products have none."""


METRES = ("bias", "nmad", "rmse", "le95", GROUND_KEY)
"""Attributes of units that other formats name without their unit."""
DESCRIPTIONS: Mapping[str, str] = {
    "outlines": "Outlines as they were used, with what was repaired",
    "outline_edges": "Edges of outlines and walls inside them: where each comes from, standard deviation in metres, share of it that was seen",
    "roofs": "Outlines of roofs where they are known apart from the walls; overhang in square metres",
    "cut_lines": "Lines that part an outline into units, used or not, with evidence and confidence; steps and gaps in metres",
    "units": "Buildings with all attributes; names end in their unit; nmad, rmse, bias and le95 are of vertical distances of points from the roof",
    "overhangs": "Edges beyond which a roof stands out: reach and standard deviation in metres, share seen",
    "track": "Where the carrier of the camera was; times are seconds since the start of the sequence",
    "track_steps": "The same in parts from frame to frame, with the times of both; between images by how far pictures moved",
    "frames": "Frames that were taken as photographs: time, and where they look (clockwise from grid north, and below the horizon)",
    "changes": "New, gone and altered buildings of an update: differences after minus before, names end in their unit; significance in standard deviations",
    "status": "How every unit ended: done, degraded, failed or refused, with the reason",
}
"""What the layers hold, as a GIS shows it beside their names."""


@dataclass(frozen=True, slots=True)
class Layer:
    """One layer: a geometry (or None) and a row for each feature; rows need not have the same keys.

    Attributes
    ----------
    kind : of geometry, where there is no feature to tell
    """

    name: str
    geometries: Sequence[BaseGeometry | None]
    rows: Sequence[Mapping[str, Scalar]]
    kind: str = "Polygon"


def outline_layer(outlines: Iterable[Outline]) -> Layer:
    """Outlines as they were used, with what was repaired."""
    found = list(outlines)
    rows = [{"id": o.id, "remark": o.remark, **_without(scalars(o.attributes), "id", "remark")} for o in found]
    return Layer("outlines", [o.polygon for o in found], rows)


def outline_edge_layer(outlines: Iterable[Outline]) -> Layer:
    """Edges of the outlines and walls inside them, with where each comes from and how well it is known."""
    found = [(o.id, edge, inner) for o in outlines for inner in (False, True) for edge in _edges(o, inner)]
    rows: list[dict[str, Scalar]] = [
        {"outline": i, "source": e.source, "sigma_m": _known(e.sigma_m), "seen": _known(e.seen), "inner": inner}
        for i, e, inner in found
    ]
    return Layer("outline_edges", [e.line for _, e, _ in found], rows, _LINE)


def _edges(outline: Outline, inner: bool) -> tuple[OutlineEdge, ...]:
    return outline.inner_edges if inner else outline.edges


def roof_layer(outlines: Iterable[Outline]) -> Layer:
    """Outlines of the roofs where they are known apart from the walls; with the overhang, roof minus walls, in m²."""
    found = [(o, o.roof) for o in outlines if o.roof is not None]
    rows: list[dict[str, Scalar]] = [
        {"id": o.id, "overhang_m2": round(float(shapely.difference(roof, o.polygon).area), 3)} for o, roof in found
    ]
    return Layer("roofs", [roof for _, roof in found], rows)


def cut_line_layer(splittings: Iterable[tuple[str, Splitting]]) -> Layer:
    """Cut lines of each outline (by id), and the candidates that were not used: what another threshold would do."""
    found = [
        (identifier, cut, used)
        for identifier, s in splittings
        for used, cuts in ((True, s.cut_lines), (False, s.rejected))
        for cut in cuts
    ]
    return Layer("cut_lines", [c.line for _, c, _ in found], [_cut_row(i, c, used) for i, c, used in found], _LINE)


def _cut_row(outline: str, cut: CutLine, used: bool) -> dict[str, Scalar]:
    measured = ("vertical", "sloped", "height_step_m", "gap_m", "confidence", "angle_sigma_deg")
    return {
        "outline": outline,
        "kind": cut.kind,
        "used": used,
        **{name: _known(getattr(cut, name)) for name in measured},
    }


def _known(value: float) -> float | None:
    """To four decimals, beyond which no measured value means anything; None where unknown."""
    return round(float(value), 4) if math.isfinite(value) else None


def unit_layer(buildings: Iterable[Building]) -> Layer:
    """Footprints with all attributes, source's and measured ones; columns of metres end in ``_m``."""
    found = list(buildings)
    rows = [{"id": b.id, **_with_units(_without(described(b), "id"))} for b in found]
    return Layer("units", [None if b.footprint.is_empty else b.footprint for b in found], rows)


def overhang_layer(rows: Iterable[tuple[str, Sequence[float | None]]]) -> Layer:
    """Edges of units beyond which the roof stands out: x, y of both ends, reach, standard deviation (None: unknown) and share seen."""
    found = [(unit, [0.0 if v is None else float(v) for v in row], row) for unit, row in rows]
    lines = [LineString([values[0:2], values[2:4]]) for _, values, _ in found]
    attributes: list[dict[str, Scalar]] = [
        {"unit": unit, "reach_m": row[4], "sigma_m": row[5], "seen": row[6]} for unit, _, row in found
    ]
    return Layer("overhangs", lines, attributes, _LINE)


def status_layer(units: Iterable[tuple[str, BaseGeometry | None, Status, str]]) -> Layer:
    """Id, place, status and reason of every unit, also of those that left no building."""
    found = list(units)
    rows = [{"id": identifier, "status": status.value, "reason": reason} for identifier, _, status, reason in found]
    return Layer("status", [place for _, place, _, _ in found], rows)


def write_geopackage(layers: Iterable[Layer], reference: Reference) -> bytes:
    """The file's contents: the same bytes for the same layers."""
    with tempfile.TemporaryDirectory(prefix="cityflow-") as folder, _without_time():
        path = Path(folder) / "layers.gpkg"
        for number, layer in enumerate(layers):
            _write(path, layer, reference, _Shape().take(layer), append=number > 0)
        return path.read_bytes()


def write_geopackage_in_parts(path: Path, parts: Callable[[], Iterable[Sequence[Layer]]], reference: Reference) -> None:
    """Write a file of any size: one part is in memory at a time.

    Parameters
    ----------
    parts : gives the parts anew whenever it is called: once for the columns of all, once for the rows
    """
    shapes = {name: _Shape() for name in DESCRIPTIONS}
    for layers in parts():
        for layer in layers:
            shapes[layer.name].take(layer)
    known = {name: shape for name, shape in shapes.items() if shape.is_known}
    with _without_time():
        for number, (name, shape) in enumerate(known.items()):
            _write(path, Layer(name, [], []), reference, shape, append=number > 0)
        for layers in parts():
            for layer in (found for found in layers if len(found.geometries)):
                _write(path, layer, reference, known[layer.name], append=True)


@dataclass(slots=True)
class _Shape:
    """What a layer is made of: kinds of geometries, keys of its rows; `usual` is its kind where it has no feature."""

    kinds: set[str] = field(default_factory=set)
    keys: Keys = field(default_factory=Keys)
    usual: str = "Polygon"
    is_known: bool = False

    def take(self, layer: Layer) -> Self:
        """Take in a layer, or a part of it."""
        self.kinds |= {f"{g.geom_type} Z" if g.has_z else g.geom_type for g in layer.geometries if g is not None}
        self.keys.take(layer.rows)
        self.usual, self.is_known = layer.kind, True
        return self

    @property
    def geometry_type(self) -> str:
        return next(iter(self.kinds)) if len(self.kinds) == 1 else "Unknown" if self.kinds else self.usual


def _write(path: Path, layer: Layer, reference: Reference, shape: _Shape, append: bool) -> None:
    import pyogrio.raw

    columns = columns_of(layer.rows, _RESERVED, shape.keys)
    crs = horizontal_crs(reference)
    with warnings.catch_warnings():
        # a local frame has no CRS, on purpose
        warnings.filterwarnings("ignore", message="'crs' was not provided", category=UserWarning)
        pyogrio.raw.write(
            str(path),
            geometry=shapely.to_wkb(np.array(layer.geometries, dtype=object)),
            field_data=[data for _, data, _ in columns],
            field_mask=[mask for _, _, mask in columns],
            fields=[name for name, _, _ in columns],
            layer=layer.name,
            driver="GPKG",
            geometry_type=shape.geometry_type,
            crs=None if crs is None else crs.to_wkt(),
            append=append,
            layer_metadata={"VERTICAL_DATUM": vertical_datum(reference)},
            layer_options={"GEOMETRY_NAME": "geom", "FID": "fid", "DESCRIPTION": DESCRIPTIONS.get(layer.name, "")},
        )


def _with_units(row: Mapping[str, Scalar]) -> dict[str, Scalar]:
    return {f"{key}_m" if key in METRES and f"{key}_m" not in row else key: value for key, value in row.items()}


def _without(row: Mapping[str, Scalar], *own: str) -> dict[str, Scalar]:
    """A source's attribute that bears one of our names goes under ``source_…``."""
    return {f"source_{key}" if key in own else key: value for key, value in row.items()}


@contextmanager
def _without_time() -> Iterator[None]:
    import pyogrio

    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": _NO_TIME})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": before})
