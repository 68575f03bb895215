"""The plane cut into faces by lines: edges of each face, and integrals of a raster over the faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

_LATTICE_M = 1e-3
"""Walls are noded on millimetres."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Faces of an arrangement of lines.

    Attributes
    ----------
    polygons : (F,) of shapely Polygon
    ends : (E, 2, 2) metres, edges between faces, each once
    left, right : (E,) face on either side of each edge, -1 outside of all
    """

    polygons: np.ndarray
    ends: FloatArray
    left: IntArray
    right: IntArray


def faces_of(lines: FloatArray) -> Faces:
    """Faces between the lines (n, 2, 2), which may cross at will."""
    noded = shapely.union_all(shapely.linestrings(lines), grid_size=_LATTICE_M)
    polygons = shapely.get_parts(shapely.polygonize(list(shapely.get_parts(noded))))
    polygons = shapely.orient_polygons(polygons, exterior_cw=False)
    starts, stops, face = _directed_edges(polygons)
    return Faces(polygons, *_paired(starts, stops, face))


def _directed_edges(polygons: np.ndarray) -> tuple[IntArray, IntArray, IntArray]:
    """Both ends (millimetres) of every edge of every face, the face on the left."""
    rings, owner = shapely.get_rings(polygons, return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    mm = np.rint(xy / _LATTICE_M).astype(np.int64)
    same = ring[1:] == ring[:-1]
    return mm[:-1][same], mm[1:][same], owner[ring[:-1][same]].astype(np.int64)


def _paired(starts: IntArray, stops: IntArray, face: IntArray) -> tuple[FloatArray, IntArray, IntArray]:
    forward = (starts[:, 0] < stops[:, 0]) | ((starts[:, 0] == stops[:, 0]) & (starts[:, 1] < stops[:, 1]))
    low = np.where(forward[:, None], starts, stops)
    high = np.where(forward[:, None], stops, starts)
    edges, number = np.unique(np.concatenate([low, high], axis=1), axis=0, return_inverse=True)
    left, right = np.full(len(edges), -1, np.int64), np.full(len(edges), -1, np.int64)
    number = number.ravel()
    left[number[forward]] = face[forward]
    right[number[~forward]] = face[~forward]
    return edges.reshape(-1, 2, 2) * _LATTICE_M, left, right


def integrals(faces: Faces, values: FloatArray, cell: float) -> FloatArray:
    """(F,) integral of a raster over every face, by Green's theorem along the edges: exactly additive.

    Parameters
    ----------
    values : (rows, cols), row 0 at the bottom, lower left corner of the raster at (0, 0) of the faces' frame
    cell : metres
    """
    running = running_sums(values)
    along = _line_integrals(faces.ends, running, cell) * cell * cell
    result = np.zeros(len(faces.polygons))
    # Walked upwards, a face on the left lies before the edge, the one on the right behind it.
    has_left, has_right = faces.left >= 0, faces.right >= 0
    np.add.at(result, faces.left[has_left], along[has_left])
    np.add.at(result, faces.right[has_right], -along[has_right])
    return result


def running_sums(values: FloatArray) -> FloatArray:
    """(rows, cols + 1) sums of a raster along its rows, from the left."""
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(values, axis=1)], axis=1)


def signed_integral(edges: FloatArray, running: FloatArray, cell: float) -> float:
    """Integral of a raster over what lies between edges (n, 2, 2) and the left end of the raster, positive where they go up.

    Of all edges of a ring, counter-clockwise, together: the integral over its inside.
    """
    return float(_line_integrals(np.ascontiguousarray(edges), running, cell).sum() * cell * cell)


@njit(cache=True, nogil=True)
def _line_integrals(ends: FloatArray, running: FloatArray, cell: float) -> FloatArray:
    """Sum over the middles of rows that an edge crosses of the running sum at the crossing; negative downwards."""
    rows, cols = running.shape[0], running.shape[1] - 1
    out = np.zeros(len(ends))
    for k in range(len(ends)):
        x_0, y_0, x_1, y_1 = ends[k, 0, 0], ends[k, 0, 1], ends[k, 1, 0], ends[k, 1, 1]
        sign = 1.0
        if y_1 < y_0:
            x_0, y_0, x_1, y_1, sign = x_1, y_1, x_0, y_0, -1.0
        first = max(int(np.ceil(y_0 / cell - 0.5)), 0)
        last = min(int(np.ceil(y_1 / cell - 0.5)), rows)
        total = 0.0
        for row in range(first, last):
            t = ((row + 0.5) * cell - y_0) / (y_1 - y_0)
            x = min(max((x_0 + t * (x_1 - x_0)) / cell, 0.0), float(cols))
            col = min(int(x), cols - 1)
            total += running[row, col] + (x - col) * (running[row, col + 1] - running[row, col])
        out[k] = sign * total
    return out
