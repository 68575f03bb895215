"""Models seen obliquely from above: a z-buffer of their triangles over the terrain, with the shadows of a low sun and dark edges."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.grid import Bounds, Grid
from cityflow.core.kernels import njit
from cityflow.geometry.polyhedron import FaceArrays, face_arrays, mesh_of
from cityflow.viewer.model_view_shading import TERRAIN, shaded

Int32Array = NDArray[np.int32]

SEMANTIC_COLOURS: Mapping[Semantic, tuple[str, tuple[int, int, int]]] = {
    Semantic.ROOF: ("roof", (196, 88, 70)),
    Semantic.WALL: ("wall", (232, 222, 204)),
    Semantic.OUTER_CEILING: ("outer ceiling", (148, 120, 168)),
    Semantic.OUTER_FLOOR: ("outer floor", (176, 160, 132)),
    Semantic.GROUND: ("ground", (120, 120, 120)),
}
TERRAIN_COLOUR = (186, 196, 172)
SKY = (203, 206, 208)

LOOKING_DEG, DOWN_DEG = 20.0, 42.0
"""The viewer looks this far east of north, and this far down."""
SUN_DEG, SUN_HEIGHT_DEG = 250.0, 42.0
OVERSAMPLING = 2
NO_GROUND = Grid(0.0, 0.0, 1.0, 0, 0)
MOST_TERRAIN_CELLS = 400
EDGE_M = 0.3
"""Edges are drawn at full strength where a drawn pixel is no larger than this."""


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Triangles to be drawn.

    Attributes
    ----------
    corners : (T, 3, 3) float64, world metres
    colours : (T, 3) float64, 0 to 255
    faces : (T,) int64, number of the face that a triangle is a part of; −1 for the terrain
    """

    corners: FloatArray
    colours: FloatArray
    faces: IntArray

    def within(self, bounds: Bounds) -> Surfaces:
        """Triangles whose middle stands over `bounds`."""
        x, y = self.corners[:, :, 0].mean(axis=1), self.corners[:, :, 1].mean(axis=1)
        keep = (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
        return Surfaces(self.corners[keep], self.colours[keep], self.faces[keep])


def surfaces_of(solids: Iterable[Polyhedron]) -> Surfaces:
    """Triangles of solids, coloured by semantic."""
    shells = [s for s in solids if s.faces]
    if not shells:
        return no_terrain()
    arrays = _one_array([face_arrays(s) for s in shells])
    triangles, faces = mesh_of(arrays)
    semantic = np.array([SEMANTIC_COLOURS[f.semantic][1] for s in shells for f in s.faces], np.float64)
    return Surfaces(arrays.vertices[triangles] + arrays.origin, semantic[faces], faces)


def semantic_key(models: Surfaces) -> tuple[tuple[str, tuple[int, int, int]], ...]:
    """What the colours of models mean, of those that are there; floors are not seen from above."""
    above = [entry for semantic, entry in SEMANTIC_COLOURS.items() if semantic is not Semantic.GROUND]
    return tuple((text, colour) for text, colour in above if (models.colours == np.array(colour)).all(axis=1).any())


def _one_array(parts: Sequence[FaceArrays]) -> FaceArrays:
    """The faces of several solids as those of one: to triangulate thousands at once takes a fraction of the time."""
    origin = parts[0].origin
    vertices, corners, rings = (
        np.cumsum([0, *(len(a) for a in arrays)])[:-1]
        for arrays in ([p.vertices for p in parts], [p.corners for p in parts], [p.ring_start[1:] for p in parts])
    )
    return FaceArrays(
        np.concatenate([p.vertices + (p.origin - origin) for p in parts]),
        origin,
        np.concatenate([p.corners + n for p, n in zip(parts, vertices, strict=True)]),
        np.concatenate([[0], *(p.ring_start[1:] + n for p, n in zip(parts, corners, strict=True))]),
        np.concatenate([[0], *(p.face_start[1:] + n for p, n in zip(parts, rings, strict=True))]),
    )


def no_terrain() -> Surfaces:
    """Nothing at all."""
    return Surfaces(np.empty((0, 3, 3)), np.empty((0, 3)), np.empty(0, np.int64))


def terrain_surfaces(heights: Float32Array, grid: Grid) -> Surfaces:
    """Two triangles between four neighbouring cells whose heights are known; coarser where there are very many."""
    step = max(-(-max(heights.shape) // MOST_TERRAIN_CELLS), 1)
    z = heights[::step, ::step].astype(np.float64)
    x, y = np.meshgrid(grid.x_centres()[::step], grid.y_centres()[::step])
    p = np.stack([x, y, z], axis=-1)
    nw, ne, sw, se = p[:-1, :-1], p[:-1, 1:], p[1:, :-1], p[1:, 1:]
    corners = np.concatenate([np.stack(t, axis=-2).reshape(-1, 3, 3) for t in ((nw, sw, se), (nw, se, ne))])
    corners = corners[np.isfinite(corners).all(axis=(1, 2))]
    colours = np.tile(np.array(TERRAIN_COLOUR, np.float64), (len(corners), 1))
    return Surfaces(corners, colours, np.full(len(corners), TERRAIN))


def draw_models(
    models: Surfaces,
    terrain: Surfaces,
    most: int,
    ground: tuple[ByteArray, Grid] | None = None,
    looking_deg: float = LOOKING_DEG,
) -> ByteArray:
    """(rows, cols, 3) picture with a longest side of `most` pixels.

    Parameters
    ----------
    ground : (rows, cols, 3) colours of the terrain with their grid, or None for one colour
    looking_deg : where the viewer looks, clockwise from north

    Raises
    ------
    ValueError
        There is no triangle.
    """
    corners = np.concatenate([terrain.corners, models.corners])
    if not len(corners):
        raise ValueError("nothing to draw")
    origin = corners.reshape(-1, 3).min(axis=0)
    corners = corners - origin
    colours = np.concatenate([terrain.colours, models.colours])
    faces = np.concatenate([terrain.faces, models.faces])
    view = _Projection.of(corners, looking_deg, DOWN_DEG, OVERSAMPLING * most)
    sun = _Projection.of(corners, SUN_DEG + 180.0, SUN_HEIGHT_DEG, OVERSAMPLING * most)
    depth, triangle = view.rasterised(corners)
    scene = depth, triangle, colours, light_of(corners), faces, np.array(SKY, np.float64)
    seen = (ground[0], _moved(ground[1], origin)) if ground is not None else (np.empty((0, 0, 3), np.uint8), NO_GROUND)
    draped = np.ascontiguousarray(seen[0]), seen[1].x_min, seen[1].y_max, seen[1].cell
    edge = min(EDGE_M / view.pixel, 1.0)
    means = shaded(scene, view.plain, (*sun.plain, sun.rasterised(corners)[0]), draped, edge, OVERSAMPLING)
    return np.clip(np.rint(means), 0, 255).astype(np.uint8)


def _moved(grid: Grid, origin: FloatArray) -> Grid:
    return Grid(grid.x_min - float(origin[0]), grid.y_max - float(origin[1]), grid.cell, grid.rows, grid.cols)


@dataclass(frozen=True, slots=True)
class _Projection:
    """A parallel projection: rows of `axes` are right, up and forward; `pixel` in metres."""

    axes: FloatArray
    low: FloatArray
    pixel: float
    shape: tuple[int, int]

    @classmethod
    def of(cls, corners: FloatArray, azimuth_deg: float, down_deg: float, most: int) -> _Projection:
        a, d = np.radians(azimuth_deg), np.radians(down_deg)
        forward = np.array([np.sin(a) * np.cos(d), np.cos(a) * np.cos(d), -np.sin(d)])
        right = np.array([np.cos(a), -np.sin(a), 0.0])
        axes = np.array([right, np.cross(right, forward), forward])
        seen = corners.reshape(-1, 3) @ axes[:2].T
        low, high = seen.min(axis=0), seen.max(axis=0)
        pixel = max(float((high - low).max()) / most, 1e-6)
        cols, rows = (max(int(np.ceil(s / pixel)), OVERSAMPLING) for s in high - low)
        return cls(axes, low, pixel, (rows - rows % OVERSAMPLING, cols - cols % OVERSAMPLING))

    @property
    def plain(self) -> tuple[FloatArray, FloatArray, float]:
        """Axes, lowest right and up, pixel."""
        return self.axes, self.low, self.pixel

    def seen(self, points: FloatArray) -> FloatArray:
        """(…, 3) column, row (from the top), depth in metres."""
        turned = points @ self.axes.T
        col = (turned[..., 0] - self.low[0]) / self.pixel
        row = self.shape[0] - (turned[..., 1] - self.low[1]) / self.pixel
        return np.stack([col, row, turned[..., 2]], axis=-1)

    def rasterised(self, corners: FloatArray) -> tuple[Float32Array, Int32Array]:
        """Depth and number of the nearest triangle in every pixel; infinity and −1 where there is none."""
        depth, triangle = np.full(self.shape, np.inf, np.float32), np.full(self.shape, -1, np.int32)
        _rasterise(np.ascontiguousarray(self.seen(corners)), depth, triangle)
        return depth, triangle


@njit(cache=True, nogil=True)
def _rasterise(seen: FloatArray, depth: Float32Array, triangle: Int32Array) -> None:
    rows, cols = depth.shape
    for t in range(len(seen)):
        ax, ay, az = seen[t, 0, 0], seen[t, 0, 1], seen[t, 0, 2]
        bx, by, bz = seen[t, 1, 0], seen[t, 1, 1], seen[t, 1, 2]
        cx, cy, cz = seen[t, 2, 0], seen[t, 2, 1], seen[t, 2, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-12:
            continue
        first_row = max(int(np.floor(min(ay, by, cy) - 0.5)), 0)
        last_row = min(int(np.ceil(max(ay, by, cy) - 0.5)), rows - 1)
        first_col = max(int(np.floor(min(ax, bx, cx) - 0.5)), 0)
        last_col = min(int(np.ceil(max(ax, bx, cx) - 0.5)), cols - 1)
        # shares of the corners change by the same steps from pixel to pixel
        u_col, u_row, v_col, v_row = (by - cy) / area, (cx - bx) / area, (cy - ay) / area, (ax - cx) / area
        for row in range(first_row, last_row + 1):
            u_here = u_col * (0.5 - cx) + u_row * (row + 0.5 - cy)
            v_here = v_col * (0.5 - cx) + v_row * (row + 0.5 - cy)
            for col in range(first_col, last_col + 1):
                u, v = u_here + u_col * col, v_here + v_col * col
                if u < 0 or v < 0 or u + v > 1:
                    continue
                z = cz + u * (az - cz) + v * (bz - cz)
                if z < depth[row, col]:
                    depth[row, col] = z
                    triangle[row, col] = t


def light_of(corners: FloatArray) -> FloatArray:
    """(T,) brightness of each triangle by how it is turned to the sun."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    return np.asarray(0.62 + 0.45 * np.clip(normal @ _to_sun() / np.maximum(length, 1e-12), 0, None))


def _to_sun() -> FloatArray:
    a, h = np.radians(SUN_DEG), np.radians(SUN_HEIGHT_DEG)
    return np.array([np.sin(a) * np.cos(h), np.cos(a) * np.cos(h), np.sin(h)])
