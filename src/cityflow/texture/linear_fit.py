"""A line between the values of two images, whatever cars, glass and shadows say against it."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters

ROUNDS = 20
SETTLED = 1e-4
GAINS = 201
"""Gains that are tried, at equal ratios; the best lies between two of them."""
TUKEY = 4.685
"""Residuals beyond so many standard deviations have no weight."""


class RadiometryParameters(Parameters):
    """How the images of a unit are made alike."""

    least_cells: int = Field(12, ge=3, description="cells that two images see in common, from which they are compared")
    offset_sigma: float = Field(
        8.0,
        gt=0,
        description="offsets expected between images, values of 0 to 255; where there is little contrast they decide",
    )
    gain_sigma: float = Field(1.0, gt=0, description="how far gains are expected to differ from 1")
    noise: float = Field(3.0, gt=0, description="how well cells of two images agree at best, values of 0 to 255")
    most_weight: float = Field(
        60.0, ge=1, description="cells that a comparison counts as at most, since neighbours err alike"
    )
    most_gain: float = Field(8.0, gt=1, description="gains stay between 1 / this and this")
    most_offset: float = Field(60.0, ge=0, description="greatest offset, values of 0 to 255")
    sweeps: int = Field(3, ge=0, le=20, description="comparisons of every image with the middle of all, after the tree")


def fitted(x: FloatArray, y: FloatArray, parameters: RadiometryParameters) -> tuple[float, float, float]:
    """Gain, offset and spread of y = gain · x + offset, of one band, robustly and the same in both directions.

    Starts from the median ratio, a gain alone, and weighs by Tukey's function of what remains, which is measured between the two images' values, divided
    by the root of the gain. An offset needs contrast to show; without it its expectation, none, keeps it small and the gain near that ratio.

    Returns
    -------
    gain ; offset ; standard deviation of what remains (1.4826 · MAD)
    """
    start = float(np.median(np.log(np.maximum(y, 1.0) / np.maximum(x, 1.0))))
    most = np.log(parameters.most_gain)
    gain, offset, spread = float(np.exp(np.clip(start, -most, most))), 0.0, parameters.noise
    for _ in range(ROUNDS):
        rest = np.abs(y - gain * x - offset) / np.sqrt(gain)
        spread = max(1.4826 * float(np.median(rest)), parameters.noise)
        weight = np.clip(1.0 - (rest / (TUKEY * spread)) ** 2, 0.0, None) ** 2
        before, (gain, offset) = gain, _line(x, y, weight, spread, parameters)
        if abs(gain - before) < SETTLED * gain:
            break
    return gain, offset, spread


def _line(
    x: FloatArray, y: FloatArray, weight: FloatArray, spread: float, parameters: RadiometryParameters
) -> tuple[float, float]:
    """Gain and offset with the least sum of squares (y - gain · x - offset)² / gain, expectations included; offsets follow from gains."""
    total = max(float(weight.sum()), 1e-9)
    x_0, y_0 = float(weight @ x) / total, float(weight @ y) / total
    dx, dy = x - x_0, y - y_0
    xx, xy, yy = (float(weight @ v) / total for v in (dx * dx, dx * dy, dy * dy))
    trust = min(total, parameters.most_weight) / spread**2
    sigma2 = parameters.offset_sigma**2
    logs = np.linspace(-1.0, 1.0, GAINS) * np.log(parameters.most_gain)
    gain = np.exp(logs)
    contrast = trust * (yy / gain - 2 * xy + gain * xx)
    middle = (y_0 - gain * x_0) ** 2 / gain / (sigma2 + 1.0 / trust)
    best = _lowest(logs, contrast + middle + (logs / parameters.gain_sigma) ** 2)
    offset = (y_0 - best * x_0) * sigma2 / (sigma2 + 1.0 / trust)
    return best, float(np.clip(offset, -parameters.most_offset, parameters.most_offset))


def _lowest(logs: FloatArray, costs: FloatArray) -> float:
    """The gain of least cost, by the parabola through the lowest of some and its neighbours."""
    k = int(np.clip(np.argmin(costs), 1, len(costs) - 2))
    left, here, right = costs[k - 1 : k + 2]
    bend = left - 2 * here + right
    shift = 0.5 * (left - right) / bend if bend > 0 else 0.0
    return float(np.exp(logs[k] + np.clip(shift, -1.0, 1.0) * (logs[1] - logs[0])))
