"""What a patch is painted on: pixels in the geometry of the root image, or cells of the face's plane; and where each of them is in the world."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.texture import FaceGrid, FacePlane
from cityflow.geometry.triangulation import triangulate_polygon
from cityflow.texture.patches.parameters import PatchParameters
from cityflow.texture.patches.pixel_set import depth_inside

FAR_PX = 1e6
LEAST_DEPTH = 1e-3
"""Metres in front of a camera below which a vertex counts as behind it."""
LENS_MARGIN = 0.02
"""Share of the image's size beyond its frame up to which a lens model may be trusted."""
INSIDE_TRIANGLE = np.array([[4, 4, 4], [6, 6, 0], [6, 0, 6], [0, 6, 6], [8, 2, 2], [2, 8, 2], [2, 2, 8]]) / 12.0
"""Places in a triangle where a lens is asked what it bends."""


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """The raster of a patch.

    Attributes
    ----------
    depth : (rows, cols) float32, distance of a pixel's centre from the face's edge, pixels, positive inside
    own : (rows, cols) bool, pixels that get a colour of an image of their own; at least one
    xyz : (N, 3) world metres of the own pixels, row after row
    corners : column, row, d of the vertices, ring by ring, as in `Patch.corners`
    uv : (N, 2) image coordinates of the own pixels in the root image, where the canvas has its geometry
    gsd_m : size of a pixel on the face, metres
    first : column, row of its first pixel in the root image; (0, 0) where it has not its geometry
    """

    depth: Float32Array
    own: BoolArray
    xyz: FloatArray
    corners: tuple[FloatArray, ...]
    uv: FloatArray | None
    gsd_m: float
    first: tuple[int, int] = (0, 0)

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
    if not root.camera.is_pinhole and bending_px(face, root) > parameters.most_distortion_px:
        return None
    pad = parameters.padding_px + 1
    first = np.floor(np.min([p.min(axis=0) for p in uv], axis=0)).astype(np.int64) - pad
    last = np.ceil(np.max([p.max(axis=0) for p in uv], axis=0)).astype(np.int64) + pad
    cols, rows = (int(n) for n in last - first)
    if max(rows, cols) > parameters.largest_px:
        return None
    depth = depth_inside([p - first for p in uv], rows, cols, pad + 1.0)
    corners = tuple(np.column_stack([p - first, d]) for p, d in projected)
    row, col = np.nonzero(_own(depth, parameters))
    at = np.column_stack([col, row]) + first + 0.5
    if not len(at):
        return _speck(face, root, depth, (first, corners, gsd_m))
    own = _own(depth, parameters)
    return Canvas(depth, own, _on_face(face, root, at), corners, at, gsd_m, (int(first[0]), int(first[1])))


def front_canvas(face: FacePlane, cell_m: float, parameters: PatchParameters) -> Canvas:
    """The face straight from the front, in cells of `cell_m` or, where it would be larger than a patch may be, larger ones."""
    pad = parameters.padding_px + 1
    s_0, t_0, s_1, t_1 = face.polygon.bounds
    room = max(parameters.largest_px - 2 * pad - 1, 1)
    cell = max(cell_m, parameters.finest_m, (s_1 - s_0) / room, (t_1 - t_0) / room)
    grid = FaceGrid.over(face.polygon, cell, pad)
    on_grid = [(face.on_plane(ring) - (grid.s_min, grid.t_max)) / (cell, -cell) for ring in face.rings]
    depth = depth_inside(on_grid, grid.rows, grid.cols, pad + 1.0)
    corners = tuple(np.column_stack([p, np.ones(len(p))]) for p in on_grid)
    own = _own(depth, parameters)
    st = grid.centres()[own]
    if not own.any():
        point = face.polygon.representative_point()
        st = np.array([[point.x, point.y]])
        own[int((grid.t_max - point.y) / cell), int((point.x - grid.s_min) / cell)] = True
    return Canvas(depth, own, face.world(st), corners, None, cell)


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


def _on_face(face: FacePlane, root: OrientedImage, uv: FloatArray) -> FloatArray:
    """(N, 3) where the rays of image coordinates meet the plane of the face."""
    rays = root.rays(uv)
    far = float((face.origin - root.centre) @ face.normal)
    return np.asarray(root.centre + (far / (rays @ face.normal))[:, None] * rays)


def _speck(
    face: FacePlane, root: OrientedImage, depth: Float32Array, rest: tuple[IntArray, tuple[FloatArray, ...], float]
) -> Canvas | None:
    """Of a face between the centres of pixels: the pixel that it is in."""
    first, corners, gsd_m = rest
    point = face.polygon.representative_point()
    xyz = face.world(np.array([[point.x, point.y]]))
    pixel = np.floor(root.project(xyz)[0][0]).astype(np.int64)
    col, row = (int(k) for k in pixel - first)
    if not (0 <= row < depth.shape[0] and 0 <= col < depth.shape[1]):
        return None
    own = np.zeros(depth.shape, bool)
    own[row, col] = True
    return Canvas(depth, own, xyz, corners, pixel[None, :] + 0.5, gsd_m, (int(first[0]), int(first[1])))
