"""Where photographs show the borders between houses: the edge of the higher roof, or, on one height, where the colour of one roof changes to that of the next.

The votes are those of a roof's own steps (`edge_places.py`); the roofs beside a border are planes through the surface, as there are no models yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from shapely import LineString, get_coordinates

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.edges.edge_line import LEAST_LENGTH_M, EdgeLine
from cityflow.edges.edge_places import EdgePlace, place_of_votes, places_across, votes_of
from cityflow.edges.image_window import window_over

SIGNIFICANCE = 2.0
"""A border moves to a place that is more of an edge than any other near it, by so many standard deviations of the images' votes, as steps do."""
PIECE_M, ALONG_M = 1.6, 0.25
"""A border is looked at in pieces about so long, as roofs beside it bend at a ridge; places along it."""
ACROSS_M = (0.8, 1.1, 1.4, 1.7, 2.0)
"""The roof on each side is a plane through the surface so far from the border: nearer, matching draws a slope; set by hand, as is the next one."""
UNEVEN_M = 0.2
"""If the surface departs more from the plane of the higher roof (root mean square), its edge is not looked for."""
LEAST_KNOWN = 0.5
"""Share of the places beside a border where the surface has to be known."""


class _Roof(NamedTuple):
    """Beside the middle of a piece of a border: (3,) its height there, metres, and its rise in x and y; how far the surface departs from it, metres."""

    plane: FloatArray
    rms: float


class _Border(NamedTuple):
    """Pieces of a border: the upper edge of each, in whose direction `turned` is 1, or −1 where the lower roof is on the left of the line."""

    edges: tuple[EdgeLine, ...]
    turned: tuple[int, ...]


def border_shifts(
    lines: Sequence[LineString], grid: Grid, dsm: FloatArray | Float32Array, images: Sequence[ColourImage]
) -> list[float]:
    """(L,) metres to the right of each straight line in plan where photographs show the border; 0 where they do not tell, or show it there.

    Parameters
    ----------
    lines : in world metres;  dsm : (rows, cols) on `grid`, metres, NaN where nothing is known
    """
    places = border_places(lines, grid, dsm, images)
    return [
        p.off_m if p is not None and p.sigmas >= SIGNIFICANCE and abs(p.off_m) >= grid.cell else 0.0 for p in places
    ]


def border_places(
    lines: Sequence[LineString], grid: Grid, dsm: FloatArray | Float32Array, images: Sequence[ColourImage]
) -> list[EdgePlace | None]:
    """Where photographs show each border, metres to the right of it; None where they do not tell.

    An image votes for a place by all pieces of a border together, so that one piece that shows a pipe or a shadow decides nothing.
    """
    borders = [_border(line, grid, dsm) for line in lines]
    cell, off = grid.cell, places_across(grid.cell)
    ends = [e.places(np.array([0.0, e.length]), off[[0, -1]]).reshape(-1, 3) for b in borders for e in b.edges]
    votes: list[list[FloatArray]] = [[] for _ in lines]
    for image in images if ends else ():
        window = window_over(image, np.concatenate(ends), cell)
        if window is None:
            continue
        for border, known in zip(borders, votes, strict=True):
            own = [
                (v[::t], e.length)
                for e, t in zip(border.edges, border.turned, strict=True)
                if (v := votes_of(e, window, off, cell)) is not None
            ]
            if own:
                known.append(np.average([v for v, _ in own], axis=0, weights=[w for _, w in own]))
    return [place_of_votes(known, cell) for known in votes]


def _border(line: LineString, grid: Grid, dsm: FloatArray | Float32Array) -> _Border:
    start, end = get_coordinates(line)[[0, -1]]
    length = float(np.hypot(*(end - start)))
    if length < LEAST_LENGTH_M:
        return _Border((), ())
    along = (end - start) / length
    right = np.array([along[1], -along[0]])
    count = max(1, round(length / PIECE_M))
    edges, turned = [], []
    for k in range(count):
        first, piece = start + k * length / count * along, length / count
        middle = first + piece / 2 * along
        left, right_side = (_roof(middle, piece, along, turn * right, grid, dsm) for turn in (-1, 1))
        if left is None or right_side is None:
            continue
        drop = float(left.plane[0] - right_side.plane[0])
        turn, upper = (1, left) if drop > 0 else (-1, right_side)
        if upper.rms > UNEVEN_M:
            continue
        slope = np.array([turn * upper.plane[1:] @ along, turn * upper.plane[1:] @ right])
        at = first if turn > 0 else first + piece * along
        edges.append(EdgeLine(at, turn * along, turn * right, piece, float(upper.plane[0]), slope, abs(drop)))
        turned.append(turn)
    return _Border(tuple(edges), tuple(turned))


def _roof(
    middle: FloatArray, length: float, along: FloatArray, across: FloatArray, grid: Grid, dsm: FloatArray | Float32Array
) -> _Roof | None:
    """On one side of a piece of a border; None where little is known."""
    s = np.arange(ALONG_M / 2, length, ALONG_M) - length / 2
    off = (s[:, None, None] * along + np.array(ACROSS_M)[None, :, None] * across).reshape(-1, 2)
    row, col = grid.indices(*(middle + off).T)
    inside = (row >= 0) & (row < grid.shape[0]) & (col >= 0) & (col < grid.shape[1])
    z = np.full(len(off), np.nan)
    z[inside] = dsm[row[inside], col[inside]]
    known = np.isfinite(z)
    if known.mean() < LEAST_KNOWN:
        return None
    table = np.column_stack([np.ones(known.sum()), off[known]])
    plane, *_ = np.linalg.lstsq(table, z[known], rcond=None)
    return _Roof(plane, float(np.sqrt(np.mean((table @ plane - z[known]) ** 2))))
