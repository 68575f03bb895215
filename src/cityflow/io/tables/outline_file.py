"""A file of building outlines, read part after part, with what is known of it as a whole."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.tables.feature_ids import ids_of, listing, notes_on_ids
from cityflow.io.tables.vector import (
    MULTIPOLYGON,
    NO_GEOMETRY,
    Layer,
    kinds_of,
    listed_kinds,
    parts_of_layer,
    placing,
)  # fmt: skip


def read_outlines(
    path: str | Path, id_column: str | None, id_format: str | None, target: Reference, layer: str | None = None
) -> tuple[list[Outline], list[str]]:
    """Building outlines in the world frame, one per feature and in the file's order.

    Nothing is repaired or left out here: a multipolygon stays one, a missing geometry becomes an empty polygon, so that
    cleaning (`outlines.given.given`) can account for every feature.

    Parameters
    ----------
    id_column : column that holds the ids; None leaves them empty
    id_format : Python format of an id, such as ``{:016d}`` or ``house-{}``; None takes values as they are
    target : reference of the result; another CRS is reprojected to it

    Returns
    -------
    outlines, notes : what was read, and what a user should know about it

    Raises
    ------
    CatalogError
        Where the file is unreadable, holds something else than polygons, or the id column or format does not fit.
    """
    file = OutlineFile.open(path, id_column, id_format, target, layer)
    return [o for part in file.parts() for o in part], file.notes


@dataclass(frozen=True, slots=True)
class OutlineFile:
    """A file of outlines that may be larger than memory: what is known of it as a whole, and its outlines part after part.

    Attributes
    ----------
    path, layer, id_column, id_format : as in `read_outlines`
    move : coordinates (N, 2) of the file → of the world frame; None where these are the same
    notes : what a user should know about it
    """

    path: str
    layer: str | None
    id_column: str | None
    id_format: str | None
    move: Callable[[FloatArray], FloatArray] | None
    notes: list[str]

    @classmethod
    def open(
        cls, path: str | Path, id_column: str | None, id_format: str | None, target: Reference, layer: str | None = None
    ) -> OutlineFile:
        """Read it once from end to end. Raises as `read_outlines`."""
        facts = _Facts(str(path), layer or "")
        for part in parts_of_layer(path, layer):
            facts.add(part, ids_of(part, id_column, id_format))
        facts.refuse_unless_polygons()
        move, notes = placing(facts.path, facts.crs, facts.bounds, target)
        notes = notes + (notes_on_ids(facts.ids) if id_column is not None else []) + facts.notes()
        return cls(str(path), layer, id_column, id_format, move, notes)

    def parts(self) -> Iterator[list[Outline]]:
        """Its outlines in the file's order, up to `ROWS` at a time."""
        for part in parts_of_layer(self.path, self.layer):
            ids = ids_of(part, self.id_column, self.id_format)
            geometry = part.geometry if self.move is None else shapely.transform(part.geometry, self.move)
            rows = [dict(zip(part.columns, values, strict=True)) for values in zip(*part.columns.values(), strict=True)]
            yield [Outline(*of) for of in zip(ids, _polygons(geometry), rows or [{} for _ in geometry], strict=True)]


@dataclass(slots=True)
class _Facts:
    """What the parts of a layer tell together."""

    path: str
    name: str
    crs: CRS | None = None
    bounds: Bounds = (math.nan, math.nan, math.nan, math.nan)
    ids: list[str] = field(default_factory=list)
    kinds: Counter[str] = field(default_factory=Counter)
    lost: list[int] = field(default_factory=list)
    endless: dict[int, float] = field(default_factory=dict)
    several: int = 0

    def add(self, part: Layer, ids: list[str]) -> None:
        row = len(self.ids)
        self.path, self.name, self.crs = part.path, part.name, part.crs
        low, high = np.fmin(self.bounds, part.bounds), np.fmax(self.bounds, part.bounds)
        self.bounds = float(low[0]), float(low[1]), float(high[2]), float(high[3])
        self.ids += ids
        self.kinds.update(kinds_of(part.geometry))
        nothing = shapely.is_missing(part.geometry) | shapely.is_empty(part.geometry)
        self.lost += (row + np.flatnonzero(nothing)).tolist()
        self.endless |= {row + i: value for i, value in part.endless.items()}
        multi = shapely.get_type_id(part.geometry) == MULTIPOLYGON
        self.several += int((multi & (shapely.get_num_geometries(part.geometry) > 1)).sum())

    def refuse_unless_polygons(self) -> None:
        if not self.kinds["Polygon"] + self.kinds["MultiPolygon"]:
            problem = f"no polygon in layer {self.name!r}; it holds {listed_kinds(self.kinds)}"
            raise CatalogError(problem, where=self.path, remedy="name a layer or a file of polygons")

    def notes(self) -> list[str]:
        notes, names = [], self.ids
        if self.endless:
            told = listing(f"{names[i] or f'feature {i + 1}'}: {value}" for i, value in self.endless.items())
            count = len(self.endless)
            notes.append(f"outlines with a coordinate that is no finite number: {count} ({told}); they count as empty")
        if lost := [names[i] or f"feature {i + 1}" for i in self.lost if i not in self.endless]:
            notes.append(f"outlines without geometry: {len(lost)} ({listing(lost)})")
        wrong = Counter({k: n for k, n in self.kinds.items() if k not in ("Polygon", "MultiPolygon", NO_GEOMETRY)})
        if wrong:
            notes.append(f"outlines must be polygons; these are not: {listed_kinds(wrong)}")
        if self.several:
            notes.append(f"outlines of several parts: {self.several}; each part becomes a unit of its own")
        return notes


def _polygons(geometry: NDArray[np.object_]) -> list[Any]:
    """Exteriors counter-clockwise, a multipolygon of one part as that part, and an empty polygon for none."""
    single = (shapely.get_type_id(geometry) == MULTIPOLYGON) & (shapely.get_num_geometries(geometry) == 1)
    simple = np.where(single, shapely.get_geometry(geometry, 0), geometry)
    return [Polygon() if g is None else g for g in shapely.orient_polygons(simple)]
