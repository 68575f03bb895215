"""Principal orientations of a boundary: peaks of a histogram of its edge directions, weighted by length.

After Burns, Hanson and Riseman (1986), as Gross 2005 §2.3 uses them: boundary points vote with the direction of their
surroundings, so that a staircase of cells counts as the straight edge that it stands for.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray

_BINS = 180
"""Of half a degree within a right angle."""
_RIGHT_ANGLE = np.pi / 2


def chord_directions(points: FloatArray, reach: int) -> tuple[FloatArray, FloatArray]:
    """Direction (radians, 0 to π/2) of the boundary at each point of a closed ring, and how straight it is there.

    Parameters
    ----------
    points : (n, 2) evenly spaced along the ring
    reach : the chord spans this many points either way

    Returns
    -------
    direction, straightness : (n,); straightness is 1 on a straight edge and falls to 0 around a right-angled corner
    """
    chord = np.roll(points, -reach, axis=0) - np.roll(points, reach, axis=0)
    to_next, to_last = np.roll(points, -reach, axis=0) - points, points - np.roll(points, reach, axis=0)
    cosine = (to_next * to_last).sum(axis=1) / np.maximum(np.hypot(*to_next.T) * np.hypot(*to_last.T), 1e-9)
    return np.arctan2(chord[:, 1], chord[:, 0]) % _RIGHT_ANGLE, np.clip(cosine, 0, 1) ** 8


def principal_orientations(
    direction: FloatArray, weight: FloatArray, apart_deg: float = 12.0, least_share: float = 0.15
) -> list[float]:
    """Orientations (radians, 0 to π/2, each standing for itself and its perpendicular), strongest first.

    Parameters
    ----------
    direction, weight : (n,) votes
    apart_deg : a vote nearer than this to an orientation found before belongs to that one
    least_share : an orientation with a smaller share of all votes is none
    """
    found: list[float] = []
    total, left = weight.sum(), weight.copy()
    while total > 0:
        peak = _peak(direction, left)
        near = distance_of_orientations(direction, peak) < np.radians(apart_deg)
        if found and left[near].sum() < least_share * total:
            break
        found.append(peak)
        left = np.where(near, 0.0, left)
        if left.sum() < least_share * total:
            break
    return found


def distance_of_orientations(a: FloatArray, b: float | FloatArray) -> FloatArray:
    """Angle between orientations modulo 90°, radians, 0 to π/4."""
    difference = np.abs(np.asarray(a) - b) % _RIGHT_ANGLE
    return np.asarray(np.minimum(difference, _RIGHT_ANGLE - difference))


def _peak(direction: FloatArray, weight: FloatArray) -> float:
    """The fullest bin of a smoothed circular histogram, refined by the mean of the votes within 4° of it."""
    bins = (direction / _RIGHT_ANGLE * _BINS).astype(int) % _BINS
    histogram = np.bincount(bins, weight, _BINS)
    kernel = np.exp(-0.5 * (np.arange(-9, 10) / 3.0) ** 2)
    smooth = np.convolve(np.tile(histogram, 3), kernel, "same")[_BINS : 2 * _BINS]
    centre = (int(np.argmax(smooth)) + 0.5) / _BINS * _RIGHT_ANGLE
    for _ in range(3):
        offset = (direction - centre + _RIGHT_ANGLE / 2) % _RIGHT_ANGLE - _RIGHT_ANGLE / 2
        near = np.abs(offset) < np.radians(4)
        if weight[near].sum() > 0:
            centre += float(np.average(offset[near], weights=weight[near]))
    return centre % _RIGHT_ANGLE
