"""The block: poses, cameras and tie points, what they predict, and how that changes with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.adjustment.tracks import Ties
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import PERSPECTIVE, Camera, OrientedImage

INTERIOR = 8
"""Unknowns of a camera that is calibrated: focal length, principal point, k1, k2, p1, p2, k3 (Brown 1971); of a fisheye lens k1 to k4, the last is not used."""
STEP = 1e-6
"""Of numeric derivatives, in units of x/z: errors of rounding and of the second order are alike small."""


@dataclass(frozen=True, slots=True)
class Block:
    """Unknowns of an adjustment.

    Attributes
    ----------
    rotations : (N, 3, 3) camera_from_world;  centres : (N, 3) metres, from a local origin
    camera : (N,) number of each image's camera;  cameras : these
    heads : (N,) names of the images' cameras, see `OrientedImage`
    xyz : (P, 3) tie points, metres from the local origin
    """

    rotations: FloatArray
    centres: FloatArray
    camera: IntArray
    cameras: tuple[Camera, ...]
    heads: tuple[str, ...]
    xyz: FloatArray

    @staticmethod
    def of(images: Sequence[OrientedImage], origin: FloatArray) -> Block:
        """The block of some images, without points; images of one head with one given camera share it, two heads never do, whatever their data sheets say."""
        known: dict[tuple[str, Camera], int] = {}
        camera = np.array([known.setdefault((i.head, i.camera), len(known)) for i in images], np.int64)
        rotations = np.array([i.rotation for i in images]).reshape(-1, 3, 3)
        centres = np.array([i.centre - origin for i in images]).reshape(-1, 3)
        heads = tuple(i.head for i in images)
        return Block(rotations, centres, camera, tuple(c for _, c in known), heads, np.empty((0, 3)))

    def image(self, number: int, name: str, origin: FloatArray) -> OrientedImage:
        """One of its images, in the world."""
        camera = self.cameras[self.camera[number]]
        return OrientedImage(name, camera, self.rotations[number], self.centres[number] + origin, self.heads[number])

    def moved(self, poses: FloatArray, points: FloatArray, interior: FloatArray) -> Block:
        """After a step.

        Parameters
        ----------
        poses : (N, 6) rotation vectors in the camera frames, radians; moves of the centres, metres
        points : (P, 3) metres;  interior : (K, 8) of the cameras, see `with_interior`
        """
        rotations = rotation_of(poses[:, :3]) @ self.rotations
        cameras = tuple(with_interior(c, d) for c, d in zip(self.cameras, interior, strict=True))
        return replace(
            self, rotations=rotations, centres=self.centres + poses[:, 3:], cameras=cameras, xyz=self.xyz + points
        )


def residuals(block: Block, ties: Ties) -> tuple[FloatArray, FloatArray]:
    """(M, 2) where each point is seen less where the block has it, pixels; (M,) depths, metres."""
    local = _local(block, ties)
    depth = local[:, 2]
    normal = local[:, :2] / np.where(np.abs(depth) < 1e-9, 1e-9, depth)[:, None]
    left = np.empty((len(ties.point), 2))
    for number, rows in _by_camera(block, ties):
        left[rows] = ties.uv[rows] - block.cameras[number].distort(normal[rows])
    return left, depth


def slopes(block: Block, ties: Ties) -> tuple[FloatArray, FloatArray, FloatArray]:
    """How predicted image coordinates change: (M, 2, 6) with the pose, (M, 2, 3) with the point, (M, 2, 8) with the camera."""
    local = _local(block, ties)
    depth = np.where(np.abs(local[:, 2]) < 1e-9, 1e-9, local[:, 2])
    normal = local[:, :2] / depth[:, None]
    lens = np.empty((len(ties.point), 2, 2))
    interior = np.empty((len(ties.point), 2, INTERIOR))
    for number, rows in _by_camera(block, ties):
        camera = block.cameras[number]
        for axis in range(2):
            step = np.eye(2)[axis] * STEP
            change = camera.distort(normal[rows] + step) - camera.distort(normal[rows] - step)
            lens[rows, :, axis] = change / (2 * STEP)
        for k in range(INTERIOR):
            one, other = (with_interior(camera, np.eye(INTERIOR)[k] * sign * STEP) for sign in (1.0, -1.0))
            interior[rows, :, k] = (one.distort(normal[rows]) - other.distort(normal[rows])) / (2 * STEP)
    to_plane = np.zeros((len(depth), 2, 3))
    to_plane[:, 0, 0] = to_plane[:, 1, 1] = 1.0 / depth
    to_plane[:, :, 2] = -normal / depth[:, None]
    of_local = lens @ to_plane
    of_point = of_local @ block.rotations[ties.image]
    of_turn = np.cross(local[:, None, :], of_local)
    return np.concatenate([of_turn, -of_point], axis=2), of_point, interior


def with_interior(camera: Camera, change: FloatArray) -> Camera:
    """A camera after a change of (8,): focal length and principal point in shares of the focal length, then distortion."""
    if not np.any(change):
        return camera
    old = (*camera.distortion, *(0.0,) * 5)[: max(5, len(camera.distortion))]
    new = [a + b for a, b in zip(old, (*change[3:8], *(0.0,) * 3), strict=False)]
    if camera.kind != PERSPECTIVE:
        new = new[:4]
    f = camera.fx
    longer, right, down = (float(v) for v in change[:3])
    return replace(
        camera,
        fx=f * (1.0 + longer), fy=camera.fy * (1.0 + longer), cx=camera.cx + f * right, cy=camera.cy + f * down,
        distortion=tuple(float(v) for v in new),
    )  # fmt: skip


def interior_change(then: Camera, now: Camera) -> FloatArray:
    """(8,) what leads from one camera to the other, see `with_interior`."""
    old, new = (np.array([*c.distortion, *(0.0,) * 5])[:5] for c in (then, now))
    main = now.fx / then.fx - 1.0, (now.cx - then.cx) / then.fx, (now.cy - then.cy) / then.fx
    return np.array([*main, *(new - old)])


def rotation_of(vectors: FloatArray) -> FloatArray:
    """(N, 3, 3) rotations by (N, 3) rotation vectors, radians (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    cross = np.zeros((len(vectors), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    cross = cross - np.swapaxes(cross, 1, 2)
    safe = np.maximum(angle, 1e-12)
    return np.eye(3) + np.sin(safe) / safe * cross + (1 - np.cos(safe)) / safe**2 * (cross @ cross)


def vector_of(rotations: FloatArray) -> FloatArray:
    """(N, 3) rotation vectors of (N, 3, 3) rotations by less than half a turn, radians."""
    skew = (rotations - np.swapaxes(rotations, 1, 2)) / 2
    sine = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, (np.trace(rotations, axis1=1, axis2=2) - 1) / 2)
    return sine * np.where(size > 1e-12, angle / np.maximum(size, 1e-12), 1.0)[:, None]


def _local(block: Block, ties: Ties) -> FloatArray:
    offset = block.xyz[ties.point] - block.centres[ties.image]
    return np.einsum("mij,mj->mi", block.rotations[ties.image], offset)


def _by_camera(block: Block, ties: Ties) -> list[tuple[int, IntArray]]:
    number = block.camera[ties.image]
    return [(k, np.flatnonzero(number == k)) for k in range(len(block.cameras))]
