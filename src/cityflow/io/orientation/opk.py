"""Tables of projection centres and angles: omega-phi-kappa, phi-omega-kappa or yaw-pitch-roll, a line for each image."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import AngleUnit, RotationOrder, from_angles
from cityflow.io.given_files import MODEL_MB, check_plain
from cityflow.io.orientation.camera_table import CameraTable, read_camera_table
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile, choice

COMMENTS = ("#", "//", "%")
SYNONYMS: dict[str, tuple[str, ...]] = {
    "name": ("name", "image", "imagename", "filename", "file", "label", "photo", "photoid", "imageid", "id"),
    "x": ("x", "east", "easting", "xc", "x0", "e", "perspectivex"),
    "y": ("y", "north", "northing", "yc", "y0", "n", "perspectivey"),
    "z": ("z", "height", "altitude", "alt", "zc", "z0", "h", "elevation", "perspectivez"),
    "omega": ("omega", "om", "w", "omegadeg", "omegagrad"), "phi": ("phi", "ph", "p", "phideg", "phigrad"),
    "kappa": ("kappa", "kp", "k", "kappadeg", "kappagrad"),
    "yaw": ("yaw", "heading", "yawdeg"), "pitch": ("pitch", "pitchdeg"), "roll": ("roll", "rolldeg"),
    "camera": ("camera", "cameraid", "cam", "sensor"),
}  # fmt: skip
"""What columns are called, small letters and digits only."""
REMEDY = "name the columns with --columns, e.g. name=0,x=1,y=2,z=3,omega=4,phi=5,kappa=6 or name=Image,x=Easting,…"


@dataclass(frozen=True, slots=True)
class OpkTable:
    """How a table is to be read.

    Attributes
    ----------
    path : CSV or text; cameras : see `io.orientation.camera_table`
    columns : field → name or position (from 0); where empty, the header's names or the usual order
    unit : of the angles;  order : what they mean and in which order they act
    """

    path: Path
    cameras: Path
    columns: Mapping[str, str | int]
    unit: AngleUnit = AngleUnit.DEGREE
    order: RotationOrder = RotationOrder.OMEGA_PHI_KAPPA

    @property
    def angles(self) -> tuple[str, ...]:
        return tuple(self.order.value.split("-"))


def parsed_columns(text: str) -> dict[str, str | int]:
    """``name=0,x=1`` or ``name=Image,x=Easting`` as a mapping.

    Raises
    ------
    CatalogError
        Where it is no such list, or a field is unknown.
    """
    result: dict[str, str | int] = {}
    for part in filter(None, (p.strip() for p in text.split(","))):
        field, separator, column = (p.strip() for p in part.partition("="))
        if not separator or field not in SYNONYMS or not column:
            known = ", ".join(SYNONYMS)
            raise CatalogError(
                f"{part!r} names no column", where="--columns", remedy=f"write field=column; fields: {known}"
            )
        result[field] = int(column) if column.isdigit() else column
    return result


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`: the table with what the options ``cameras``, ``columns``, ``angle_unit`` and ``rotation_order`` say of it."""
    cameras, options = given.options.get("cameras"), given.options
    if cameras is None:
        raise CatalogError(
            "a table of angles needs its cameras", where=str(given.path), remedy="name them with --cameras FILE"
        )
    unit = choice(AngleUnit, options, "angle_unit", AngleUnit.DEGREE)
    order = choice(RotationOrder, options, "rotation_order", RotationOrder.OMEGA_PHI_KAPPA)
    return read_opk(OpkTable(given.path, Path(cameras), parsed_columns(options.get("columns", "")), unit, order))


def read_opk(table: OpkTable) -> OrientationModel:
    """The images of a table.

    Lines that cannot be read, and images without a camera, are left out by name.

    Raises
    ------
    CatalogError
        Where the table or its cameras are missing, or columns cannot be told.
    """
    cameras = read_camera_table(table.cameras)
    check_plain(table.path, MODEL_MB)
    try:
        lines = table.path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise CatalogError(
            f"the table cannot be read ({error})", where=str(table.path), remedy="check --opk"
        ) from error
    rows, header, comma = _rows(lines)
    places = _places(table, header, rows)
    notes = _unit_doubt(table, [fields for _, fields in rows], places, comma)
    images: list[OrientedImage] = []
    left_out: list[LeftOut] = []
    pixel_mm: dict[str, float] = {}
    for number, fields in rows:
        name = fields[places["name"]] if places["name"] < len(fields) else f"line {number}"
        try:
            image, camera_id = _image(name, fields, places, table, cameras, comma)
        except ValueError as error:
            left_out.append(LeftOut(name, f"line {number}: {error}", "fix the table, or name the camera"))
            continue
        images.append(image)
        if camera_id in cameras.pixel_mm:
            pixel_mm[name] = cameras.pixel_mm[camera_id]
    kept, twice = in_order(images)
    return OrientationModel(kept, left_out=(*left_out, *twice), notes=notes, pixel_mm=pixel_mm)


def _rows(lines: Sequence[str]) -> tuple[list[tuple[int, list[str]]], list[str], bool]:
    """Numbered rows of fields, the header's fields (empty where there is none), and whether decimals have a comma."""
    plain = [(i, line.strip()) for i, line in enumerate(lines, 1) if line.strip()]
    data = [(i, line) for i, line in plain if not line.startswith(COMMENTS)]
    pattern, comma = _delimiter([line for _, line in data])
    rows = [(i, _split(line, pattern)) for i, line in data]
    header: list[str] = []
    if rows and not any(_is_number(f, comma) for f in rows[0][1][1:]):
        header = rows.pop(0)[1]
    elif rows:
        above = [line.lstrip("#/% ") for i, line in plain if i < rows[0][0] and line.startswith(COMMENTS)]
        names = {n for several in SYNONYMS.values() for n in several}
        for line in above:
            fields = _split(line, pattern)
            if len(fields) == len(rows[0][1]) and sum(_plain(f) in names for f in fields) >= 4:
                header = fields
    return rows, header, comma


def _delimiter(lines: Sequence[str]) -> tuple[str, bool]:
    """Pattern of the sign that gives seven fields at least in most lines, and whether decimals have a comma."""
    sample = lines[:50]
    for pattern in (r"\s*\t\s*", r"\s*;\s*", r"\s*,\s*", r"\s+"):
        counts = [len(re.split(pattern, line)) for line in sample]
        if counts and np.median(counts) >= 7:
            decimal = "," not in pattern and sum(bool(re.search(r"\d,\d", line)) for line in sample) > len(sample) / 2
            return pattern, decimal
    return r"\s+", False


def _split(line: str, pattern: str) -> list[str]:
    return [field.strip().strip('"') for field in re.split(pattern, line)]


def _places(table: OpkTable, header: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> dict[str, int]:
    """Field → position; by the column map, else by the header's names, else in the usual order."""
    plain = [_plain(h) for h in header]
    wanted = ("name", "x", "y", "z", *table.angles)
    places: dict[str, int] = {}
    for field in (*wanted, "camera"):
        given = table.columns.get(field)
        if isinstance(given, int):
            places[field] = given
        elif given is not None:
            if _plain(given) not in plain:
                problem = f"no column {given!r}; there are: {', '.join(header) or 'none with a name'}"
                raise CatalogError(problem, where=str(table.path), remedy=REMEDY)
            places[field] = plain.index(_plain(given))
        else:
            named = [n for n in SYNONYMS[field] if n in plain]
            places |= {field: plain.index(named[0])} if named else {}
    if not header and not table.columns:
        places = {field: i for i, field in enumerate(wanted)}
    missing = [field for field in wanted if field not in places]
    if missing or not rows:
        problem = f"columns not found: {', '.join(missing)}" if missing else "the table has no line with an image"
        raise CatalogError(problem, where=str(table.path), remedy=REMEDY)
    return places


def _image(
    name: str, fields: Sequence[str], places: Mapping[str, int], table: OpkTable, cameras: CameraTable, comma: bool
) -> tuple[OrientedImage, str]:
    if max(i for f, i in places.items() if f != "camera") >= len(fields):
        raise ValueError(f"it has {len(fields)} columns")
    x, y, z = (_number(fields[places[f]], comma) for f in ("x", "y", "z"))
    first, second, third = (_number(fields[places[f]], comma) * table.unit.radians for f in table.angles)
    given = fields[places["camera"]] if places.get("camera", len(fields)) < len(fields) else ""
    return cameras.image(name, given, from_angles(first, second, third, table.order), np.array([x, y, z]))


def _unit_doubt(
    table: OpkTable, rows: Sequence[Sequence[str]], places: Mapping[str, int], comma: bool
) -> tuple[str, ...]:
    """Angles beyond a full turn of the unit that they are said to be in."""
    texts = [row[places[f]] for row in rows for f in table.angles if places[f] < len(row)]
    largest = max((abs(_number(t, comma)) for t in texts if _is_number(t, comma)), default=0.0)
    if largest * table.unit.radians <= 2 * np.pi * 1.001:
        return ()
    likely = AngleUnit.GRAD if largest <= 400.4 and table.unit is AngleUnit.DEGREE else AngleUnit.DEGREE
    advice = f"name the unit with --angle-unit {likely}" if likely is not table.unit else "check the columns"
    return (f"{table.path.name}: angles of up to {largest:g} are more than a full turn in {table.unit}s → {advice}",)


def _number(text: str, comma: bool) -> float:
    value = float(text.replace(",", ".") if comma else text)
    if not np.isfinite(value):
        raise ValueError(f"{text!r} is no number")
    return value


def _is_number(text: str, comma: bool) -> bool:
    try:
        _number(text, comma)
    except ValueError:
        return False
    return True


def _plain(text: str) -> str:
    """Small letters and digits; units in brackets go."""
    return re.sub(r"[^a-z0-9]", "", re.sub(r"[\[(].*?[\])]", "", text.lower()))
