"""Robust statistics of height differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray

MAD_TO_SIGMA = 1.4826
"""A normal distribution's standard deviation over its median absolute deviation."""


@dataclass(frozen=True, slots=True)
class ErrorStatistics:
    """Statistics of differences in metres (estimate minus truth).

    Attributes
    ----------
    count : number of finite differences;  missing : number of NaN ones
    bias : median;  mean;  nmad : 1.4826 · median absolute deviation from the median
    rmse : root mean square;  le95 : 95 % quantile of absolute differences
    """

    count: int
    missing: int
    bias: float
    mean: float
    nmad: float
    rmse: float
    le95: float


def nmad(differences: FloatArray) -> float:
    """Normalised median absolute deviation, in the unit of the differences; NaN without any.

    >>> round(nmad(np.array([-1.0, 0.0, 1.0])), 4)
    1.4826
    """
    finite = differences[np.isfinite(differences)]
    if finite.size == 0:
        return float("nan")
    return float(MAD_TO_SIGMA * np.median(np.abs(finite - np.median(finite))))


def rmse(differences: FloatArray) -> float:
    """Root mean square; NaN without any finite difference."""
    finite = differences[np.isfinite(differences)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def le95(differences: FloatArray) -> float:
    """Linear error that 95 % of the differences do not exceed; NaN without any finite difference."""
    finite = differences[np.isfinite(differences)]
    return float(np.percentile(np.abs(finite), 95)) if finite.size else float("nan")


def error_statistics(differences: FloatArray) -> ErrorStatistics:
    """All statistics of differences of any shape; NaN differences are counted as missing."""
    finite = differences[np.isfinite(differences)]
    missing = int(differences.size - finite.size)
    if finite.size == 0:
        nan = float("nan")
        return ErrorStatistics(0, missing, nan, nan, nan, nan, nan)
    return ErrorStatistics(
        int(finite.size),
        missing,
        float(np.median(finite)),
        float(np.mean(finite)),
        nmad(finite),
        rmse(finite),
        le95(finite),
    )
