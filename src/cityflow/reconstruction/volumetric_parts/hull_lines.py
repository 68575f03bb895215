"""Where edges of the hull may run, seen in plan: walls, edges between nodes, steps between roofs."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.borders import find_borders
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.cut_lines import (
    intersection_lines,
    main_directions,
    on_outline,
    outline_extensions,
    without_doubles,
)
from cityflow.reconstruction.partition.step_lines import step_lines
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.volumetric_parts.columns import ColumnParameters
from cityflow.reconstruction.volumetric_parts.facades import Facade, facade_lines
from cityflow.reconstruction.volumetric_parts.nodes import Nodes, edge_lines

NEAR_CORNER, SAME_LINE = 0.02, 0.005
"""A wall or step nearer to a corner (m) than the first goes through it; corners nearer to one line than the second are on it; set by hand."""

EXTEND = 2.5
"""Metres that an edge may run on to reach a node; set by hand."""


def outline_walls(outline: Polygon) -> list[CutLine]:
    """Edges of the outline: walls that are given."""
    walls = []
    for ring in (outline.exterior, *outline.interiors):
        for (x1, y1), (x2, y2) in itertools.pairwise(np.asarray(ring.coords)[:, :2]):
            length = math.hypot(x2 - x1, y2 - y1)
            nx, ny = float((y2 - y1) / length), float((x1 - x2) / length)
            start = float(-ny * x1 + nx * y1)
            walls.append(CutLine(nx, ny, float(nx * x1 + ny * y1), start, start + length, length))
    return walls


def cutting_lines(
    outline: Polygon, segments: PlaneSegments, facades: list[Facade], nodes: Nodes, parameters: ColumnParameters
) -> list[CutLine]:
    """Walls first, then all others by the length of what supports them; local frame."""
    borders = find_borders(segments, parameters.reach, parameters.gap)
    crossings, explained = intersection_lines(segments, borders, parameters.min_length, parameters.reach)
    crossings = edge_lines(crossings, nodes, EXTEND)
    steps = step_lines(borders.take(~explained), main_directions(outline), parameters.min_length, parameters.max_lines)
    guessed = [*crossings, *on_outline(steps, outline, 0.3), *outline_extensions(outline, parameters.min_length)]
    guessed.sort(key=lambda line: -line.support)
    lines = without_doubles([*facade_lines(facades, 0.5), *guessed], 0.1)[: parameters.max_lines]
    corners = shapely.get_coordinates(outline)
    return [line if line.is_crossing else _onto_corner(line, corners) for line in lines]


def _onto_corner(line: CutLine, corners: FloatArray) -> CutLine:
    """The line moved by centimetres through the outline's corner that it nearly meets: a line that passes it leaves a sliver."""
    along = corners @ (-line.ny, line.nx)
    side = (corners @ (line.nx, line.ny) - line.offset)[(along > line.start - 0.1) & (along < line.end + 0.1)]
    if len(side) == 0 or np.abs(side).min() > NEAR_CORNER:
        return line
    nearest = side[np.argmin(np.abs(side))]
    return replace(line, offset=line.offset + float(side[np.abs(side - nearest) < SAME_LINE].mean()))
