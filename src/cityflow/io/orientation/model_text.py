"""Lines and numbers of text files that other programs write; what is wrong is told with file, line and value."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from cityflow.core.arrays import FloatArray
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import nearest_rotation
from cityflow.io.given_files import MODEL_MB, check_plain


class MatrixRows(StrEnum):
    """What the rows of a matrix with nine numbers are: the axes of the photograph (x right, y up, z backward) in the world, or the transpose."""

    PHOTO_AXES = "photo-axes"
    WORLD_AXES = "world-axes"

    def photo_from_world(self, values: Sequence[float]) -> FloatArray:
        """(3, 3) rotation of nine numbers, row by row; raises ValueError where they are none."""
        matrix = nearest_rotation(np.array(values, np.float64).reshape(3, 3))
        return matrix if self is MatrixRows.PHOTO_AXES else np.asarray(matrix.T)


def read_lines(path: str | Path, remedy: str) -> list[str]:
    """Lines of a text file, without their ends; a byte-order mark goes.

    Raises
    ------
    CatalogError
        Where it is missing or no plain file.
    """
    check_plain(path, MODEL_MB)
    try:
        return Path(path).read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise CatalogError(f"the file cannot be read ({error})", where=str(path), remedy=remedy) from error


def numbers(fields: Sequence[str], count: int, what: str) -> list[float]:
    """The first `count` fields as finite numbers.

    Raises
    ------
    ValueError
        Where there are fewer, or one is no number; the message names it.

    Examples
    --------
    >>> numbers(["1.5", "2e3", "x"], 2, "a point")
    [1.5, 2000.0]
    """
    if len(fields) < count:
        raise ValueError(f"{what} has {len(fields)} numbers instead of {count}")
    values = []
    for field in fields[:count]:
        try:
            value = float(field)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise ValueError(f"{field!r} in {what} is no number")
        values.append(value)
    return values


def file_name(path: str) -> str:
    r"""Last part of a path of any system.

    >>> file_name(r"D:\flight 3\img_01.tif")
    'img_01.tif'
    """
    return path.strip().strip('"').replace("\\", "/").rsplit("/", 1)[-1]


def stated_crs(text: str, target: CRS | None) -> tuple[str | None, tuple[str, ...]]:
    """WKT of the CRS that a file states, None where it is not known; and a note where the catalog has another.

    Parameters
    ----------
    text : WKT, or a code
    target : the catalog's, None for a local frame
    """
    try:
        found = CRS.from_user_input(text.strip())
    except CRSError:
        return None, ()
    if target is None:
        return found.to_wkt(), ()
    ours, theirs = (c.sub_crs_list[0] if c.is_compound else c for c in (target, found))
    same = ours.equals(theirs, ignore_axis_order=True) or (
        ours.to_epsg(min_confidence=50) is not None
        and ours.to_epsg(min_confidence=50) == theirs.to_epsg(min_confidence=50)
    )
    note = f"the orientation states {theirs.name}, the catalog {ours.name}; its coordinates are taken as they are → check --crs"
    return found.to_wkt(), () if same else (note,)
