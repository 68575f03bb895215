"""Manual edits of outlines and cut lines (docs/edits.md)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.grid import Bounds

REACH_M = 1.0
"""How far an edit acts beyond its own geometry."""
SMALLEST_M2 = 2.0
"""Of a unit, as buildings go: a shed for bicycles has more."""


@dataclass(frozen=True, slots=True)
class DrawnOutline:
    """A polygon that stands in the place of what was found there.

    Attributes
    ----------
    polygon : valid, world metres
    id : of the unit; empty where the person gave none
    locked : it is never split
    """

    polygon: Polygon
    id: str = ""
    locked: bool = False


@dataclass(frozen=True, slots=True)
class SetRoofType:
    """The roof of the unit at a place is of this type, by the names of `core.roof_type_names`; `place` is a point or a polygon."""

    place: BaseGeometry
    roof_type: str

    def names(self, polygon: Polygon) -> bool:
        """Whether it is of a unit: its point stands in the outline, or its polygon covers half of it."""
        if self.place.geom_type == "Point":
            return bool(shapely.intersects(polygon, self.place))
        return bool(shapely.intersection(self.place, polygon).area >= 0.5 * polygon.area)

    def may_name(self, bounds: Bounds) -> bool:
        """Whether it may be of a unit with these bounds: what covers less than half of the smallest building of the box does not."""
        box = shapely.box(*bounds)
        if self.place.geom_type == "Point":
            return bool(shapely.intersects(box, self.place))
        return bool(shapely.intersection(self.place, box).area >= 0.5 * SMALLEST_M2)


@dataclass(frozen=True, slots=True)
class Edits:
    """All edits of a survey, or of a part of it.

    Attributes
    ----------
    outlines : drawn ones, the locked first
    cut_lines : straight lines to cut along
    no_cut_lines : cut lines found along these are not used
    rejected : points or polygons where no building stands
    roof_types : what a person knows of roofs
    notes : what a user should know about the file that they come from
    """

    outlines: tuple[DrawnOutline, ...] = ()
    cut_lines: tuple[LineString, ...] = ()
    no_cut_lines: tuple[LineString, ...] = ()
    rejected: tuple[BaseGeometry, ...] = ()
    notes: tuple[str, ...] = ()
    roof_types: tuple[SetRoofType, ...] = ()

    def __len__(self) -> int:
        return sum(map(len, (self.outlines, self.cut_lines, self.no_cut_lines, self.rejected, self.roof_types)))

    def roof_type_of(self, polygon: Polygon) -> str:
        """What was set for a unit: by a point in it, or by a polygon over most of it; empty where nothing was, the last where several were."""
        found = [r.roof_type for r in self.roof_types if r.names(polygon)]
        return found[-1] if found else ""

    @property
    def locked(self) -> tuple[Polygon, ...]:
        return tuple(o.polygon for o in self.outlines if o.locked)

    @property
    def of_outlines(self) -> Edits:
        """Those that say which outlines there are; without the notes, as the next."""
        return Edits(outlines=self.outlines, rejected=self.rejected)

    @property
    def of_splits(self) -> Edits:
        """Those that say how an outline is split: lines, and outlines that never are."""
        return Edits(outlines=self.outlines, cut_lines=self.cut_lines, no_cut_lines=self.no_cut_lines)

    @property
    def of_units(self) -> Edits:
        """Those that say which units of an outline stand."""
        return Edits(rejected=self.rejected)

    def within(self, bounds: Bounds) -> Edits:
        """Those that act somewhere in a box."""
        return self.near(shapely.box(*bounds)) if len(self) else NO_EDITS

    def near(self, place: BaseGeometry) -> Edits:
        """Those that act somewhere on a geometry; without the notes."""
        if not len(self):
            return NO_EDITS
        return replace(
            self,
            outlines=tuple(o for o in self.outlines if shapely.dwithin(o.polygon, place, REACH_M)),
            cut_lines=tuple(g for g in self.cut_lines if shapely.dwithin(g, place, REACH_M)),
            no_cut_lines=tuple(g for g in self.no_cut_lines if shapely.dwithin(g, place, REACH_M)),
            rejected=tuple(g for g in self.rejected if shapely.dwithin(g, place, REACH_M)),
            roof_types=tuple(r for r in self.roof_types if shapely.dwithin(r.place, place, REACH_M)),
            notes=(),
        )

    def lines(self) -> list[str]:
        """One line of text for each edit, bit for bit; `from_lines` reads them."""
        return [json.dumps([kind, name, shapely.to_wkb(shape, hex=True)]) for kind, name, shape in self._features()]

    @classmethod
    def from_lines(cls, lines: list[str]) -> Edits:
        """The edits that `lines` wrote."""
        split = [json.loads(line) for line in lines]
        shapes = {kind: [shapely.from_wkb(wkb) for k, _, wkb in split if k == kind] for kind in _KINDS}
        drawn = [DrawnOutline(shapely.from_wkb(w), name, k == "locked") for k, name, w in split if k in _KINDS[:2]]
        roofs = [SetRoofType(shapely.from_wkb(wkb), name) for kind, name, wkb in split if kind == _ROOF]
        return cls(
            tuple(drawn),
            tuple(shapes["cut"]),
            tuple(shapes["no cut"]),
            tuple(shapes["rejected"]),
            roof_types=tuple(roofs),
        )

    def _features(self) -> Iterator[tuple[str, str, BaseGeometry]]:
        for drawn in self.outlines:
            yield _KINDS[0 if drawn.locked else 1], drawn.id, drawn.polygon
        for kind, shapes in zip(_KINDS[2:], (self.cut_lines, self.no_cut_lines, self.rejected), strict=True):
            for shape in shapes:
                yield kind, "", shape
        for roof in self.roof_types:
            yield _ROOF, roof.roof_type, roof.place


NO_EDITS = Edits()

_ROOF = "roof type"
_KINDS = ("locked", "outline", "cut", "no cut", "rejected")


def edits_digest(edits: Edits, place: BaseGeometry | Bounds) -> str:
    """Hash of the edits that act on a polygon or a box; empty where none does.

    A task that carries it runs again only where an edit was added, changed or taken away under it, whatever else the file
    holds. The order in the file counts: of two drawn outlines that overlap, the first wins.
    """
    lines = (edits.near(place) if isinstance(place, BaseGeometry) else edits.within(place)).lines()
    return hashlib.sha256("\n".join(lines).encode()).hexdigest() if lines else ""


def as_outline(polygon: Polygon) -> Polygon:
    """A drawn polygon as outlines are: flat, exterior counter-clockwise, vertices multiples of 0.1 mm."""
    flat = shapely.transform(shapely.force_2d(polygon), lambda xy: np.round(xy, 4) + 0.0)
    return shapely.orient_polygons(shapely.remove_repeated_points(flat), exterior_cw=False)
