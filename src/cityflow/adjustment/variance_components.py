"""How exact groups of observations are: variance components of image coordinates, positions and rotations (Förstner and Wrobel 2016, §4.2.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.normal_equations import Normal
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import robust_weights
from cityflow.core.arrays import BoolArray, FloatArray

FEW_REDUNDANT = 3.0
"""Redundant observations of a group below which their residuals tell little of how exact it is; set by hand, as are those below."""
FEW_TOLD, SHARE_TOLD = 10.0, 0.05
"""A variance becomes no smaller where residuals tell it no better than this many observations would, or this share of the group's: from there on down all
values are alike likely, and one that is too small holds the block at errors."""
NEAR, MOST_STEPS = 2.0, 4.0
"""A variance that is off by more than this factor is led nearer by plain steps first; then an estimate goes no further at once than this factor, and so many
plain steps."""
POSITIONS, ROTATIONS = slice(3, 6), slice(0, 3)
"""Columns of poses, in the order of their groups."""


@dataclass(frozen=True, slots=True)
class Redundancy:
    """What residuals of the (N, 6) given poses can show of their errors.

    Attributes
    ----------
    covariances : (N, 6, 6) of the adjusted poses: radians and metres
    observed : (2,) positions and rotations that are given, coordinates and angles
    shares : (2,) how many of them are redundant: traces of the residuals' projection
    traces : (2, 2) sums of its squares: by how much squared residuals of one group change with the variance of the other
    """

    covariances: FloatArray
    observed: FloatArray
    shares: FloatArray
    traces: FloatArray


def redundancy_of(normal: Normal, firm: FloatArray, lost: float) -> Redundancy:
    """Of the given poses.

    Parameters
    ----------
    firm : (N, 6) weights of the given poses, 0 where none is given
    lost : positions that unknowns of their own use up: a common shift, antennas' arms
    """
    images = len(firm)
    root = np.sqrt(firm)
    covariances = np.empty((images, 6, 6))
    traces = np.zeros((2, 2))
    for first, columns in normal.pose_columns():
        last = first + columns.shape[1] // 6
        part = columns.reshape(images, 6, last - first, 6)
        inside = np.arange(first, last)
        covariances[first:last] = part[inside, :, inside - first]
        project = -root[:, :, None, None] * part * root[first:last]
        project[inside, :, inside - first] += np.eye(6) * (firm[inside, :, None] > 0)
        for g, rows in enumerate((POSITIONS, ROTATIONS)):
            for h, others in enumerate((POSITIONS, ROTATIONS)):
                traces[g, h] += float(np.sum(project[:, rows, :, others] ** 2))
    free = np.where(firm > 0, 1.0 - np.einsum("nii->ni", covariances) * firm, 0.0)
    shares = np.array([max(float(free[:, k].sum()), 1e-3) for k in (POSITIONS, ROTATIONS)])
    shares[0] = max(shares[0] - lost, 1e-3)
    traces[0, 0] = max(traces[0, 0] - lost, 1e-3)
    observed = np.array([float((firm[:, k] > 0).sum()) for k in (POSITIONS, ROTATIONS)])
    return Redundancy(covariances, observed, shares, traces)


def variance_factors(away: FloatArray, firm: FloatArray, found: Redundancy, open_groups: BoolArray) -> FloatArray:
    """(2,) by what the variances of positions and rotations are to be multiplied; 1 for groups that are known.

    The squares of residuals are what they are expected to be if each group has its variance (Helmert 1907): two equations, solved together. The plain
    estimate, squares over redundancy, needs dozens of steps where few positions are redundant.

    Parameters
    ----------
    away : (N, 6) the adjusted poses less those given
    open_groups : (2,) which of the variances are unknown
    """
    squares = np.array([float(np.sum(away[:, k] ** 2 * firm[:, k])) for k in (POSITIONS, ROTATIONS)])
    plain = squares / found.shares
    factors = np.where(open_groups, plain, 1.0)
    few = found.shares < FEW_REDUNDANT
    # what too little redundancy says does not make a standard deviation larger
    factors[few & open_groups] = np.minimum(plain, 1.0)[few & open_groups]
    solved = np.flatnonzero(open_groups & ~few)
    if len(solved):
        step = np.linalg.solve(found.traces[np.ix_(solved, solved)], (squares - found.shares)[solved])
        near = (plain[solved] < NEAR) & (plain[solved] > 1.0 / NEAR)
        furthest = np.clip(plain[solved] ** MOST_STEPS, 1.0 / NEAR, NEAR)
        least, most = np.sort([plain[solved], np.where(near, furthest, plain[solved])], axis=0)
        factors[solved] = np.clip(1.0 + step, least, most)
    untold = np.diagonal(found.traces) < np.minimum(FEW_TOLD, SHARE_TOLD * found.observed)
    factors[untold & open_groups] = np.maximum(factors, 1.0)[untold & open_groups]
    return factors


@dataclass(frozen=True, slots=True)
class Balance:
    """What weighs image coordinates rightly against other observations, although robust weights of good ones are below 1 / variance.

    Attributes
    ----------
    weights, residuals : factors of all weights, and of all residuals
    """

    weights: float
    residuals: float


def balance(left: FloatArray, ties: Ties, scale: float, poses: float) -> Balance:
    """Of residuals under Cauchy's loss.

    Estimates by a robust loss have the information of slope² / mean square of its influence (Huber 1981, §6.3), both here by the residuals themselves.
    With these factors the normal equations have this information, and their right sides are in proportion to it.

    Parameters
    ----------
    left : (M, 2) residuals, pixels;  scale : standard deviation of image coordinates, pixels
    poses : redundant observations of poses, which are not those of image coordinates
    """
    spare = spare_of(ties, poses)
    squares = np.sum(left**2, axis=1) / (ties.sigma * scale) ** 2
    weights = robust_weights(left, ties.sigma, scale) * (ties.sigma * scale) ** 2
    errors = squares * (2 * len(left) / spare)
    slope = float(np.mean(1.0 / (1.0 + errors / 8.0) ** 2))
    influence = float(np.sum(weights**2 * squares)) / spare
    mean = float(np.mean(weights))
    return Balance(slope**2 / influence / mean, mean / slope)


def pixel_sigma(left: FloatArray, ties: Ties, poses: float) -> float:
    """Standard deviation of image coordinates, robustly, pixels.

    Residuals on two rays are smaller than those on ten: each is divided by what its point leaves of it, and points on two rays, which leave one number of
    four, are not asked where there are others.
    """
    lengths = ties.lengths[ties.point]
    asked = lengths > 2
    if not asked.any():
        asked = np.ones(len(lengths), bool)
    share = (2.0 * lengths - 3.0) / (2.0 * lengths)
    normed = np.abs(left[asked]) / (ties.sigma * np.sqrt(share))[asked, None]
    of_points = max(2.0 * len(ties.point) - 3.0 * ties.points, 1.0)
    return 1.4826 * float(np.median(normed)) * float(np.sqrt(of_points / spare_of(ties, poses)))


def spare_of(ties: Ties, poses: float) -> float:
    """Redundant image coordinates, where `poses` unknowns are left to them."""
    return max(2.0 * len(ties.point) - 3.0 * ties.points - poses, 1.0)
