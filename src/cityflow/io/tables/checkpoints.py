"""Points of known position: tables with X, Y, Z, or any vector format with three coordinates."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from pyproj import CRS

from cityflow.core.arrays import FloatArray
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import contradiction, crs_of, horizontal_crs, horizontal_transform, transformed
from cityflow.io.fetch import local_file

TABLES = (".csv", ".txt", ".tsv", ".dat")
AXES = {
    "x": ("x", "east", "easting", "e", "rechtswert"),
    "y": ("y", "north", "northing", "n", "hochwert"),
    "z": ("z", "height", "h", "elevation", "altitude", "hoehe"),
}
NAMES = ("id", "name", "point", "number", "nr", "label")
TYPES = ("kind", "type", "class")
REMEDY = "give a CSV with a header line that names X, Y and Z, or points with heights in a vector format"


@dataclass(frozen=True, slots=True)
class Checkpoints:
    """(N,) names and kinds (empty where the file has none), and (N, 3) float64 world metres."""

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    xyz: FloatArray


def read_checkpoints(path: str, target: Reference) -> Checkpoints:
    """Points in the world frame, in the order of the file.

    A column ``kind`` (or type, class) groups them. Coordinates of a table are taken to be those of `target`.

    Raises
    ------
    CatalogError
        The file cannot be read, names no coordinates, or has something else than numbers in them; no CRS leads to `target`.
    """
    with local_file(path) as local:
        table = Path(path.rsplit("?", 1)[0]).suffix.lower() in TABLES
        found = _of_table(path, Path(local)) if table else _of_layer(path, Path(local), target)
    if not len(found.xyz):
        raise CatalogError("no points", where=path, remedy=REMEDY)
    return found


def _of_table(path: str, local: Path) -> Checkpoints:
    try:
        text = local.read_text(encoding="utf-8-sig")
        dialect = csv.Sniffer().sniff(text.splitlines()[0], delimiters=",;\t ") if text.strip() else csv.excel
        rows = [row for row in csv.reader(io.StringIO(text), dialect) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CatalogError(f"cannot be read as a table ({error})", where=path, remedy=REMEDY) from error
    header = [cell.strip() for cell in rows[0]] if rows else []
    places = [_place(header, AXES[axis], path, axis.upper()) for axis in "xyz"]
    xyz = np.array([[_number(path, n, row, k) for k in places] for n, row in enumerate(rows[1:], start=2)], np.float64)
    names, kinds = (_texts(rows[1:], _find(header, wanted)) for wanted in (NAMES, TYPES))
    return Checkpoints(names, kinds, xyz.reshape(-1, 3))


def _find(header: Sequence[str], wanted: Sequence[str]) -> int | None:
    lower = [name.lower().removesuffix("_m").removesuffix("[m]").strip() for name in header]
    return next((lower.index(name) for name in wanted if name in lower), None)


def _place(header: Sequence[str], wanted: Sequence[str], path: str, axis: str) -> int:
    found = _find(header, wanted)
    if found is None:
        named = ", ".join(header) or "nothing"
        raise CatalogError(f"no column {axis}; the header has: {named}", where=path, remedy=REMEDY)
    return found


def _number(path: str, line: int, row: Sequence[str], place: int) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise CatalogError(
            f"line {line}: {text!r} is no coordinate", where=path, remedy="write metres with a decimal point"
        )
    return value


def _texts(rows: Sequence[Sequence[str]], place: int | None) -> tuple[str, ...]:
    return tuple("" if place is None or place >= len(row) else row[place].strip() for row in rows)


def _of_layer(path: str, local: Path, target: Reference) -> Checkpoints:
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError

    try:
        meta, table = pyogrio.read_arrow(local)
    except (DataSourceError, DataLayerError) as error:
        raise CatalogError(f"cannot be read ({error})", where=path, remedy=REMEDY) from error
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    geometry = shapely.from_wkb(table.column(meta["geometry_name"] or "wkb_geometry").to_numpy(zero_copy_only=False))
    if (shapely.get_type_id(geometry) != 0).any():
        raise CatalogError("not every feature is a point", where=path, remedy=REMEDY)
    xyz = np.column_stack([shapely.get_x(geometry), shapely.get_y(geometry), _heights(path, geometry, columns)])
    if not np.isfinite(xyz).all():
        raise CatalogError("not every point has three coordinates", where=path, remedy=REMEDY)
    names, kinds = (_values(columns, wanted) for wanted in (NAMES, TYPES))
    return Checkpoints(names, kinds, _in_reference(path, xyz, meta["crs"], target))


def _heights(path: str, geometry: np.ndarray, columns: dict[str, list[object]]) -> FloatArray:
    if shapely.has_z(geometry).all():
        return np.asarray(shapely.get_z(geometry), np.float64)
    column = [*columns][_place([*columns], AXES["z"], path, "Z")]
    try:
        return np.array([float(str(value)) for value in columns[column]], np.float64)
    except ValueError as error:
        raise CatalogError(f"column {column}: {error}", where=path, remedy="write heights as numbers") from error


def _values(columns: dict[str, list[object]], wanted: Sequence[str]) -> tuple[str, ...]:
    place = _find([*columns], wanted)
    count = len(next(iter(columns.values()), []))
    return ("",) * count if place is None else tuple("" if v is None else str(v) for v in [*columns.values()][place])


def _in_reference(path: str, xyz: FloatArray, crs: str | None, target: Reference) -> FloatArray:
    """X and Y in the world frame; heights are left as they are, a datum apart is said by the residuals."""
    source = CRS.from_user_input(crs) if crs else None
    if source is None or source.is_engineering or target.is_local or crs_of(target) is None:
        return xyz
    horizontal = source.sub_crs_list[0] if source.is_compound else source
    if horizontal == horizontal_crs(target) or not contradiction(target, source):
        return xyz
    moved = transformed(horizontal_transform(horizontal, target), xyz[:, :2])
    if not np.isfinite(moved).all():
        raise CatalogError(
            f"not every point lies where {target.name} holds", where=path, remedy="check the points' CRS"
        )
    return np.column_stack([moved, xyz[:, 2]])
