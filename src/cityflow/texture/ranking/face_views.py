"""View of a face in images, without occlusion (Frommholz 2017, section 5).

A face that is partly behind a camera or beyond the image's frame is cut, not dropped: first in the camera's frame, by a near plane and by the pyramid
of what the lens can show, then in image coordinates by the frame itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.texture import FacePlane, FaceView
from cityflow.texture.ranking.clipping import in_frames, in_pyramids, ring_measures
from cityflow.texture.ranking.field_of_view import NEAR_M, reach

PIECES = 12
"""Into how many pieces an edge is cut where the lens bends it: half a pixel is left of a bend of 70; set by hand."""
LEAST_SHARE = 1e-9
"""Nothing but rounding is below it."""
WHOLE = 1.0 - 1e-6
"""From this share on a face counts as wholly in the frame."""


@dataclass(frozen=True, slots=True)
class _Cameras:
    """The distinct cameras of some images.

    Attributes
    ----------
    cameras : as they first occur
    of_image : (I,) which of them took each image
    reach : (C, 4) least and greatest x/z, y/z that each can show
    """

    cameras: tuple[Camera, ...]
    of_image: IntArray
    reach: FloatArray

    def distorted(self, points: FloatArray, image: IntArray) -> FloatArray:
        """(K, 3) points in the frames of their images → (K, 2) image coordinates."""
        normal = points[:, :2] / points[:, 2:]
        return self._each(image, normal, Camera.distort)

    def undistorted(self, uv: FloatArray, image: IntArray) -> FloatArray:
        """(K, 2) image coordinates → (K, 2) x/z, y/z."""
        return self._each(image, uv, Camera.undistort)

    def _each(self, image: IntArray, values: FloatArray, change) -> FloatArray:  # type: ignore[no-untyped-def]
        if len(self.cameras) == 1:
            return np.asarray(change(self.cameras[0], values))
        out = np.empty_like(values)
        of_point = self.of_image[image]
        for k, camera in enumerate(self.cameras):
            mine = of_point == k
            if np.any(mine):
                out[mine] = change(camera, values[mine])
        return out


def views_of(face: FacePlane, images: Sequence[OrientedImage]) -> tuple[FaceView, ...]:
    """How those of the images look at a face that have it, or some of it, in their frame, from outside; in their order.

    `FaceView.image` counts among `images`.
    """
    towards = np.array([(image.centre - face.origin) @ face.normal for image in images])
    front = [int(i) for i in np.flatnonzero(towards > NEAR_M)]
    if not front:
        return ()
    chosen = [images[i] for i in front]
    cameras = _cameras_of(chosen)
    rotations = np.ascontiguousarray([image.rotation for image in chosen])
    centres = np.ascontiguousarray([image.centre - face.origin for image in chosen])
    uv, start = _in_frames(face, rotations, centres, cameras)
    rings = len(face.rings)
    image = np.repeat(np.arange(len(chosen)), np.diff(start).reshape(len(chosen), rings).sum(axis=1))
    rays = _rays(cameras.undistorted(uv, image), rotations[image])
    feet = _feet(rays, centres[image], face.normal)
    measures = ring_measures(np.column_stack([feet @ face.right, feet @ face.up]), start).reshape(-1, rings, 3)
    area = np.abs(measures[:, 0, 0]) - np.abs(measures[:, 1:, 0]).sum(axis=1)
    inside = area / max(float(face.polygon.area), 1e-12)
    seen = np.flatnonzero(inside > LEAST_SHARE)
    far = _farthest(feet, centres, start, rings, seen)
    gsd = _worst_gsd(face, cameras, (rotations[seen], centres[seen]), uv[far], seen)
    incidence = _incidence_deg(face, measures[seen, 0, 1:], centres[seen])
    share = np.minimum(inside[seen], 1.0)
    return tuple(
        FaceView(front[i], float(g), float(a), float(s)) for i, g, a, s in zip(seen, gsd, incidence, share, strict=True)
    )


def _cameras_of(images: Sequence[OrientedImage]) -> _Cameras:
    number: dict[Camera, int] = {}
    of_image = np.array([number.setdefault(image.camera, len(number)) for image in images], np.int64)
    return _Cameras(tuple(number), of_image, np.array([reach(camera) for camera in number]))


def _in_frames(
    face: FacePlane, rotations: FloatArray, centres: FloatArray, cameras: _Cameras
) -> tuple[FloatArray, IntArray]:
    """(K, 2) image coordinates of the face's rings as far as they are in the frames, and where ring r of image i begins, at i · rings + r."""
    flat = np.ascontiguousarray(np.concatenate([ring - face.origin for ring in face.rings]))
    ring_start = np.cumsum([0, *(len(ring) for ring in face.rings)])
    pyramids = np.ascontiguousarray(cameras.reach[cameras.of_image])
    bent = np.array([not camera.is_pinhole for camera in cameras.cameras])
    pieces = np.where(bent[cameras.of_image], PIECES, 1)
    points, start = in_pyramids(flat, ring_start, rotations, centres, pyramids, NEAR_M, pieces)
    of_ring = np.repeat(np.arange(len(rotations)), len(face.rings))
    image = np.repeat(of_ring, np.diff(start))
    uv = np.column_stack([cameras.distorted(points, image), np.zeros(len(points))])
    sizes = np.array([(camera.width, camera.height) for camera in cameras.cameras], np.float64)
    framed, begin = in_frames(uv, start, np.ascontiguousarray(sizes[cameras.of_image[of_ring]]))
    return framed[:, :2], begin


def _rays(normal: FloatArray, rotations: FloatArray) -> FloatArray:
    """(K, 3) world directions whose depth is 1."""
    local = np.concatenate([normal, np.ones((len(normal), 1))], axis=1)
    return np.einsum("ki,kij->kj", local, rotations)


def _feet(rays: FloatArray, centres: FloatArray, normal: FloatArray) -> FloatArray:
    """(K, 3) where rays meet the plane through the origin; NaN where they leave it behind."""
    slope = rays @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(slope < 0, -(centres @ normal) / slope, np.nan)
        return np.asarray(centres + depth[:, None] * rays)


def _farthest(feet: FloatArray, centres: FloatArray, start: IntArray, rings: int, seen: IntArray) -> IntArray:
    """Vertices, one of each image seen, of the cut face that are farthest from the camera."""
    far = np.empty(len(seen), np.int64)
    for n, i in enumerate(seen):
        first, last = int(start[i * rings]), int(start[i * rings + 1])
        far[n] = first + int(np.argmax(np.sum((feet[first:last] - centres[i]) ** 2, axis=1)))
    return far


def _worst_gsd(
    face: FacePlane, cameras: _Cameras, poses: tuple[FloatArray, FloatArray], uv: FloatArray, seen: IntArray
) -> FloatArray:
    """Root of the area on the face of the pixels hit by the farthest vertices; infinite where a pixel reaches beyond the horizon of the plane."""
    sizes = np.array([(camera.width, camera.height) for camera in cameras.cameras], np.float64)[cameras.of_image[seen]]
    pixel = np.clip(np.floor(uv), 0.0, sizes - 1.0)
    corners = (pixel[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])).reshape(-1, 2)
    image = np.repeat(np.arange(len(seen)), 4)
    rays = _rays(cameras.undistorted(corners, seen[image]), poses[0][image])
    feet = _feet(rays, poses[1][image], face.normal).reshape(-1, 4, 3)
    one, two = feet[:, 2] - feet[:, 0], feet[:, 3] - feet[:, 1]
    area = np.linalg.norm(np.cross(one, two), axis=1) / 2
    return np.sqrt(np.where(np.isfinite(area), area, np.inf))


def _incidence_deg(face: FacePlane, middle: FloatArray, centres: FloatArray) -> FloatArray:
    """Angles between the normal and the rays from the middles (s, t) to the cameras."""
    towards = centres - (middle[:, :1] * face.right + middle[:, 1:] * face.up)
    cosine = (towards @ face.normal) / np.linalg.norm(towards, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
