"""Found windows against true ones: precision and recall at an intersection over union."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.texture import FacePlane

IOU = 0.5
"""Found from this intersection over union on: the usual one of detection."""
MOSTLY = 0.7
"""Of a found window, behind what hides the wall: then it is neither right nor wrong; set by hand."""


@dataclass(frozen=True, slots=True)
class WindowCounts:
    """Of one wall or many.

    Attributes
    ----------
    found, right : windows found, and of these those that lie upon a true one, each true one once
    true, seen : true windows whose picture is whole enough to ask for them, and of these those that were found
    iou : sum of the intersections over unions of the right ones
    """

    found: int = 0
    right: int = 0
    true: int = 0
    seen: int = 0
    iou: float = 0.0

    def __add__(self, other: WindowCounts) -> WindowCounts:
        return WindowCounts(*(getattr(self, n) + getattr(other, n) for n in ("found", "right", "true", "seen", "iou")))

    @property
    def precision(self) -> float:
        return self.right / self.found if self.found else 1.0

    @property
    def recall(self) -> float:
        return self.seen / self.true if self.true else 1.0


def total(counts: Iterable[WindowCounts]) -> WindowCounts:
    """All walls together."""
    return sum(counts, start=WindowCounts())


def compare_windows(found: FloatArray, true: FloatArray, visible: BoolArray) -> WindowCounts:
    """Windows of one wall.

    Parameters
    ----------
    found, true : (N, 4) and (M, 4), s and t of the lower left and the upper right corner
    visible : (M,) whether the picture shows enough of a true window to ask for it; what is found upon the others is right at an intersection over
        union like any, and else, where most of it lies upon them, neither right nor wrong
    """
    shared = intersection_over_union(found, true)
    right, matched, iou = np.zeros(len(found), bool), np.zeros(len(true), bool), 0.0
    for k in np.argsort(-shared, axis=None, kind="stable"):
        i, j = divmod(int(k), len(true))
        if shared[i, j] < IOU:
            break
        if not matched[j] and not right[i]:
            right[i], matched[j], iou = True, True, iou + float(shared[i, j])
    spared = ~right & (_within(found, true[~visible]) > MOSTLY)
    counted = int(len(found) - spared.sum())
    return WindowCounts(counted, int(right.sum()), int(visible.sum()), int((matched & visible).sum()), iou)


def _within(found: FloatArray, true: FloatArray) -> FloatArray:
    """(N,) largest share of a found box that lies upon one true one."""
    low, high = np.maximum(found[:, None, :2], true[None, :, :2]), np.minimum(found[:, None, 2:], true[None, :, 2:])
    both = np.clip(high - low, 0, None).prod(axis=2)
    return np.asarray(both.max(axis=1, initial=0.0) / np.maximum((found[:, 2:] - found[:, :2]).prod(axis=1), 1e-12))


def intersection_over_union(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N, M) of boxes."""
    low, high = np.maximum(a[:, None, :2], b[None, :, :2]), np.minimum(a[:, None, 2:], b[None, :, 2:])
    both = np.clip(high - low, 0, None).prod(axis=2)
    area_a, area_b = ((x[:, 2:] - x[:, :2]).prod(axis=1) for x in (a, b))
    return np.asarray(both / np.maximum(area_a[:, None] + area_b[None] - both, 1e-12))


def on_face(
    face: FacePlane, corners: FloatArray, most_off_m: float, most_turned: float = 0.05
) -> tuple[FloatArray, BoolArray]:
    """True openings in the frame of a face: (N, 4) bounds, and which of them are on it, (N,) bool.

    Parameters
    ----------
    corners : (N, 4, 3) world metres
    most_off_m : farthest from the face's plane
    most_turned : sine of the angle between an opening's sill and the plane, at most
    """
    flat = face.on_plane(corners.reshape(-1, 3)).reshape(len(corners), 4, 2)
    off = np.abs((corners - face.origin) @ face.normal).max(axis=1, initial=0.0)
    sill = corners[:, 1] - corners[:, 0]
    normals = np.cross(sill, corners[:, 3] - corners[:, 0])
    facing = normals @ face.normal > (1 - most_turned) * np.linalg.norm(normals, axis=1)
    return np.concatenate([flat.min(axis=1), flat.max(axis=1)], axis=1), np.asarray((off <= most_off_m) & facing)
