"""Houses and cameras of which it is known what is seen."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Grid

X, Y, GROUND = 85000.0, 447000.0, 2.0
CAMERA = Camera(1500, 1000, 2000.0, 2000.0, 750.0, 500.0)
BENT = Camera(1500, 1000, 900.0, 900.0, 740.0, 510.0, (-0.12, 0.03, 0.001, -0.0005))
FISHEYE = Camera(1400, 1400, 450.0, 450.0, 700.0, 700.0, (0.01, -0.002, 0.0, 0.0), "fisheye")


def house(x: float, y: float, width: float, depth: float, height: float) -> Polyhedron:
    """A box on the ground; its faces are ground, roof, south, east, north, west. Metres from (X, Y)."""
    corners = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
    low = [(X + a, Y + b, GROUND) for a, b in corners]
    high = [(X + a, Y + b, GROUND + height) for a, b in corners]
    rings = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    kinds = [Semantic.GROUND, Semantic.ROOF, *[Semantic.WALL] * 4]
    return Polyhedron(np.array(low + high), tuple(Face((r,), k) for r, k in zip(rings, kinds, strict=True)))


def looking(centre: FloatArray, at: FloatArray, camera: Camera = CAMERA, name: str = "image") -> OrientedImage:
    """An image whose axis goes from `centre` to `at`, metres from (X, Y, 0); its rows are level."""
    forward = (np.asarray(at, float) - centre) / np.linalg.norm(np.asarray(at, float) - centre)
    right = np.cross(forward, [0.0, 1.0, 0.0] if abs(forward[2]) > 0.999 else [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.array([right, np.cross(forward, right), forward])
    return OrientedImage(name, camera, rotation, np.asarray(centre, float) + np.array([X, Y, 0.0]))


def surface(cell: float = 0.1, reach: float = 40.0) -> tuple[Grid, FloatArray]:
    """Level ground all around."""
    grid = Grid.covering((X - reach, Y - reach, X + reach, Y + reach), cell)
    return grid, np.full(grid.shape, GROUND)


def raised(grid: Grid, heights: FloatArray, box: tuple[float, float, float, float], top: float) -> FloatArray:
    """The surface with everything within a box (metres from (X, Y)) at least `top` metres above the ground."""
    x, y = grid.x_centres() - X, grid.y_centres() - Y
    within = ((y >= box[1]) & (y <= box[3]))[:, None] & ((x >= box[0]) & (x <= box[2]))[None, :]
    return np.where(within, np.maximum(heights, GROUND + top), heights)
