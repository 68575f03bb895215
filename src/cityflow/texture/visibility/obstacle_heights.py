"""The surface as an obstacle between cameras and a unit, without the unit itself.

A surface from images has blurred walls, and eaves that stick to them; left in, they would hide the walls of their own building. So where a model stands, and
a little around the unit itself, the surface counts only where it clearly rises above all models there: trees above roofs, chimneys, what the models lack. The
rest is left to the models. What is mounted on the unit's own roof belongs to its picture; nobody would rather see the roof filled in there. Around the unit's
outline the ground a little farther off takes the surface's place, which hides what of a wall is in the earth.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.ray_march import LOWEST
from cityflow.texture.visibility.visibility_parameters import OWN_M, VisibilityParameters

STEP_SHARE = 0.4
"""Steps within a roof are blurred by less than walls with their eaves: so much of the reach around a unit; set by hand, as are those below."""
LEAST_CELLS = 25
"""Fewer cells tell nothing about how far a model lies below the surface."""


def obstacle_heights(
    heights: FloatArray,
    grid: Grid,
    own: Sequence[Polyhedron],
    others: Sequence[Polyhedron],
    parameters: VisibilityParameters,
) -> Float32Array:
    """(rows, cols) heights of what stands in the way, world metres; `LOWEST` where nothing does.

    Parameters
    ----------
    heights : (rows, cols) the surface, world metres; NaN where it is not known
    own : shells of the unit whose faces are looked at;  others : shells around it
    """
    surface = np.where(np.isnan(heights), LOWEST, heights).astype(np.float32)
    reach = _window(round(OWN_M / grid.cell))
    step = _window(round(OWN_M * STEP_SHARE / grid.cell))
    roof = roof_heights(own, grid)
    roof = np.where(roof > LOWEST, roof + np.float32(_below_surface(roof, surface)), LOWEST).astype(np.float32)
    around = np.maximum(roof, roof_heights(others, grid))
    mine = cv2.dilate(roof, reach) > LOWEST
    models = np.where(around > LOWEST, cv2.dilate(around, step), cv2.dilate(around, reach))
    rises = surface > models + np.float32(parameters.rise_m)
    result = np.where(mine & ~rises, _ground(surface, mine | (around > LOWEST)), surface)
    built = around > LOWEST
    result[built & (~rises | _mounted(rises, surface - models, roof > LOWEST, parameters, grid.cell))] = LOWEST
    widened = max(1, round(parameters.margin_m / grid.cell)) if parameters.margin_m > 0 else 0
    return _widened(result, built, widened)


def _mounted(
    rises: BoolArray, by: Float32Array, own: BoolArray, parameters: VisibilityParameters, cell: float
) -> BoolArray:
    """Cells of what rises a little above the own roof and lies well inside it as a whole; crowns of trees hang in from outside."""
    inside = _inside(own, round(OWN_M * STEP_SHARE / cell))
    _, label = cv2.connectedComponents(rises.astype(np.uint8), connectivity=8)
    elsewhere = np.zeros(int(label.max()) + 1, bool)
    elsewhere[label[~inside | (by > parameters.mounted_m)]] = True
    return np.asarray(rises & ~elsewhere[label])


def _widened(result: Float32Array, built: BoolArray, by: int) -> Float32Array:
    """What hides, widened; but what stands on models hides no walls under it: it counts a little within their edge, and is widened no farther than that."""
    window = _window(by)
    beside = cv2.dilate(np.where(built, LOWEST, result), window)
    on_roofs = cv2.dilate(np.where(_inside(built, by + 1), result, LOWEST), window)
    return np.asarray(np.maximum(beside, np.where(built, on_roofs, LOWEST)), np.float32)


def _inside(of: BoolArray, by: int) -> BoolArray:
    """Cells that are at least so many cells from the edge."""
    return cv2.erode(of.astype(np.uint8), _window(by)).astype(bool)


def roof_heights(shells: Sequence[Polyhedron], grid: Grid) -> Float32Array:
    """(rows, cols) greatest height of the shells in each cell, world metres; `LOWEST` beside them."""
    out = np.full(grid.shape, LOWEST, np.float32)
    for shell in shells:
        mesh = triangulate(shell)
        if len(mesh.triangles):
            _raise_to(out, mesh.vertices[mesh.triangles], grid.x_min, grid.y_max, grid.cell)
    return out


def _below_surface(roof: Float32Array, surface: Float32Array) -> float:
    """How far a model as a whole lies below the surface: what is just too low does not make everything above it an obstacle."""
    known = (roof > LOWEST) & (surface > LOWEST)
    if np.count_nonzero(known) < LEAST_CELLS:
        return 0.0
    return max(float(np.median(surface[known] - roof[known])), 0.0)


def _ground(surface: Float32Array, mine: BoolArray) -> Float32Array:
    """The surface; of cells around the unit the nearest beyond, where that is lower."""
    from_mine = (mine | (surface <= LOWEST)).astype(np.uint8)
    if np.all(from_mine):
        return np.full_like(surface, LOWEST)
    _, labels = cv2.distanceTransformWithLabels(from_mine, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    height = np.empty(int(labels.max()) + 1, np.float32)
    height[labels[from_mine == 0]] = surface[from_mine == 0]
    return np.minimum(height[labels], surface)


def _window(cells: int) -> ByteArray:
    return np.ones((2 * cells + 1, 2 * cells + 1), np.uint8)


@njit(cache=True, nogil=True)
def _raise_to(out, corners, x_min, y_max, cell):  # type: ignore[no-untyped-def]
    """Every cell whose middle lies in a triangle in plan, or within half a cell of it, is at least as high as the triangle there."""
    rows, cols = out.shape
    for t in range(corners.shape[0]):
        ax, ay = (corners[t, 0, 0] - x_min) / cell - 0.5, (y_max - corners[t, 0, 1]) / cell - 0.5
        bx, by = (corners[t, 1, 0] - x_min) / cell - 0.5, (y_max - corners[t, 1, 1]) / cell - 0.5
        cx, cy = (corners[t, 2, 0] - x_min) / cell - 0.5, (y_max - corners[t, 2, 1]) / cell - 0.5
        double = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        # rows count southwards, so that triangles that look up run clockwise here; the others have nothing beneath them but the building
        if double > -1e-3:
            continue
        # barycentric coordinates may be this far negative half a cell beside each edge
        wa = 0.5 * np.hypot(cx - bx, cy - by) / abs(double)
        wb = 0.5 * np.hypot(ax - cx, ay - cy) / abs(double)
        wc = 0.5 * np.hypot(bx - ax, by - ay) / abs(double)
        c_0, c_1 = max(int(np.floor(min(ax, bx, cx))), 0), min(int(np.ceil(max(ax, bx, cx))), cols - 1)
        r_0, r_1 = max(int(np.floor(min(ay, by, cy))), 0), min(int(np.ceil(max(ay, by, cy))), rows - 1)
        for r in range(r_0, r_1 + 1):
            for c in range(c_0, c_1 + 1):
                a = ((bx - c) * (cy - r) - (by - r) * (cx - c)) / double
                b = ((cx - c) * (ay - r) - (cy - r) * (ax - c)) / double
                g = 1.0 - a - b
                if a < -wa or b < -wb or g < -wc:
                    continue
                a, b, g = max(a, 0.0), max(b, 0.0), max(g, 0.0)
                z = (a * corners[t, 0, 2] + b * corners[t, 1, 2] + g * corners[t, 2, 2]) / (a + b + g)
                if z > out[r, c]:
                    out[r, c] = z
