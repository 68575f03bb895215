"""Which of many points an image's depth maps may have in view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.kernels import njit

BORDER_STEPS = 33
"""Places along each side of a picture whose rays bound its view."""

RUN = 1024
"""Points of a depth map that are asked about together where none of them can be in view: a few of its rows."""
APART_M = 1e-3
"""A box so far beyond a plane is beyond it: far more than float64 rounds."""


class Boxes(NamedTuple):
    """Around each `RUN` of points: (M, 3) half the sum of its corners, and half their difference, metres."""

    middle: FloatArray
    half: FloatArray


class Limits(NamedTuple):
    """Least and greatest x/z and y/z of the rays of an image's rasters."""

    u_min: float
    v_min: float
    u_max: float
    v_max: float


class View(NamedTuple):
    """What an image's rasters show: limits, and (4, 4) the planes through the projection centre around them, normal and offset; what lies above one of
    these is not in view."""

    image: OrientedImage
    limits: Limits
    planes: FloatArray


def view_of(image: OrientedImage, corner: tuple[int, int], shape: tuple[int, ...]) -> View:
    """That of a window of an image, a little widened; `corner`: its upper left pixel, row and column."""
    height, width = shape
    along = np.linspace(0.0, 1.0, BORDER_STEPS)
    u, v = corner[1] + along * width, corner[0] + along * height
    border = np.concatenate([
        np.column_stack([u, np.full(BORDER_STEPS, v[0])]), np.column_stack([u, np.full(BORDER_STEPS, v[-1])]),
        np.column_stack([np.full(BORDER_STEPS, u[0]), v]), np.column_stack([np.full(BORDER_STEPS, u[-1]), v]),
    ])  # fmt: skip
    normal = image.camera.undistort(border)
    more = 4.0 / image.camera.fx
    limits = Limits(*map(float, (*(normal.min(axis=0) - more), *(normal.max(axis=0) + more))))
    x, y, z = image.rotation
    around = np.array([limits.u_min * z - x, limits.v_min * z - y, x - limits.u_max * z, y - limits.v_max * z])
    return View(image, limits, np.column_stack([around, around @ image.centre]))


def run_boxes(xyz: FloatArray) -> Boxes:
    """Of points (N, 3), world metres."""
    if not len(xyz):
        return Boxes(np.empty((0, 3)), np.empty((0, 3)))
    first = np.arange(0, len(xyz), RUN)
    low, high = np.minimum.reduceat(xyz, first), np.maximum.reduceat(xyz, first)
    return Boxes((high + low) / 2, (high - low) / 2)


def may_see(views: Sequence[View], boxes: Boxes) -> BoolArray:
    """(N,) which views may have a point of some boxes, by the one box around all."""
    if not len(boxes.middle) or not views:
        return np.zeros(len(views), np.bool_)
    low, high = (boxes.middle - boxes.half).min(axis=0), (boxes.middle + boxes.half).max(axis=0)
    beyond = _beyond(np.stack([v.planes for v in views]), Boxes((low + high) / 2, (high - low) / 2))
    return np.asarray(~beyond.any(axis=1))


def in_view(xyz: FloatArray, boxes: Boxes, view: View) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Row of each point (N, 3) in view; x/z and y/z; depth, and how far the camera is away in plan, metres."""
    runs = np.flatnonzero(~_beyond(view.planes[:, None], boxes).any(axis=0))
    image = view.image
    found: tuple[IntArray, FloatArray, FloatArray, FloatArray]
    found = _in_view(xyz, runs, image.rotation, image.centre, view.limits)
    return found


def _beyond(planes: FloatArray, boxes: Boxes) -> BoolArray:
    """(..., M) whether boxes lie above planes (..., M or 1, 4) with all that is in them."""
    normal, offset = planes[..., :3], planes[..., 3]
    least = np.einsum("...k,...k->...", normal, boxes.middle) - np.einsum("...k,...k->...", np.abs(normal), boxes.half)
    return np.asarray(least - offset > APART_M)


@njit(cache=True, nogil=True)
def _in_view(xyz, runs, rotation, centre, limits):  # type: ignore[no-untyped-def]
    """Row of each point of some runs that is in view; x/z and y/z; depth; and how far the camera is away in plan, metres."""
    n = len(runs) * RUN
    at, normal = np.empty(n, np.int64), np.empty((n, 2))
    depth, aside = np.empty(n), np.empty(n)
    found = 0
    for run in runs:
        for i in range(run * RUN, min((run + 1) * RUN, len(xyz))):
            x, y, z = xyz[i, 0] - centre[0], xyz[i, 1] - centre[1], xyz[i, 2] - centre[2]
            far = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
            if far <= 0:
                continue
            u = (rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z) / far
            v = (rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z) / far
            if u < limits.u_min or v < limits.v_min or u > limits.u_max or v > limits.v_max:
                continue
            at[found], normal[found, 0], normal[found, 1] = i, u, v
            depth[found], aside[found] = far, np.sqrt(x * x + y * y)
            found += 1
    return at[:found], normal[:found], depth[:found], aside[:found]
