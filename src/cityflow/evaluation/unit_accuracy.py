"""Found cut lines and single units against true ones (Dahlke 2017 §3): hits, misses, false alarms, accuracy.

**Counted** are borders between units that lie in one outline, since only those are to be cut: a border along which the outlines are apart
already is neither a hit nor a miss. The two sides of a gap count as two borders. A found line hits at most one border and a border is hit by at most
one line; pairs are chosen within an outline so that as many as possible are hit, then with the least distance. A line hits a border if it runs within
`position_m` of at least `covered` of its length, and their directions differ by no more than `angle_deg`. What hits nothing is a false alarm, unless
it runs along a border that is not counted.

Sensitivity is hits / (hits + misses). The share of false alarms is that of all found lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from pydantic import Field
from scipy.optimize import linear_sum_assignment
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.evaluation.unit_borders import TRACES, Border, angle_between, main_direction

_HALF = 0.5
"""A unit is at home where more than half of it lies."""
_STEP_M = 0.25
"""Spacing of the places along a border."""
_NEVER = 1e6
"""Beyond every cost."""
SAME_UNIT = 0.7
"""A unit with a larger intersection over union is the true one; set by hand."""
UNMARKED = "none"


class UnitsParameters(Parameters):
    """When a found line is a true one."""

    position_m: float = Field(1.0, gt=0, le=10, description="largest distance between a line and its border, metres")
    angle_deg: float = Field(10.0, gt=0, le=90, description="largest angle between them, degrees")
    covered: float = Field(0.5, gt=0, le=1, description="least share of the border's length that the line runs along")


@dataclass(frozen=True, slots=True)
class Hit:
    """A found line and the border that it is.

    Attributes
    ----------
    line, border : positions in the sequences given
    position_m : median distance of points of the border from the line
    angle_deg : between both
    """

    line: int
    border: int
    position_m: float
    angle_deg: float


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How many of some borders were hit."""

    hits: int
    borders: int

    @property
    def share(self) -> float:
        return self.hits / self.borders if self.borders else float("nan")


@dataclass(frozen=True, slots=True)
class UnitsAccuracy:
    """How well outlines were split.

    Attributes
    ----------
    hits : pairs of lines and borders
    missed : positions of the counted borders that no line hits
    false_alarms : positions of the lines that hit nothing
    apart : positions of the borders that are not counted, since no outline joins their units
    void : positions of the lines that run along those
    all_borders : of all counted borders
    traced : of those with any trace, or without a word of it;  by_trace : of those with each of `TRACES`, and ``none``
    unit_iou : (U,) greatest IoU of each true unit in the outlines with any found one
    units_missing : true units that no outline covers to the half
    """

    hits: tuple[Hit, ...]
    missed: tuple[int, ...]
    false_alarms: tuple[int, ...]
    apart: tuple[int, ...]
    void: tuple[int, ...]
    all_borders: Sensitivity
    traced: Sensitivity
    by_trace: dict[str, Sensitivity] = field(default_factory=dict)
    unit_iou: FloatArray = field(default_factory=lambda: np.empty(0))
    units_missing: int = 0

    @property
    def lines(self) -> int:
        """Found lines that are judged."""
        return len(self.hits) + len(self.false_alarms)

    @property
    def false_share(self) -> float:
        return len(self.false_alarms) / self.lines if self.lines else 0.0

    @property
    def position_m(self) -> float:
        """Median over the hits."""
        return _median(np.array([h.position_m for h in self.hits]))

    @property
    def angle_deg(self) -> float:
        """Median over the hits."""
        return _median(np.array([h.angle_deg for h in self.hits]))

    @property
    def iou_mean(self) -> float:
        return float(self.unit_iou.mean()) if len(self.unit_iou) else float("nan")

    @property
    def same_share(self) -> float:
        """Share of the true units with an IoU over 0.7."""
        return float((self.unit_iou > SAME_UNIT).mean()) if len(self.unit_iou) else float("nan")


@dataclass(frozen=True, slots=True)
class FoundUnits:
    """What is judged.

    Attributes
    ----------
    outlines : that were to be split;  units : they were split into;  lines : of the cuts
    """

    outlines: Sequence[Polygon]
    units: Sequence[Polygon]
    lines: Sequence[LineString]


def compare_units(
    found: FoundUnits, units: Sequence[Polygon], borders: Sequence[Border], parameters: UnitsParameters | None = None
) -> UnitsAccuracy:
    """Judge cut lines and units.

    Parameters
    ----------
    found : all in world metres
    units : true ones;  borders : between them (`borders.borders_of`), their traces if known
    parameters : when a line is a border
    """
    p = parameters or UnitsParameters()
    home = _homes(units, found.outlines)
    pairs = np.array([home[list(b.units)] for b in borders], np.int64).reshape(-1, 2)
    counted = (pairs[:, 0] == pairs[:, 1]) & (pairs[:, 0] >= 0)
    host = _line_homes(found.lines, found.outlines)
    hits: list[Hit] = []
    for outline in np.unique(host).tolist():
        here, wanted = np.flatnonzero(host == outline), np.flatnonzero(counted & (pairs[:, 0] == outline))
        hits += _matched(found.lines, borders, (here, wanted), p)
    lines_hit, borders_hit = {h.line for h in hits}, {h.border for h in hits}
    apart = np.flatnonzero(~counted)
    left = [k for k in range(len(found.lines)) if k not in lines_hit]
    void = {h.line for h in _matched(found.lines, borders, (np.array(left, np.int64), apart), p)}
    return UnitsAccuracy(
        tuple(sorted(hits, key=lambda h: h.line)),
        tuple(k for k in np.flatnonzero(counted).tolist() if k not in borders_hit),
        tuple(k for k in left if k not in void),
        tuple(apart.tolist()),
        tuple(sorted(void)),
        *_sensitivities(borders, counted, borders_hit),
        _unit_iou(np.array(units, dtype=object)[home >= 0], np.array(list(found.units), dtype=object)),
        int((home < 0).sum()),
    )


def _sensitivities(
    borders: Sequence[Border], counted: BoolArray, hit: set[int]
) -> tuple[Sensitivity, Sensitivity, dict[str, Sensitivity]]:
    wanted = np.flatnonzero(counted).tolist()

    def of(chosen: list[int]) -> Sensitivity:
        return Sensitivity(sum(k in hit for k in chosen), len(chosen))

    by_trace = {t: of([k for k in wanted if t in (borders[k].traces or ())]) for t in TRACES}
    by_trace[UNMARKED] = of([k for k in wanted if borders[k].traces == frozenset()])
    return of(wanted), of([k for k in wanted if borders[k].traces != frozenset()]), by_trace


def _homes(units: Sequence[Polygon], outlines: Sequence[Polygon]) -> IntArray:
    """(U,) outline that covers at least half of each unit, the one that covers most; -1 for none."""
    home, most = np.full(len(units), -1), np.full(len(units), _HALF)
    if not len(units) or not len(outlines):
        return home
    u, o = np.array(units, dtype=object), np.array(outlines, dtype=object)
    which, by = shapely.STRtree(o).query(u, predicate="intersects")
    share = shapely.area(shapely.intersection(u[which], o[by])) / np.maximum(shapely.area(u[which]), 1e-9)
    for k in np.lexsort((by, which)).tolist():
        if share[k] >= most[which[k]]:
            home[which[k]], most[which[k]] = by[k], share[k] + 1e-12
    return home


def _line_homes(lines: Sequence[LineString], outlines: Sequence[Polygon]) -> IntArray:
    """(L,) outline that holds most of each line; -1 for none."""
    home, most = np.full(len(lines), -1), np.zeros(len(lines))
    if not len(lines) or not len(outlines):
        return home
    every, o = np.array(lines, dtype=object), np.array(outlines, dtype=object)
    which, by = shapely.STRtree(o).query(every, predicate="intersects")
    length = shapely.length(shapely.intersection(every[which], o[by]))
    for k in np.lexsort((by, which)).tolist():
        if length[k] > most[which[k]]:
            home[which[k]], most[which[k]] = by[k], length[k]
    return home


def _matched(
    lines: Sequence[LineString], borders: Sequence[Border], chosen: tuple[IntArray, IntArray], p: UnitsParameters
) -> list[Hit]:
    """The best pairs of some lines and some borders."""
    here, wanted = chosen
    if not len(here) or not len(wanted):
        return []
    position, angle = np.full((len(here), len(wanted)), np.nan), np.zeros((len(here), len(wanted)))
    shapes = np.array([lines[k] for k in here.tolist()], dtype=object)
    directions = np.array([main_direction(line) for line in shapes])
    for column, k in enumerate(wanted.tolist()):
        own = main_direction(borders[k].line)
        angle[:, column] = [angle_between(d, own) for d in directions]
        position[:, column] = _distances(shapes, borders[k].line, p)
    position[angle > p.angle_deg] = np.nan
    cost = np.where(np.isnan(position), _NEVER, position)
    return [
        Hit(int(here[r]), int(wanted[c]), float(position[r, c]), float(angle[r, c]))
        for r, c in zip(*linear_sum_assignment(cost), strict=True)
        if np.isfinite(position[r, c])
    ]


def _distances(lines: np.ndarray, border: LineString, p: UnitsParameters) -> FloatArray:
    """(L,) median distance of the border's points from each line where that runs along it; NaN where it does not."""
    count = max(int(np.ceil(border.length / _STEP_M)), 4)
    places = shapely.line_interpolate_point(border, (np.arange(count) + 0.5) / count, normalized=True)
    off = shapely.distance(lines[:, None], places[None, :])
    near = off <= p.position_m
    median = np.array([np.median(row[ok]) if ok.any() else np.nan for row, ok in zip(off, near, strict=True)])
    return np.where(near.mean(axis=1) >= p.covered, median, np.nan)


def _unit_iou(true: np.ndarray, found: np.ndarray) -> FloatArray:
    best = np.zeros(len(true))
    if not len(true) or not len(found):
        return best
    t, f = shapely.STRtree(found).query(true, predicate="intersects")
    common = shapely.area(shapely.intersection(true[t], found[f]))
    iou = common / (shapely.area(true[t]) + shapely.area(found[f]) - common)
    np.maximum.at(best, t, iou)
    return best


def _median(values: FloatArray) -> float:
    return float(np.median(values)) if len(values) else float("nan")
