"""A town as an orthographic camera would see it: parallel rays, one light, heights in the local frame of the view."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.synthetic import noise_tiles
from cityflow.synthetic.ambient import sky_of
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Material
from cityflow.synthetic.render import RenderParameters
from cityflow.synthetic.sampling import simple_pixels, within_pixels
from cityflow.synthetic.shading import Light, Samples, radiances

PIXELS_AT_ONCE = 200_000
ABOVE_M = 10.0
FAR_M = 1e6
"""Where the observer stands for the shading: rays from there are parallel to within a tenth of a second of arc per metre."""
NO_HAZE_M = 1e15
OFF_SURFACE_M = 0.002


@dataclass(frozen=True, slots=True)
class ParallelView:
    """What parallel rays see, (rows, cols) each.

    Attributes
    ----------
    light : (rows, cols, bands) float32, 1 for white in the sun
    height : float64, local frame metres towards the observer; NaN where nothing of the area is seen
    triangle : int64, of the scene's mesh; -1 with it
    lit : bool, whether the sun reaches the place
    """

    light: Float32Array
    height: FloatArray
    triangle: IntArray
    lit: BoolArray


def parallel_view(
    scene: Scene, frame: LocalFrame, grid: Grid, area: Bounds, parameters: RenderParameters
) -> ParallelView:
    """Look along -z of a local frame at what stands over `area` (world metres); the rest stays empty.

    The `parameters` give sun, sky and sampling; lens and sensor play no part.
    """
    eye = _Eye(scene, frame, grid, area, parameters)
    light = np.zeros((*grid.shape, parameters.bands), np.float32)
    height, lit = np.full(grid.shape, np.nan), np.zeros(grid.shape, bool)
    triangle = np.full(grid.shape, NOTHING)
    for rows in _chunks(grid):
        light[rows], height[rows], triangle[rows], lit[rows] = eye.look(rows)
    return ParallelView(light, height, triangle, lit)


def parallel_heights(scene: Scene, frame: LocalFrame, grid: Grid) -> FloatArray:
    """(rows, cols) local frame heights of what parallel rays meet first; NaN where there is nothing."""
    top = float(frame.from_world(scene.mesh.vertices)[:, 2].max()) + ABOVE_M
    out = np.empty(grid.shape)
    for rows in _chunks(grid):
        x, y = np.meshgrid(grid.x_centres(), grid.y_centres()[rows])
        start = frame.to_world(np.column_stack([x.ravel(), y.ravel(), np.full(x.size, top)])) - scene.origin
        _, length = scene.first_hits(start, np.broadcast_to(-frame.frame_from_world[2], start.shape))
        out[rows] = np.where(np.isfinite(length), top - length, np.nan).reshape(x.shape)
    return out


def grid_over_area(frame: LocalFrame, area: Bounds, heights: tuple[float, float], cell_m: float) -> Grid:
    """The local frame's grid over all that stands over `area` between two world heights, metres."""
    x, y, z = np.meshgrid([area[0], area[2]], [area[1], area[3]], heights)
    corners = frame.from_world(np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Grid.covering((float(low[0]), float(low[1]), float(high[0]), float(high[1])), cell_m)


def grid_over_shape(frame: LocalFrame, shape: shapely.Geometry, heights: tuple[float, float], cell_m: float) -> Grid:
    """The local frame's grid over all that stands over `shape` (plan, world) between two world heights, metres."""
    xy = shapely.get_coordinates(shape)
    corners = frame.from_world(np.concatenate([np.column_stack([xy, np.full(len(xy), h)]) for h in heights]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Grid.covering((float(low[0]), float(low[1]), float(high[0]), float(high[1])), cell_m)


class _Eye:
    """Rays of one local frame into one scene."""

    def __init__(self, scene: Scene, frame: LocalFrame, grid: Grid, area: Bounds, parameters: RenderParameters) -> None:
        self.scene, self.frame, self.grid, self.area, self.p = scene, frame, grid, area, parameters
        self.looking: FloatArray = -frame.frame_from_world[2]
        self.top = float(frame.from_world(scene.mesh.vertices)[:, 2].max()) + ABOVE_M
        self.sky = sky_of(scene, parameters.ambient)
        self.sun_side = scene.surfaces.normal @ parameters.sun
        self.leaf: BoolArray = scene.surfaces.material == int(Material.LEAF)
        p = parameters
        self.sun_and_sky = Light(p.sun, p.sun_strength, p.sky_strength, NO_HAZE_M)

    def look(self, rows: slice) -> tuple[Float32Array, FloatArray, IntArray, BoolArray]:
        """Light, height, triangle and sunlight of some rows."""
        shape = rows.stop - rows.start + 2, self.grid.cols + 2
        row, col = np.mgrid[rows.start - 1 : rows.stop + 1, -1 : self.grid.cols + 1]
        triangle, depth, points = self._cast(row.ravel() + 0.5, col.ravel() + 0.5)
        lit = self._sunlit(points, triangle)
        # far away, the inverse of depth is as linear as the depth itself: the test of a perspective image serves here
        away = np.where(triangle == NOTHING, 0.0, depth) + FAR_M
        seen = triangle.reshape(shape), away.reshape(shape), lit.reshape(shape)
        simple: BoolArray = simple_pixels(*seen, self.scene.surfaces, self.grid.cell / FAR_M)
        inner = np.zeros(shape, bool)
        inner[1:-1, 1:-1] = True
        met = (seen[0] != NOTHING)[1:-1, 1:-1]
        light = np.zeros((*simple.shape, self.p.bands), np.float32)
        chosen = np.flatnonzero(inner)[(simple & met).ravel()]
        light[simple & met] = self._light(points[chosen], triangle[chosen], lit[chosen], self.grid.cell)
        mixed = np.nonzero(~simple & met)
        light[mixed] = self._sampled(mixed[0] + rows.start, mixed[1])
        height = np.where(met, self.top - depth.reshape(shape)[1:-1, 1:-1], np.nan)
        return light, height, seen[0][1:-1, 1:-1], seen[2][1:-1, 1:-1]

    def _sampled(self, row: IntArray, col: IntArray) -> Float32Array:
        n = self.p.supersampling
        triangle, _, points = self._cast(*within_pixels(row, col, n))
        light = self._light(points, triangle, self._sunlit(points, triangle), self.grid.cell / n)
        return np.asarray(light.reshape(len(row), n * n, self.p.bands).mean(axis=1))

    def _cast(self, v: FloatArray, u: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Triangle, length and place (metres from the scene's origin) that the rays through rows v, columns u meet."""
        x, y = self.grid.x_min + u * self.grid.cell, self.grid.y_max - v * self.grid.cell
        start = self.frame.to_world(np.column_stack([x, y, np.full(len(x), self.top)])) - self.scene.origin
        # rays start just above what stands here: the tree knows places as float32 only
        down = np.broadcast_to(self.looking, start.shape)
        triangle, depth = self.scene.first_hits(start, down)
        points = start + np.where(triangle == NOTHING, 0.0, depth)[:, None] * self.looking
        at = points[:, :2] + self.scene.origin[:2]
        a = self.area
        inside = (at[:, 0] >= a[0]) & (at[:, 0] <= a[2]) & (at[:, 1] >= a[1]) & (at[:, 1] <= a[3])
        return np.where(inside, triangle, NOTHING), depth, points

    def _sunlit(self, points: FloatArray, triangle: IntArray) -> BoolArray:
        lit = np.zeros(len(triangle), bool)
        asked = np.flatnonzero((triangle != NOTHING) & (self.leaf | (self.sun_side > 0))[triangle])
        hit = triangle[asked]
        side = np.where(self.sun_side[hit] > 0, OFF_SURFACE_M, -OFF_SURFACE_M)[:, None]
        start = points[asked] + side * self.scene.surfaces.normal[hit]
        lit[asked] = ~self.scene.occluded(start, np.broadcast_to(self.p.sun, start.shape))
        return lit

    def _light(self, points: FloatArray, triangle: IntArray, lit: BoolArray, pixel: float) -> Float32Array:
        out = np.empty((len(points), self.p.bands), np.float32)
        observer = -FAR_M * self.looking
        samples = Samples(points - observer, np.ones(len(points)), triangle, lit, self.sky.share(points, triangle))
        patterns = noise_tiles.grain(), noise_tiles.cloud()
        radiances(samples, self.scene.surfaces, self.sun_and_sky, observer, pixel, 0, patterns, out)
        return out


def _chunks(grid: Grid) -> Iterator[slice]:
    step = max(1, PIXELS_AT_ONCE // grid.cols)
    for top in range(0, grid.rows, step):
        yield slice(top, min(top + step, grid.rows))
