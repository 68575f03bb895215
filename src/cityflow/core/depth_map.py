"""Result of matching for a reference image: depths with their precision; and the same as coloured points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray, numbers_of
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, Box
from cityflow.core.kernels import njit
from cityflow.core.local_frame import LocalFrame

IN_WORLD = LocalFrame("world", np.eye(3), np.zeros(3))


@dataclass(frozen=True, slots=True)
class DepthMap:
    """Depths over a window of one reference image, in the image's own (distorted) pixel geometry.

    Attributes
    ----------
    image : name of the reference image
    row, col : level-0 pixel of the window's upper left corner
    depth : (h, w) float32, metres along the camera's z axis at the centre of each pixel; NaN where unknown
    sigma : (h, w) float32, expected standard deviation of the depth, metres; NaN where unknown
    views : (h, w) uint8, partners that agree (the reference image not counted); 0 where unknown
    colour : (h, w, bands) uint8 or uint16, as in the image
    """

    image: str
    row: int
    col: int
    depth: Float32Array
    sigma: Float32Array
    views: ByteArray
    colour: NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class ImagePoints:
    """Points from images, in the world.

    Attributes
    ----------
    xyz : (N, 3) float64, metres
    colour : (N, bands) uint8 or uint16
    image : (N,) int64, index into `names` of the reference image
    views : (N,) uint8, partners that agree
    sigma : (N,) float32, expected standard deviation along the ray, metres
    names : reference images;  centres : (len(names), 3) their projection centres, world metres
    """

    xyz: FloatArray
    colour: NDArray[np.uint8] | NDArray[np.uint16]
    image: IntArray
    views: ByteArray
    sigma: Float32Array
    names: tuple[str, ...]
    centres: FloatArray

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def box(self) -> Box:
        """Around the points, of which there are some."""
        found: Box = _box(self.xyz)
        return found

    def take(self, chosen: BoolArray | IntArray) -> ImagePoints:
        """Some of the points: by a mask, or by their numbers."""
        at = numbers_of(chosen)
        return ImagePoints(
            self.xyz.take(at, axis=0), self.colour.take(at, axis=0), self.image.take(at), self.views.take(at), self.sigma.take(at),
            self.names, self.centres,
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _box(xyz):  # type: ignore[no-untyped-def]
    """In one pass; numpy takes ten times as long for the least of three columns side by side."""
    x_0, y_0, z_0 = xyz[0, 0], xyz[0, 1], xyz[0, 2]
    x_1, y_1, z_1 = x_0, y_0, z_0
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        x_0, y_0, z_0 = min(x, x_0), min(y, y_0), min(z, z_0)
        x_1, y_1, z_1 = max(x, x_1), max(y, y_1), max(z, z_1)
    return x_0, y_0, z_0, x_1, y_1, z_1


def standing_points(
    depth_map: DepthMap, votes: ByteArray, image: OrientedImage, bounds: Bounds, frame: LocalFrame | None = None
) -> ImagePoints:
    """The pixels with votes (h, w) as points with these as `views`, where they stand in half-open `bounds`; with a frame, points and bounds are in it.

    In one pass; with the numbers of `world_points`.
    """
    camera, turned = image.camera, frame or IN_WORLD
    corner = float(depth_map.row) + 0.5, float(depth_map.col) + 0.5
    if camera.is_pinhole:
        lens = 1.0 / camera.fx, 1.0 / camera.fy, camera.cx, camera.cy
        pose, axes = (image.rotation, image.centre), (turned.frame_from_world, turned.origin, frame is not None)
        pixel, xyz = _standing_by_pinhole(depth_map.depth, votes, corner, lens, pose, axes, bounds)
    else:
        voted = np.where(votes > 0, depth_map.depth, np.float32(np.nan))
        pixel, xyz = world_points(voted, (depth_map.row, depth_map.col), image)
        xyz = xyz if frame is None else frame.from_world(xyz)
        here = numbers_within(xyz, bounds)
        pixel, xyz = pixel.take(here), xyz.take(here, axis=0)
    centre = image.centre[None, :]
    bands = depth_map.colour.shape[-1]
    colour = depth_map.colour.reshape(-1, bands).take(pixel, axis=0) if bands else np.empty((len(xyz), 0), np.uint8)
    return ImagePoints(
        xyz, colour, np.zeros(len(xyz), np.int64), votes.take(pixel), depth_map.sigma.take(pixel), (image.name,),
        centre if frame is None else frame.from_world(centre),
    )  # fmt: skip


@intrinsic
def _fused(_typing, _a, _b, _c):  # type: ignore[no-untyped-def]
    """a · b + c, rounded once: so a product of matrices is summed by libraries for linear algebra."""

    def generate(_context, builder, _signature, args):  # type: ignore[no-untyped-def]
        number = ir.DoubleType()
        kind = ir.FunctionType(number, [number, number, number])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.fma.f64"), args)

    return types.float64(types.float64, types.float64, types.float64), generate


@njit(cache=True, nogil=True)
def _standing_by_pinhole(depth, votes, place, lens, pose, axes, bounds):  # type: ignore[no-untyped-def]
    (rotation, centre), (turn, origin, is_turned) = pose, axes
    rows, cols = depth.shape
    most = 0
    for r in range(rows):
        for c in range(cols):
            most += votes[r, c] > 0
    # one more is written and left
    pixel, out, n, at = np.empty(most + 1, np.int64), np.empty((most + 1, 3)), 0, np.empty(3)
    for r in range(rows):
        y = (r + place[0] - lens[3]) * lens[1]
        for c in range(cols):
            if votes[r, c] == 0 or not np.isfinite(depth[r, c]):
                continue
            x = (c + place[1] - lens[2]) * lens[0]
            _place(at, np.float64(depth[r, c]), x, y, rotation, centre)
            if is_turned:
                e, f, g = at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]
                for k in range(3):
                    at[k] = _fused(g, turn[k, 2], _fused(f, turn[k, 1], e * turn[k, 0]))
            pixel[n], out[n, 0], out[n, 1], out[n, 2] = r * cols + c, at[0], at[1], at[2]
            n += (at[0] >= bounds[0]) & (at[0] < bounds[2]) & (at[1] >= bounds[1]) & (at[1] < bounds[3])
    # mostly all stand there: then nothing is copied
    return (pixel[:n], out[:n]) if n == most else (pixel[:n].copy(), out[:n].copy())


def numbers_within(xyz: FloatArray, bounds: Bounds) -> IntArray:
    """(M,) numbers of the points (N, 3) that stand in half-open `bounds`."""
    return np.asarray(_numbers_within(xyz, bounds))


@njit(cache=True, nogil=True)
def _numbers_within(xyz, bounds):  # type: ignore[no-untyped-def]
    found, n = np.empty(len(xyz), np.int64), 0
    for i in range(len(xyz)):
        x, y = xyz[i, 0], xyz[i, 1]
        found[n] = i
        n += (x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])
    return found[:n]


def world_points(depth: Float32Array, corner: tuple[int, int], image: OrientedImage) -> tuple[IntArray, FloatArray]:
    """Running numbers of the pixels with a depth, (N,), and where they stand, (N, 3) world metres.

    Parameters
    ----------
    depth : (h, w) float32, metres along the camera's z axis; NaN where unknown
    corner : level-0 row and column of the upper left pixel
    """
    pixel, camera = np.flatnonzero(np.isfinite(depth)), image.camera
    place = float(corner[0]) + 0.5, float(corner[1]) + 0.5
    if camera.is_pinhole:
        lens = 1.0 / camera.fx, 1.0 / camera.fy, camera.cx, camera.cy
        return pixel, _by_pinhole(depth, pixel, place, lens, image.rotation, image.centre)
    rows, cols = np.divmod(pixel, depth.shape[1])
    normal = camera.undistort(np.column_stack([cols + place[1], rows + place[0]]))
    return pixel, _placed(depth.ravel(), pixel, normal, image.rotation, image.centre)


@njit(cache=True, nogil=True, inline="always")
def _place(out, z, x, y, rotation, centre):  # type: ignore[no-untyped-def]
    """A ray's component along the camera's z axis is 1, so depth times ray reaches the point."""
    for k in range(3):
        out[k] = centre[k] + z * (x * rotation[0, k] + y * rotation[1, k] + rotation[2, k])


@njit(cache=True, nogil=True)
def _by_pinhole(depth, pixel, place, lens, rotation, centre):  # type: ignore[no-untyped-def]
    out, cols = np.empty((len(pixel), 3)), depth.shape[1]
    for i in range(len(pixel)):
        r, c = pixel[i] // cols, pixel[i] % cols
        x, y = (c + place[1] - lens[2]) * lens[0], (r + place[0] - lens[3]) * lens[1]
        _place(out[i], np.float64(depth[r, c]), x, y, rotation, centre)
    return out


@njit(cache=True, nogil=True)
def _placed(depth, pixel, normal, rotation, centre):  # type: ignore[no-untyped-def]
    out = np.empty((len(pixel), 3))
    for i in range(len(pixel)):
        _place(out[i], np.float64(depth[pixel[i]]), normal[i, 0], normal[i, 1], rotation, centre)
    return out


def joined(parts: Sequence[ImagePoints], bands: int = 3) -> ImagePoints:
    """One cloud of all points, in the order given; reference images of the same name become one."""
    if not parts:
        return ImagePoints(
            np.empty((0, 3)), np.empty((0, bands), np.uint8), np.empty(0, np.int64), np.empty(0, np.uint8),
            np.empty(0, np.float32), (), np.empty((0, 3)),
        )  # fmt: skip
    centres = {name: p.centres[i] for p in parts for i, name in enumerate(p.names)}
    number = {name: i for i, name in enumerate(centres)}
    image, first = np.empty(sum(len(p) for p in parts), np.int64), 0
    for p in parts:
        numbers = np.asarray([number[n] for n in p.names], np.int64)
        image[first : first + len(p)] = numbers[0] if len(numbers) == 1 else numbers[p.image]
        first += len(p)
    return ImagePoints(
        np.concatenate([p.xyz for p in parts]), np.concatenate([p.colour for p in parts]), image,
        np.concatenate([p.views for p in parts]), np.concatenate([p.sigma for p in parts]), tuple(centres),
        np.array(list(centres.values())),
    )  # fmt: skip
