"""A robust line between the values of two images."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray

ROUNDS = 20
"""Of re-weighting, at most."""
SETTLED = 1e-4
"""Share by which a gain changes no more when weights have settled."""
GAINS = 201
"""Gains that are tried, at equal ratios; the best lies between two of them."""
TUKEY = 4.685
"""Residuals beyond so many standard deviations have no weight: Tukey's biweight, 95 % as efficient as least squares on normal errors."""

LEAST_CELLS = 12
"""Cells that two images see in common, from which they are compared; set by hand on textures of synthetic towns, as are the next six."""
OFFSET_SIGMA = 8.0
"""Offsets expected between images, values of 0 to 255; where there is little contrast they decide."""
GAIN_SIGMA = 1.0
"""How far gains are expected to differ from 1, natural logarithm."""
NOISE = 3.0
"""How well cells of two images agree at best, values of 0 to 255."""
MOST_WEIGHT = 60.0
"""Cells that a comparison counts as at most, since neighbours err alike."""
MOST_GAIN = 8.0
"""Gains stay between 1 / this and this."""
MOST_OFFSET = 60.0
"""Greatest offset, values of 0 to 255."""


def fitted(x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Gain, offset and spread of y = gain · x + offset, of one band, robustly and the same in both directions.

    Starts from the median ratio, a gain alone, and weighs by Tukey's function of what remains, which is measured between the two images' values, divided
    by the root of the gain. An offset needs contrast to show; without it its expectation, none, keeps it small and the gain near that ratio. What the values
    do not clearly speak for is taken back (`_as_far_as_shown`): images that were exposed alike stay as they are.

    Returns
    -------
    gain ; offset ; standard deviation of what remains (1.4826 · MAD)
    """
    start = float(np.median(np.log(np.maximum(y, 1.0) / np.maximum(x, 1.0))))
    most = np.log(MOST_GAIN)
    gain, offset, spread = float(np.exp(np.clip(start, -most, most))), 0.0, NOISE
    for _ in range(ROUNDS):
        rest = np.abs(y - gain * x - offset) / np.sqrt(gain)
        spread = max(1.4826 * float(np.median(rest)), NOISE)
        weight = np.clip(1.0 - (rest / (TUKEY * spread)) ** 2, 0.0, None) ** 2
        before, (gain, offset) = gain, _line(x, y, weight, spread)
        if abs(gain - before) < SETTLED * gain:
            break
    return *_as_far_as_shown((x, y, weight), (gain, offset), spread), spread


def _as_far_as_shown(
    cells: tuple[FloatArray, FloatArray, FloatArray], line: tuple[float, float], spread: float
) -> tuple[float, float]:
    """Gain and offset, drawn towards a gain alone, and that towards none, by what each step explains beyond chance.

    A step of one unknown takes 1 off the sum of squares, in standard deviations, where there is nothing to find; where it takes off D, the share of it that
    is true is expected to be 1 - 1 / D (an empirical Bayes estimate, as by James and Stein 1961).

    Parameters
    ----------
    cells : x, y and weights, cells beside each other one after the other
    """
    x, y, weight = cells
    trust = _independent(weight, y - line[0] * x - line[1]) / spread**2

    def misfit(gain: float, offset: float) -> float:
        return trust * float(weight @ (y - gain * x - offset) ** 2) / gain

    most = np.log(MOST_GAIN)
    squares = [max(float(weight @ v**2), 1e-9) for v in (x, y)]
    alone = float(np.clip(0.5 * np.log(squares[1] / squares[0]), -most, most))
    none, one, both = misfit(1.0, 0.0), misfit(float(np.exp(alone)), 0.0), misfit(*line)
    of_gain, of_offset = _true_share(none - one), _true_share(one - both)
    log_gain = of_offset * np.log(line[0]) + (1.0 - of_offset) * of_gain * alone
    return float(np.exp(log_gain)), of_offset * line[1]


def _independent(weight: FloatArray, rest: FloatArray) -> float:
    """Share of the cells that tell something of their own, 0 to 1: what remains is alike in cells that stand beside each other, along rows and across."""
    rest = weight * rest
    alike = float(rest[1:] @ rest[:-1]) / max(float(rest @ rest), 1e-9)
    alike = float(np.clip(alike, 0.0, 1.0))
    return ((1.0 - alike) / (1.0 + alike)) ** 2


def _true_share(explained: float) -> float:
    return max(1.0 - 1.0 / max(explained, 1.0), 0.0)


def _line(x: FloatArray, y: FloatArray, weight: FloatArray, spread: float) -> tuple[float, float]:
    """Gain and offset with the least sum of squares (y - gain · x - offset)² / gain, expectations included; offsets follow from gains."""
    total = max(float(weight.sum()), 1e-9)
    x_0, y_0 = float(weight @ x) / total, float(weight @ y) / total
    dx, dy = x - x_0, y - y_0
    xx, xy, yy = (float(weight @ v) / total for v in (dx * dx, dx * dy, dy * dy))
    trust = min(total, MOST_WEIGHT) / spread**2
    sigma2 = OFFSET_SIGMA**2
    logs = np.linspace(-1.0, 1.0, GAINS) * np.log(MOST_GAIN)
    gain = np.exp(logs)
    contrast = trust * (yy / gain - 2 * xy + gain * xx)
    middle = (y_0 - gain * x_0) ** 2 / gain / (sigma2 + 1.0 / trust)
    best = _lowest(logs, contrast + middle + (logs / GAIN_SIGMA) ** 2)
    offset = (y_0 - best * x_0) * sigma2 / (sigma2 + 1.0 / trust)
    return best, float(np.clip(offset, -MOST_OFFSET, MOST_OFFSET))


def _lowest(logs: FloatArray, costs: FloatArray) -> float:
    """The gain of least cost, by the parabola through the lowest of some and its neighbours."""
    k = int(np.clip(np.argmin(costs), 1, len(costs) - 2))
    left, here, right = costs[k - 1 : k + 2]
    bend = left - 2 * here + right
    shift = 0.5 * (left - right) / bend if bend > 0 else 0.0
    return float(np.exp(logs[k] + np.clip(shift, -1.0, 1.0) * (logs[1] - logs[0])))
