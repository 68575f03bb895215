"""An outline without the errors of its corners, for fitting roofs: sides at right angles, and where heights fall and eaves are seen.

Houses have right angles, and outlines are disturbed corner by corner; so a side is turned to the main directions where its ends
move no further than corners err, and then moved in parallel to where it is likeliest. The solid stands on the outline as given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.roof_types_parts.heights import HeightCells
from cityflow.reconstruction.roof_types_parts.outline_sides import Sides, main_angle
from cityflow.reconstruction.roof_types_parts.roof_lines import RoofLines, turn_between

SIDE_M, LINE_M, LEAST_LINE_M = 0.75, 0.2, 2.0
"""Ends of sides, and of detected lines, err so much; shorter lines tell no direction; set by hand."""
MOST_WEIGHT, ROBUST = 400.0, 3.0
"""No direction is surer than this (1/radians²); directions so many sigma off count half; set by hand."""
ALIKE_DEG = 10.0
"""Sides that turn less off a main direction may be turned into it; set by hand."""
REACH_M, TRIES, SPAN = 2.6, 30, 0.8
"""Heights so far beside a side tell where it is; places tried on either side; middle share of a side that is looked at; set by hand."""
NOISE_M, CUT = 0.5, 4.5
"""Of heights off their slope (sigma), and the penalty of three sigma, beyond which a height says no more; set by hand."""
SEEN, EAVE_M = 2.0, 0.2
"""Log-likelihood ratio of a line that runs along all of a side, and how far beside the side it may run (sigma); set by hand."""
ROUND_CORNERS, FINE_CORNERS, EXPLAINED = 16, 24, 0.6
"""Waves of two to four turns explain nearly all by which corners of a rectangle lie beside a circle, but little of errors; set by hand."""

RIGHT_DEG = 1.0
"""Outlines all of whose angles are right within this are taken as given, degrees; set by hand."""
DOUBT_COST = 6.0
"""Rare roofs cost so much more (log-likelihood) over corrected outlines, since rims drawn badly look like bends; set by hand on drawn houses."""


class RegularParameters(Parameters):
    """How far outlines are trusted."""

    outline_m: float = Field(
        0.75, ge=0, le=5, description="error of outlines' corners (RMSE, m), for fitting; 0: all are taken as given"
    )


@dataclass(frozen=True, slots=True)
class Rim:
    """What is seen around a roof: heights inside and outside, and lines."""

    cells: HeightCells
    lines: RoofLines


def regular_outline(outline: Polygon, sides: Sides, rim: Rim, parameters: RegularParameters) -> Polygon:
    """The likely outline; the given one where that is regular, or where nothing better comes out."""
    if parameters.outline_m == 0:
        return outline
    disc = _disc(outline, parameters.outline_m)
    if disc is not None:
        return disc
    turn = _off_square(sides.angle, main_angle(sides))
    if np.all(np.abs(turn) <= math.radians(RIGHT_DEG)):
        return outline
    angle = _direction(sides, rim.lines)
    lines = _turned(sides, angle, parameters)
    lines = np.array([_moved(line, ends, rim, parameters) for line, ends in zip(lines, sides.ends, strict=True)])
    found = _polygon(lines, sides)
    return found if found is not None and _alike(found, outline, parameters) else outline


def _off_square(angle: FloatArray, main: float) -> FloatArray:
    """Signed turn from the nearest main direction, radians."""
    turn: FloatArray = angle - main + math.pi / 4
    return turn % (math.pi / 2) - math.pi / 4


def _direction(sides: Sides, lines: RoofLines) -> float:
    """Main direction by sides and lines, each weighed by how exactly its ends give it."""
    main = main_angle(sides)
    long = lines.take(lines.length >= LEAST_LINE_M)
    turn = _off_square(np.concatenate([sides.angle, long.angle]), main)
    weight = np.concatenate([(sides.length / SIDE_M) ** 2, (long.length / LINE_M) ** 2])
    near = np.abs(turn) <= math.radians(ALIKE_DEG)
    turn, weight = turn[near], np.minimum(weight[near], MOST_WEIGHT)
    best = _weighted_median(turn, weight)
    close = weight / (1 + weight * (turn - best) ** 2 / ROBUST**2)
    return main + float(np.sum(close * turn) / np.sum(close))


def _weighted_median(values: FloatArray, weight: FloatArray) -> float:
    order = np.argsort(values, kind="stable")
    return float(values[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])


def _turned(sides: Sides, angle: float, parameters: RegularParameters) -> FloatArray:
    """(N, 3) lines of the sides, through their middles, along the main directions where errors of corners explain the turn."""
    turn = _off_square(sides.angle, angle)
    explained = np.abs(np.tan(turn)) * sides.length <= 2.5 * parameters.outline_m
    direction = np.where(explained, sides.angle - turn, sides.angle)
    normal = np.column_stack([-np.sin(direction), np.cos(direction)])
    return np.column_stack([normal, np.sum(normal * sides.ends.mean(axis=1), axis=1)])


def _moved(line: FloatArray, ends: FloatArray, rim: Rim, parameters: RegularParameters) -> FloatArray:
    """The line where heights, lines and the outline itself together make it likeliest."""
    sigma = parameters.outline_m / 2
    tried = np.linspace(-2 * parameters.outline_m, 2 * parameters.outline_m, 2 * TRIES + 1)
    cost = 0.5 * (tried / sigma) ** 2 + _fall_cost(line, ends, tried, rim.cells) - _eave_gain(line, ends, tried, rim)
    return line + np.array([0.0, 0.0, tried[int(np.argmin(cost))]])


def _fall_cost(line: FloatArray, ends: FloatArray, tried: FloatArray, cells: HeightCells) -> FloatArray:
    """(T,) cost of heights about a side if it were moved inwards: a slope inside, a level outside, cells across it mixed."""
    along = np.array([line[1], -line[0]])
    t0, t1 = np.sort(ends @ along)
    t0, t1 = (t0 + t1) / 2 + np.array([-0.5, 0.5]) * SPAN * (t1 - t0)
    depth, t = cells.xy @ line[:2] - line[2], cells.xy @ along
    number = np.bincount(cells.cell, minlength=len(cells))
    used = np.abs(np.bincount(cells.cell, depth, len(cells)) / number) <= REACH_M + cells.size / 2
    used &= np.bincount(cells.cell, (t >= t0) & (t <= t1), len(cells)) >= 0.99 * number
    if np.count_nonzero(used) < 5:
        return np.zeros(len(tried))
    near = cells.take(used)
    depth = near.xy @ line[:2] - line[2]
    return np.array([_step_misfit(near, depth - move) for move in tried])


def _step_misfit(cells: HeightCells, depth: FloatArray) -> float:
    inside, n = (depth > 0).astype(np.float64), np.bincount(cells.cell)
    rows = np.column_stack([np.bincount(cells.cell, v) / n for v in (inside, inside * depth, 1 - inside)])
    w = np.ones(len(cells))
    for _ in range(3):
        normal = rows.T @ (w[:, None] * rows) + np.diag([1e-6, 0.5, 1e-6])
        x = np.linalg.solve(normal, rows.T @ (w * cells.z))
        off = (cells.z - rows @ x) / NOISE_M
        w = 1 / (1 + (off / 3) ** 2)
    return float(np.sum(cells.weight * np.minimum(0.5 * off**2, CUT)))


def _eave_gain(line: FloatArray, ends: FloatArray, tried: FloatArray, rim: Rim) -> FloatArray:
    """(T,) log-likelihood ratio of the best line along a side."""
    gain = np.zeros(len(tried))
    along = np.array([line[1], -line[0]])
    t0, t1 = np.sort(ends @ along)
    side = math.atan2(along[1], along[0])
    for segment in rim.lines.ends:
        step = segment[1] - segment[0]
        if turn_between(math.atan2(step[1], step[0]), side) > math.radians(6.0):
            continue
        a, b = np.sort(segment @ along)
        share = (min(b, t1) - max(a, t0)) / (t1 - t0)
        off = float((segment @ line[:2]).mean() - line[2])
        if share > 0.3:
            gain = np.maximum(gain, SEEN * min(share, 1.0) * np.exp(-0.5 * ((tried - off) / EAVE_M) ** 2))
    return gain


def _polygon(lines: FloatArray, sides: Sides) -> Polygon | None:
    """The ring of lines; parallel neighbours meet in a step at the corner between them."""
    ring = list[FloatArray]()
    for k in range(len(lines)):
        before, after, corner = lines[k - 1], lines[k], sides.ends[k, 0]
        if before[:2] @ after[:2] > math.cos(math.radians(15.0)):
            ring += [corner - (corner @ row[:2] - row[2]) * row[:2] for row in (before, after)]
        elif abs(before[0] * after[1] - before[1] * after[0]) < 0.2:
            return None
        else:
            ring.append(np.asarray(np.linalg.solve(np.stack([before[:2], after[:2]]), [before[2], after[2]])))
    found = Polygon(np.round(ring, 4))
    return found if found.is_valid and not found.is_empty else None


def _alike(found: Polygon, outline: Polygon, parameters: RegularParameters) -> bool:
    """Corners move no further than they may err, the area by no more than that of its rim."""
    away = shapely.hausdorff_distance(found, outline)
    return bool(
        away <= 4 * parameters.outline_m and abs(found.area - outline.area) <= outline.length * parameters.outline_m
    )


def _disc(outline: Polygon, error: float) -> Polygon | None:
    """The disc of an outline of many corners that lie about a circle, much rather than about a rectangle; else None."""
    ring = np.asarray(outline.exterior.coords)[:-1, :2]
    if len(ring) < ROUND_CORNERS:
        return None
    rows = np.column_stack([2 * ring, np.ones(len(ring))])
    x, y, c = np.linalg.lstsq(rows, np.sum(ring**2, axis=1), rcond=None)[0]
    radius = math.sqrt(max(c + x * x + y * y, 1e-6))
    off = np.hypot(ring[:, 0] - x, ring[:, 1] - y) - radius
    rms = math.sqrt(float(np.mean(off**2)))
    turn = np.arctan2(ring[:, 1] - y, ring[:, 0] - x)
    waves = np.column_stack([f(k * turn) for k in (2, 3, 4) for f in (np.cos, np.sin)])
    left = off - waves @ np.linalg.lstsq(waves, off, rcond=None)[0]
    systematic = float(np.mean(left**2)) < (1 - EXPLAINED) * rms**2 and rms > 0.02 * radius
    if systematic or rms > min(error, 0.2 * radius) or abs(math.pi * radius**2 / outline.area - 1) > 0.2:
        return None
    angle = np.arange(FINE_CORNERS) * 2 * math.pi / FINE_CORNERS
    return Polygon(np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]))
