"""Canvas of a patch: pixels in the geometry of the root image, or cells of the face's plane, with their world positions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.texture import FaceGrid, FacePlane
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.texture.patches.patch_parameters import PatchParameters
from cityflow.texture.patches.pixel_set import depth_inside

MOST_DISTORTION_PX = 0.5
"""What the lens may bend a face before it is rectified: half a pixel is not seen; set by hand."""

FAR_PX = 1e6
"""Farther than any patch is wide."""
LEAST_DEPTH = 1e-3
"""Metres in front of a camera below which a vertex counts as behind it."""
LENS_MARGIN = 0.02
"""Share of the image's size beyond its frame up to which a lens model may be trusted; set by hand."""
INSIDE_TRIANGLE = np.array([[4, 4, 4], [6, 6, 0], [6, 0, 6], [0, 6, 6], [8, 2, 2], [2, 8, 2], [2, 2, 8]]) / 12.0
"""Places in a triangle where a lens is asked what it bends."""


Placed = Callable[[FloatArray], FloatArray]
"""From (N, 2) column, row in a patch to places elsewhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """The raster of a patch.

    Attributes
    ----------
    depth : (rows, cols) float32, distance of a pixel's centre from the face's edge, pixels, positive inside
    own : (rows, cols) bool, pixels that get a colour of an image of their own; at least one
    corners : column, row, d of the vertices, ring by ring, as in `Patch.corners`
    to_world : from places in the patch to (N, 3) world metres
    gsd_m : size of a pixel on the face, metres
    first : (2,) int64 column, row of its first pixel in the root image; zeros where it has not its geometry
    in_root : whether it has
    """

    depth: Float32Array
    own: BoolArray
    corners: tuple[FloatArray, ...]
    to_world: Placed
    gsd_m: float
    first: IntArray
    in_root: bool

    @property
    def count(self) -> int:
        """Number of own pixels."""
        return int(np.count_nonzero(self.own))

    def places(self) -> NDArray[np.int32]:
        """(N,) where the own pixels are, row after row, counted through all pixels of the canvas."""
        return np.flatnonzero(self.own).astype(np.int32)

    def centres(self, places: NDArray[np.int32]) -> FloatArray:
        """(N, 2) column, row of the middles of pixels."""
        row, col = np.divmod(places, self.shape[1])
        return np.asarray(np.column_stack([col, row]) + 0.5)

    @property
    def shape(self) -> tuple[int, int]:
        return int(self.depth.shape[0]), int(self.depth.shape[1])

    def distance(self, of: BoolArray) -> Float32Array:
        """(N,) distance of each own pixel from those of them that are marked, (N,) bool, pixels; 0 at them, huge where none is."""
        raster = np.ones(self.shape, np.uint8)
        raster[self.own] = ~of
        if raster.all():
            return np.full(len(of), FAR_PX, np.float32)
        return np.asarray(cv2.distanceTransform(raster, cv2.DIST_L2, cv2.DIST_MASK_5)[self.own])


def root_canvas(face: FacePlane, root: OrientedImage, gsd_m: float, parameters: PatchParameters) -> Canvas | None:
    """The window of the root image that shows the face; None where the face should rather be rectified.

    That is where a vertex is behind the camera, too much of the face is outside the frame, it is larger than a patch may be, or the lens bends it so much
    that straight interpolation between its vertices would miss.
    """
    projected = [root.project(ring) for ring in face.rings]
    if min(float(depth.min()) for _, depth in projected) < LEAST_DEPTH or not _in_reach(projected, root, parameters):
        return None
    uv = [p for p, _ in projected]
    if not root.camera.is_pinhole and bending_px(face, root) > MOST_DISTORTION_PX:
        return None
    pad = parameters.padding_px + 1
    first = np.floor(np.min([p.min(axis=0) for p in uv], axis=0)).astype(np.int64) - pad
    last = np.ceil(np.max([p.max(axis=0) for p in uv], axis=0)).astype(np.int64) + pad
    cols, rows = (int(n) for n in last - first)
    if max(rows, cols) > parameters.largest_px or rows * cols > parameters.most_px:
        return None
    depth = depth_inside([p - first for p in uv], rows, cols, pad + 1.0)
    corners = tuple(np.column_stack([p - first, d]) for p, d in projected)
    own, to_world = _own(depth, parameters), partial(_on_face, face, root, first)
    if own.any():
        return Canvas(depth, own, corners, to_world, gsd_m, first, True)
    return _speck(face, root, Canvas(depth, own, corners, to_world, gsd_m, first, True))


def front_canvas(face: FacePlane, cell_m: float, parameters: PatchParameters) -> Canvas:
    """The face straight from the front, in cells of `cell_m` or, where it would be larger than a patch may be, larger ones."""
    pad = parameters.padding_px + 1
    s_0, t_0, s_1, t_1 = face.polygon.bounds
    cell = max(cell_m, parameters.finest_m, _least_cell(s_1 - s_0, t_1 - t_0, 2 * pad + 1, parameters))
    grid = FaceGrid.over(face.polygon, cell, pad)
    on_grid = [(face.on_plane(ring) - (grid.s_min, grid.t_max)) / (cell, -cell) for ring in face.rings]
    depth = depth_inside(on_grid, grid.rows, grid.cols, pad + 1.0)
    corners = tuple(np.column_stack([p, np.ones(len(p))]) for p in on_grid)
    own = _own(depth, parameters)
    if not own.any():
        point = face.polygon.representative_point()
        own[int((grid.t_max - point.y) / cell), int((point.x - grid.s_min) / cell)] = True
        return Canvas(depth, own, corners, partial(_at_point, face), cell, np.zeros(2, np.int64), False)
    return Canvas(depth, own, corners, partial(_on_grid, face, grid), cell, np.zeros(2, np.int64), False)


def _least_cell(wide: float, tall: float, more_px: int, parameters: PatchParameters) -> float:
    """The finest cell, metres, with which a rectangle, metres, and some more pixels either way, is no larger than a patch may be."""
    room = max(parameters.largest_px - more_px, 1)
    # (wide / cell + more) · (tall / cell + more) = most, solved for the cell
    rest, line = parameters.most_px - more_px**2, more_px * (wide + tall)
    return max(wide / room, tall / room, (line + math.sqrt(line**2 + 4.0 * rest * wide * tall)) / (2.0 * rest))


def bending_px(face: FacePlane, root: OrientedImage) -> float:
    """How far the image of a point is from where a renderer that interpolates between the vertices looks for it, pixels, at worst."""
    rings = [face.on_plane(ring) for ring in face.rings]
    xyz = np.concatenate(face.rings)
    triangles: IntArray = triangulate_polygon(rings)
    uv, d = root.project(xyz)
    triplets = np.column_stack([uv * d[:, None], d])[triangles]
    asked = np.einsum("kv,tvx->tkx", INSIDE_TRIANGLE, triplets).reshape(-1, 3)
    truth, _ = root.project(np.einsum("kv,tvx->tkx", INSIDE_TRIANGLE, xyz[triangles]).reshape(-1, 3))
    return float(np.linalg.norm(asked[:, :2] / asked[:, 2:] - truth, axis=1).max(initial=0.0))


def _in_reach(projected: list[tuple[FloatArray, FloatArray]], root: OrientedImage, parameters: PatchParameters) -> bool:
    """Whether enough of the face is in the frame; with a lens, whether all of it is or nearly."""
    size = np.array([root.camera.width, root.camera.height], np.float64)
    uv = np.concatenate([p for p, _ in projected])
    low, high = uv.min(axis=0), uv.max(axis=0)
    if not root.camera.is_pinhole:
        return bool(np.all(low > -LENS_MARGIN * size) and np.all(high < (1 + LENS_MARGIN) * size))
    within = np.clip(np.minimum(high, size) - np.maximum(low, 0.0), 0.0, None)
    whole = np.maximum(high - low, 1e-9)
    return bool(np.prod(np.minimum(within / whole, 1.0)) >= 1.0 - parameters.most_outside)


def _own(depth: Float32Array, parameters: PatchParameters) -> BoolArray:
    """Pixels well inside; of a narrow face, those nearer to its middle than to its edge."""
    return np.asarray(depth > max(min(parameters.inset_px, 0.5 * float(depth.max())), 0.0))


def _on_face(face: FacePlane, root: OrientedImage, first: IntArray, at: FloatArray) -> FloatArray:
    """(N, 3) where the rays of the root's pixels meet the plane of the face."""
    rays = root.rays(at + first)
    far = float((face.origin - root.centre) @ face.normal)
    return np.asarray(root.centre + (far / (rays @ face.normal))[:, None] * rays)


def _on_grid(face: FacePlane, grid: FaceGrid, at: FloatArray) -> FloatArray:
    """(N, 3) places of a grid on the face."""
    return face.world(np.array([grid.s_min, grid.t_max]) + np.array([grid.cell, -grid.cell]) * at)


def _at_point(face: FacePlane, at: FloatArray) -> FloatArray:
    """(N, 3) one and the same point of the face: all that there is of a face between the centres of pixels."""
    point = face.polygon.representative_point()
    return np.broadcast_to(face.world(np.array([[point.x, point.y]])), (len(at), 3))


def _speck(face: FacePlane, root: OrientedImage, canvas: Canvas) -> Canvas | None:
    """Of a face between the centres of pixels: the pixel that it is in."""
    col, row = (int(k) for k in np.floor(root.project(_at_point(face, np.zeros((1, 2))))[0][0]) - canvas.first)
    if not (0 <= row < canvas.shape[0] and 0 <= col < canvas.shape[1]):
        return None
    own = np.zeros(canvas.shape, bool)
    own[row, col] = True
    return replace(canvas, own=own, to_world=partial(_at_point, face))
