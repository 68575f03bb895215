"""How a camera moves between two frames of a sequence: points tracked (Lucas and Kanade), and the homography that most of them agree with."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray
from cityflow.core.pixels import PixelArray

WORK_PX = 640
"""Longer side of the pictures in which points are tracked."""
MOST_POINTS, APART_PX, QUALITY = 400, 12.0, 0.01
WINDOW_PX, LEVELS = 21, 4
BACK_PX, AGREE_PX = 0.7, 2.0
"""A point that is tracked back ends this near to where it began; one that agrees with the homography lies this near to it."""
LEAST_POINTS, LEAST_SHARE = 30, 0.4
"""Fewer points that agree, or a smaller share of those looked for, show nothing in common; set by hand, as all above."""
SHARP_PX = (1080, 1920)
"""Most rows and columns, in the middle of the picture, in which sharpness is measured."""
FAR_PX = 12
"""Beyond it blur changes little of what differs."""
THUMBNAIL_PX = (36, 48)
FOCAL_WIDTHS = tuple(np.geomspace(0.5, 2.0, 25).tolist())
"""Focal lengths that a camera of unknown one may have, in widths of its picture: 18 to 72 mm on film."""


@dataclass(frozen=True, slots=True, eq=False)
class SmallFrame:
    """What is kept of a frame while the next ones are compared with it.

    Attributes
    ----------
    grey : (h, w) uint8, longer side `WORK_PX` at most;  points : (N, 2) float32 that can be tracked
    """

    grey: PixelArray
    points: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """(3, 3) homography from one small frame to another, and by how many pixels points move, median."""

    homography: FloatArray
    shift_px: float


def grey_of(pixels: PixelArray) -> PixelArray:
    """(h, w) uint8 of (h, w, 3) or (h, w, 1) pixels."""
    if pixels.shape[2] == 1:
        return np.ascontiguousarray(pixels[..., 0])
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), cv2.COLOR_RGB2GRAY), np.uint8)


def small_frame(grey: PixelArray) -> SmallFrame:
    """Reduced, with points that can be tracked, spread over the picture."""
    scale = min(1.0, WORK_PX / max(grey.shape))
    if scale < 1:
        grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(np.uint8)
    found = cv2.goodFeaturesToTrack(grey, MOST_POINTS, QUALITY, APART_PX)
    points = np.empty((0, 2), np.float32) if found is None else found.reshape(-1, 2).astype(np.float32)
    return SmallFrame(grey, points)


def thumbnail(grey: PixelArray) -> NDArray[np.float32]:
    """(n,) values of a very small picture less their mean, by which doubles are found."""
    small = cv2.resize(grey, THUMBNAIL_PX[::-1], interpolation=cv2.INTER_AREA).astype(np.float32).ravel()
    return np.asarray(small - small.mean(), np.float32)


def sharpness(grey: PixelArray) -> float:
    """How much of what changes within `FAR_PX` pixels changes within one, in the direction in which it is least: a camera that turns blurs along one.

    A frame is blurred where this is well below that of its neighbours.
    """
    rows, cols = (min(n, m) for n, m in zip(grey.shape, SHARP_PX, strict=True))
    top, left = (grey.shape[0] - rows) // 2, (grey.shape[1] - cols) // 2
    middle = grey[top : top + rows, left : left + cols].astype(np.float32)
    part = np.asarray(cv2.GaussianBlur(middle, (0, 0), 0.8), np.float32)
    shares = []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        near, far = (_change(part, n * down, n * right) for n in (1, FAR_PX))
        shares.append(near / max(far, 1e-6))
    return float(min(shares))


def _change(part: NDArray[np.float32], down: int, right: int) -> float:
    """Mean square difference between pixels that lie so far apart."""
    rows, cols = part.shape
    one = part[: rows - down, max(0, -right) : cols - max(0, right)]
    other = part[down:, max(0, right) : cols - max(0, -right)]
    return float(np.mean((other - one) ** 2))


def motion(one: SmallFrame, other: SmallFrame, start: FloatArray | None = None) -> Motion | None:
    """How points of one frame move to the other; None where the two show nothing in common.

    Parameters
    ----------
    start : (3, 3) homography near which they are looked for
    """
    if len(one.points) < LEAST_POINTS:
        return None
    guess = one.points.copy() if start is None else mapped(start, one.points.astype(np.float64)).astype(np.float32)
    size, flags = (WINDOW_PX, WINDOW_PX), cv2.OPTFLOW_USE_INITIAL_FLOW
    found, state, _ = cv2.calcOpticalFlowPyrLK(
        one.grey, other.grey, one.points[:, None], guess[:, None].copy(), winSize=size, maxLevel=LEVELS, flags=flags
    )
    back, again, _ = cv2.calcOpticalFlowPyrLK(
        other.grey, one.grey, found, one.points[:, None].copy(), winSize=size, maxLevel=LEVELS, flags=flags
    )
    ends = found[:, 0]
    good = (state[:, 0] == 1) & (again[:, 0] == 1) & (np.linalg.norm(back[:, 0] - one.points, axis=1) < BACK_PX)
    height, width = other.grey.shape
    good &= (ends >= 0).all(axis=1) & (ends[:, 0] <= width - 1) & (ends[:, 1] <= height - 1)
    if good.sum() < LEAST_POINTS:
        return None
    homography, inliers = cv2.findHomography(one.points[good], ends[good], cv2.RANSAC, AGREE_PX)
    if homography is None:
        return None
    agreed = inliers[:, 0] == 1
    if agreed.sum() < max(LEAST_POINTS, LEAST_SHARE * good.sum()):
        return None
    shift = np.linalg.norm(ends[good][agreed] - one.points[good][agreed], axis=1)
    return Motion(np.asarray(homography, np.float64), float(np.median(shift)))


def mapped(homography: FloatArray, points: FloatArray) -> FloatArray:
    """(N, 2) places to which a homography leads (N, 2) points."""
    led = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(led[:, :2] / led[:, 2:])


def overlap(homography: FloatArray, shape: tuple[int, int]) -> float:
    """Share of either picture that both see, the smaller one, 0 to 1.

    >>> overlap(np.array([[1.0, 0, 16], [0, 1, 0], [0, 0, 1]]), (48, 64))
    0.75
    """
    return round(min(_seen(homography, shape), _seen(np.asarray(np.linalg.inv(homography), np.float64), shape)), 6)


def _seen(homography: FloatArray, shape: tuple[int, int]) -> float:
    height, width = shape
    frame = np.array([[0.0, 0], [width, 0], [width, height], [0, height]])
    led = np.column_stack([frame, np.ones(4)]) @ homography.T
    if (led[:, 2] <= 1e-6).any():
        return 0.0
    quad = (led[:, :2] / led[:, 2:]).astype(np.float32)
    if not cv2.isContourConvex(quad):
        return 0.0
    area, _ = cv2.intersectConvexConvex(quad, frame.astype(np.float32))
    whole = abs(cv2.contourArea(quad))
    return float(area / max(whole, 1e-6)) if whole > width * height else float(area / (width * height))


def parallax_px(homography: FloatArray, shape: tuple[int, int]) -> float:
    """What no turn of the camera explains of a homography, whatever its focal length within `FOCAL_WIDTHS`: median over the picture, pixels
    of a picture of `WORK_PX`."""
    height, width = shape
    x, y = np.meshgrid(np.linspace(0.05, 0.95, 7) * width, np.linspace(0.05, 0.95, 7) * height)
    points = np.column_stack([x.ravel(), y.ravel()])
    ends = mapped(homography, points)
    inside = (ends >= 0).all(axis=1) & (ends[:, 0] <= width) & (ends[:, 1] <= height)
    if inside.sum() < 6:
        return 0.0
    least = min(_turned(points[inside], ends[inside], f * width, (width, height)) for f in FOCAL_WIDTHS)
    return least * WORK_PX / max(shape)


def _turned(one: FloatArray, other: FloatArray, focal: float, size: tuple[int, int]) -> float:
    """Median distance of points from where the best rotation leads them, pixels (Kabsch on the rays)."""
    middle = np.array([size[0] / 2, size[1] / 2])
    rays, ends = (np.column_stack([(p - middle) / focal, np.ones(len(p))]) for p in (one, other))
    u, v = (r / np.linalg.norm(r, axis=1, keepdims=True) for r in (rays, ends))
    left, _, right = np.linalg.svd(v.T @ u)
    rotation = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    led = rays @ rotation.T
    away = led[:, :2] / led[:, 2:] * focal + middle - other
    return float(np.median(np.linalg.norm(away, axis=1)))
