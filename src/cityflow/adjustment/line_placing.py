"""Place, direction and scale of a model whose images were taken along one line: positions leave the roll about it open, which directions tell."""

from __future__ import annotations

import numpy as np

from cityflow.adjustment.placing import OUTLYING, Fit
from cityflow.core.arrays import FloatArray
from cityflow.geometry.similarity import Similarity

LEAST_ACROSS = 0.2
"""Directions nearer to the line than this sine tell nothing of the roll about it; set by hand."""
ROUNDS = 5


def line_fit(source: FloatArray, target: FloatArray, ours: FloatArray, theirs: FloatArray, least_m: float) -> Fit:
    """The similarity that most places along a line agree with; the roll is that of most directions.

    Parameters
    ----------
    source, target : (N, 3) places, three at least
    ours, theirs : (K, 3) unit vectors of the same directions in the frame of the source, and of the target
    least_m : places nearer than this are never left out

    Raises
    ------
    ValueError
        The places do not extend along a line, or no direction tells the roll.
    """
    used = np.ones(len(source), bool)
    for _ in range(ROUNDS):
        fitted = _fitted(source[used], target[used], ours, theirs)
        away = np.linalg.norm(fitted.moved(source) - target, axis=1)
        kept = away <= max(OUTLYING * float(np.median(away)), least_m)
        if kept.sum() < 3 or np.array_equal(kept, used):
            break
        used = kept
    return Fit(fitted, used, fitted.moved(source) - target)


def _fitted(source: FloatArray, target: FloatArray, ours: FloatArray, theirs: FloatArray) -> Similarity:
    along, goal = _direction(source), _direction(target)
    s, t = source @ along, target @ goal
    if np.sum((s - s.mean()) * (t - t.mean())) < 0:
        goal, t = -goal, -t
    scale = _middle_slope(s, t)
    if not scale > 0:
        raise ValueError("the places do not extend along a line")
    frame, frame_of_goal = _frame(along), _frame(goal)
    one, other = ours @ frame[1:].T, theirs @ frame_of_goal[1:].T
    across = (np.linalg.norm(one, axis=1) > LEAST_ACROSS) & (np.linalg.norm(other, axis=1) > LEAST_ACROSS)
    if not across.any():
        raise ValueError("no direction tells the roll about the line")
    turns = np.arctan2(other[across, 1], other[across, 0]) - np.arctan2(one[across, 1], one[across, 0])
    mean = np.angle(np.exp(1j * turns).sum())
    roll = mean + float(np.median(np.angle(np.exp(1j * (turns - mean)))))
    turn = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    rotation = frame_of_goal.T @ turn @ frame
    return Similarity(scale, rotation, np.median(target - scale * source @ rotation.T, axis=0))


def _direction(points: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0])


def _frame(along: FloatArray) -> FloatArray:
    """(3, 3) rows: the line, and two directions across it, right-handed."""
    across = np.eye(3)[int(np.argmin(np.abs(along)))]
    across = across - (across @ along) * along
    across /= np.linalg.norm(across)
    return np.stack([along, across, np.cross(along, across)])


def _middle_slope(s: FloatArray, t: FloatArray) -> float:
    """Of t over s, the median of all pairs that lie far apart (Theil 1950)."""
    one, other = np.triu_indices(len(s), 1)
    apart = s[other] - s[one]
    far = np.abs(apart) > 0.3 * float(np.abs(apart).max())
    return float(np.median((t[other] - t[one])[far] / apart[far]))
