"""Which of many images look at a place: their poses in tables, the plans of what they see in a tree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import STRtree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import Camera
from cityflow.core.grid import Bounds
from cityflow.orientation.views import View

LEAST_DEPTH_M = 1e-12
SURE_M, SURE_PX = 1e-3, 1.0
"""A corner so far in front of a camera, and so far within its frame, is there however a computation rounds."""


class ViewIndex:
    """Views that are asked for by place, many at once.

    Parameters
    ----------
    views : in the order that answers keep
    plans : of each the polygon, world metres, on which it may see something

    Attributes
    ----------
    names : (N,) of the views, texts
    """

    def __init__(self, views: Sequence[View], plans: Sequence[shapely.Polygon]) -> None:
        self.views = views
        self.names = np.array([v.name for v in views], object)
        self._plans = np.array([*plans], object)
        self._tree = STRtree(plans)
        cameras: dict[Camera, int] = {}
        self._camera = np.array([cameras.setdefault(v.image.camera, len(cameras)) for v in views], np.int64)
        self._cameras = list(cameras)
        self._rotations = np.array([v.image.rotation for v in views]).reshape(-1, 3, 3)
        self.centres = np.array([v.image.centre for v in views]).reshape(-1, 3)
        self._heights = np.array([v.heights for v in views]).reshape(-1, 2)

    def over(self, bounds: Bounds) -> IntArray:
        """(K,) the views whose plan meets a box, ascending."""
        return np.sort(self._tree.query(shapely.box(*bounds), predicate="intersects"))

    def over_each(self, boxes: FloatArray) -> tuple[IntArray, IntArray]:
        """(P,) numbers of (N, 4) boxes, and of the views whose plan meets them, both ascending."""
        if not len(boxes):
            return np.empty(0, np.int64), np.empty(0, np.int64)
        # most plans around some units hold all of them; of the others each is asked of all boxes, which is quicker than each box of all plans
        around = *boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist()
        near = self.over(around)
        holds = shapely.covers(self._plans[near], shapely.box(*around))
        every, some = near[holds], near[~holds]
        view, box = STRtree(shapely.box(*boxes.T)).query(self._plans[some], predicate="intersects")
        box = np.concatenate([np.repeat(np.arange(len(boxes)), len(every)), box])
        view = np.concatenate([np.tile(every, len(boxes)), some[view]])
        order = np.lexsort((view, box))
        return box[order], view[order]

    def heights_over_each(self, boxes: FloatArray) -> FloatArray:
        """(N, 2) lowest ground and highest object that the views over (N, 4) boxes expect, metres; NaN where none looks."""
        box, view = self.over_each(boxes)
        seen, first = np.unique(box, return_index=True)
        found = np.full((len(boxes), 2), np.nan)
        if len(seen):
            low, high = self._heights[view].T
            found[seen] = np.column_stack([np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)])
        return found

    @property
    def heights(self) -> tuple[float, float]:
        """Lowest ground and highest object that any view expects, metres."""
        return float(self._heights[:, 0].min()), float(self._heights[:, 1].max())

    def have_each_in_frame(self, which: IntArray, boxes: FloatArray, box: IntArray) -> BoolArray:
        """(K,) `have_in_frame` of views and of those of (N, 8, 3) boxes that `box` numbers: most have the first corner in their frame, which is enough."""
        away = boxes[box, 0] - self.centres[which]
        local = np.einsum("kij,kj->ki", self._rotations[which], away)
        ahead = local[:, 2] > SURE_M
        normal = local[:, :2] / np.where(ahead, local[:, 2], 1.0)[:, None]
        found = np.zeros(len(which), bool)
        for number in np.unique(self._camera[which]).tolist():
            camera, own = self._cameras[number], self._camera[which] == number
            uv = camera.distort(normal[own])
            found[own] = ((uv > SURE_PX) & (uv < (camera.width - SURE_PX, camera.height - SURE_PX))).all(axis=1)
        found &= ahead
        unsure = np.flatnonzero(~found)
        found[unsure] = self.have_in_frame(which[unsure], boxes[box[unsure]])
        return found

    def have_in_frame(self, which: IntArray, corners: FloatArray) -> BoolArray:
        """(K,) whether the image of a box may meet the frame; its corners are (8, 3), or (K, 8, 3) where each view has a box of its own.

        Corners behind the camera count as inside.
        """
        local = (corners - self.centres[which, None]) @ self._rotations[which].transpose(0, 2, 1)
        depth = local[..., 2]
        normal = local[..., :2] / np.where(np.abs(depth) < LEAST_DEPTH_M, LEAST_DEPTH_M, depth)[..., None]
        meets = np.zeros(len(which), bool)
        for number in np.unique(self._camera[which]).tolist():
            camera, own = self._cameras[number], self._camera[which] == number
            uv = camera.distort(normal[own])
            low, high = uv.min(axis=1), uv.max(axis=1)
            meets[own] = (high > 0).all(axis=1) & (low < (camera.width, camera.height)).all(axis=1)
        return np.where((depth <= 0).any(axis=1), (depth > 0).any(axis=1), meets)
