"""How sure it is that a box is a window: a logistic model of what speaks for it and against it."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.windows.candidates import RIM_M, Candidates
from cityflow.windows.edges import Edges, roughness
from cityflow.windows.picture import Picture

NAMES = (
    "one", "sides", "two worst sides", "worst step", "contrast", "company", "alone", "completed", "rough rim", "rough inside", "aspect", "size",
    "by hue", "pixels across", "company of all", "unlike the others", "restless wall",
)  # fmt: skip
SQUARE_M = 0.7
WEIGHTS = np.array(
    [-0.64, 0.86, -0.3, 0.11, 0.83, 0.84, -0.59, -1.24, -0.41, -0.11, -1.09, -2.91, 0.53, 1.52, 2.04, -1.94, -0.4]
)


def features(
    found: Candidates, company: IntArray, late: FloatArray, picture: Picture, looks: Sequence[Edges]
) -> FloatArray:
    """(N, 17) in the order of `NAMES`; all about 0 to 3."""
    wide, high = (picture.cell * (found.boxes[:, k + 2] - found.boxes[:, k]) for k in (0, 1))
    rim, inside = roughness(looks, found.look, found.boxes, max(round(picture.pixels(RIM_M)), 1))
    usual = [np.median(v) if len(v) else 1.0 for v in (wide, high)]
    return np.column_stack([
        np.ones(len(found)), found.sides.mean(axis=1), np.sort(found.sides, axis=1)[:, :2].mean(axis=1),
        np.clip(found.steps.min(axis=1), -1, 4), np.clip(found.contrast, -1, 6) / 2, np.minimum(company, 4) / 2, company == 0, late,
        np.clip(rim, 0, 4), np.clip(inside, 0, 4), np.abs(np.log(wide / high)), np.maximum(np.abs(np.log(wide * high / 1.5)) - np.log(3), 0), found.look >= 2,
        np.clip(np.log(np.minimum(wide, high) / picture.cell / 10), -1.2, 1.5), np.full(len(found), np.mean(company > 0) if len(found) else 0.0),
        np.clip(np.abs(np.log(wide / usual[0])) + np.abs(np.log(high / usual[1])), 0, 2), np.full(len(found), restlessness(picture, looks)),
    ])  # fmt: skip


def restlessness(picture: Picture, looks: Sequence[Edges]) -> float:
    """How much brightness scatters within squares of a window's size, in the middle of all squares, in thresholds: walls are quiet between their windows."""
    size = (max(round(picture.pixels(SQUARE_M)), 3),) * 2
    mean, squares = (cv2.boxFilter(v.astype(np.float64), -1, size) for v in (picture.light, picture.light**2))
    scatter = np.sqrt(np.maximum(squares - mean**2, 0))[picture.seen]
    return float(np.clip(np.median(scatter) / looks[0].threshold, 0, 6)) if len(scatter) else 0.0


def confidence(
    found: Candidates, company: IntArray, late: FloatArray, picture: Picture, looks: Sequence[Edges]
) -> FloatArray:
    """(N,) 0 to 1."""
    return np.asarray(1 / (1 + np.exp(-features(found, company, late, picture, looks) @ WEIGHTS)))
