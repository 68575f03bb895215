"""How far away something can stand that hides ground of a tile of a local frame: mostly much nearer than the limit that is set by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.kernels import njit
from cityflow.core.local_frame import LocalFrame

BORDER_STEPS = 33
"""Places along each side of a picture whose rays bound its view; they bend little between."""


def hiding_reach(
    images: Sequence[OrientedImage], frame: LocalFrame, bounds: Bounds, heights: tuple[float, float]
) -> float:
    """Largest distance in the plan of a frame between a place and what hides it from an image, metres.

    A ray from a place to a camera leaves the layer of air between the lowest place and the highest object after a path that is as long as the ray is
    slanting. Its share in the frame's plan is largest at a corner of the tile, or of the picture: it is a norm by a linear function of the place.

    Parameters
    ----------
    images : oriented in the world
    bounds : of the tile, metres in the frame
    heights : of the lowest place of the tile, and of the highest object around, world metres
    """
    corners = _corners(frame, bounds, heights)
    share = max(
        (min(_steepest(image.centre - corners, frame), _steepest(-_border(image), frame)) for image in images),
        default=0.0,
    )
    return max(heights[1] - heights[0], 0.0) * share


def farthest_hiding(
    points: FloatArray, heights: FloatArray, bounds: Bounds, lowest: float, share: float, margin_m: float
) -> float:
    """Largest distance in the plan of a frame from a tile at which a point is high enough to hide something of the tile, metres.

    Parameters
    ----------
    points : (N, 3) in the frame;  heights : (N,) their heights in the world
    bounds : of the tile;  lowest : its lowest place, world metres
    share : what a ray moves in plan at most as it rises by a metre (`hiding_reach`)
    margin_m : surfaces may stand so far from their points, and rise so far above them
    """
    return float(_farthest_hiding(points, heights, bounds, lowest - margin_m, share, margin_m))


@njit(cache=True, nogil=True)
def _farthest_hiding(points, heights, bounds, lowest, share, margin):  # type: ignore[no-untyped-def]
    farthest = 0.0
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        across = max(bounds[0] - x, x - bounds[2], 0.0)
        along = max(bounds[1] - y, y - bounds[3], 0.0)
        away = np.sqrt(across * across + along * along)
        if away > farthest and away - margin <= (heights[i] - lowest) * share:
            farthest = away
    return farthest


def _steepest(rays: FloatArray, frame: LocalFrame) -> float:
    """The most that one of (N, 3) rays towards a camera moves in the plan of the frame as it rises by a metre of the world."""
    if np.any(rays[:, 2] <= 0):
        return np.inf
    return float(np.max(np.linalg.norm((rays @ frame.frame_from_world.T)[:, :2], axis=1) / rays[:, 2]))


def _corners(frame: LocalFrame, bounds: Bounds, heights: tuple[float, float]) -> FloatArray:
    """(8, 3) world places of the corners of a tile at both heights."""
    r, origin = frame.frame_from_world, frame.origin
    x, y, z = (v.ravel() for v in np.meshgrid(bounds[0::2], bounds[1::2], heights))
    along = (z - origin[2] - r[0, 2] * x - r[1, 2] * y) / r[2, 2]
    return frame.to_world(np.column_stack([x, y, along]))


def _border(image: OrientedImage) -> FloatArray:
    """(N, 3) world rays through the border of a picture."""
    u, v = np.linspace(0, image.camera.width, BORDER_STEPS), np.linspace(0, image.camera.height, BORDER_STEPS)
    sides = [(u, np.full_like(u, v[k])) for k in (0, -1)] + [(np.full_like(v, u[k]), v) for k in (0, -1)]
    return image.rays(np.concatenate([np.column_stack(side) for side in sides]))
