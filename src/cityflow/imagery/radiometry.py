"""Radiometric block adjustment: exposure corrections that make all images agree.

In logarithms an image's exposure is a summand, the curve of its camera a factor (a gamma) and the lens's fall-off towards the corners a multiple of the
squared radius; all pairs of overlapping images together give sparse linear equations, which are solved robustly, with a gentle pull towards
leaving images as they are. Gammas and the fall-off are common to a group of images, since one image alone cannot tell them from its contents.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.imagery.colour_samples import PairSamples

MID_GREY = 0.4
"""A usual value, share of the greatest: set by hand, a little darker than a grey of 18 % in sRGB (0.46). Gains of unlike gammas are compared there."""


class RadiometryParameters(Parameters):
    """How images are balanced."""

    gain_sigma: float = Field(1.0, gt=0, description="how far exposures are expected to differ, natural logarithm")
    gamma_sigma: float = Field(
        0.3, ge=0, description="how far gammas of groups are expected to differ from 1; 0 fixes them at 1"
    )
    falloff_sigma: float = Field(
        0.3, ge=0, description="expected fall-off from middle to corner, natural logarithm; 0 fixes it at none"
    )
    sample_sigma: float = Field(0.05, gt=0, description="how well two images' medians agree at best, natural logarithm")
    huber: float = Field(1.5, gt=0, description="residuals beyond so many standard deviations lose weight")
    rounds: int = Field(12, ge=1, le=100, description="of re-weighting")
    group_gap: float = Field(
        0.2, gt=0, description="exposures of two groups are at least so far apart, natural logarithm"
    )


@dataclass(frozen=True, slots=True)
class Balance:
    """How to make images alike: v becomes ``gain · exp(falloff · r²) · top · (v / top) ** gamma``, r from the middle over half the diagonal.

    Attributes
    ----------
    gain, gamma : (images, bands)
    falloff : 0 or more: what the corners lack, natural logarithm
    before, after : standard deviations (1.4826 · MAD) of the pairs' residuals, natural logarithm, bands together
    """

    gain: FloatArray
    gamma: FloatArray
    falloff: float
    before: float
    after: float


def block_adjustment(
    pairs: PairSamples, images: int, groups: IntArray | None = None, parameters: RadiometryParameters | None = None
) -> Balance:
    """Gains of all images, gammas of all groups, and the fall-off, from what pairs of images show.

    Parameters
    ----------
    images : their number; those without a pair keep gain 1
    groups : (images,) int64, which group of exposure an image belongs to, from 0 on; one group where not given. The largest keeps gamma 1
    """
    asked = parameters or RadiometryParameters()
    of = np.zeros(images, np.int64) if groups is None else groups
    system = _System(pairs, images, of, asked)
    weight = system.certainty
    solution = np.zeros(system.size)
    for _ in range(asked.rounds):
        solution = system.solve(weight)
        off = np.abs(system.residuals(solution)) * np.sqrt(system.certainty)
        weight = system.certainty * np.minimum(1.0, asked.huber / np.maximum(off, 1e-12))
    return system.balance(solution)


def exposure_groups(gain: FloatArray, parameters: RadiometryParameters | None = None) -> IntArray:
    """Group of each image, 0 for the brightest images, from (images, bands) gains: groups are parted by gaps among the sorted exposures."""
    gap = (parameters or RadiometryParameters()).group_gap
    exposure = np.log(gain).mean(axis=1)
    order = np.argsort(exposure, kind="stable")
    group = np.empty(len(gain), np.int64)
    group[order] = np.concatenate([[0], np.cumsum(np.diff(exposure[order]) > gap)]) if len(gain) else 0
    return group


class _System:
    """The linear equations: a gain per image and band, then gammas per group and band (less 1), then the fall-off."""

    def __init__(self, pairs: PairSamples, images: int, groups: IntArray, asked: RadiometryParameters) -> None:
        self.bands = pairs.log_first.shape[1]
        self.images, self.groups, self.asked = images, groups, asked
        self.gains = images * self.bands
        self.curves = (int(groups.max(initial=0)) + 1) * self.bands
        self.size = self.gains + self.curves + 1
        self.matrix = self._matrix(pairs)
        self.target = -(pairs.log_first - pairs.log_second).ravel()
        sigma2 = asked.sample_sigma**2 + pairs.spread**2 / np.maximum(pairs.count, 1)[:, None]
        self.certainty = (1.0 / sigma2).ravel()
        self.prior = self._prior()

    def _matrix(self, pairs: PairSamples) -> csc_array:
        m, bands = len(pairs), self.bands
        row = np.arange(m * bands).reshape(m, bands)
        band = np.arange(bands)[None, :]
        columns, values, rows = [], [], []
        for sign, image, logs, radius2 in (
            (1.0, pairs.first, pairs.log_first, pairs.radius2_first),
            (-1.0, pairs.second, pairs.log_second, pairs.radius2_second),
        ):
            columns += [image[:, None] * bands + band, self.gains + self.groups[image][:, None] * bands + band,
                        np.full((m, bands), self.size - 1)]  # fmt: skip
            values += [np.full((m, bands), sign), sign * logs, np.broadcast_to(sign * radius2[:, None], (m, bands))]
            rows += [row] * 3
        flat = (np.concatenate([a.ravel() for a in part]) for part in (values, rows, columns))
        value, at_row, at_column = flat
        return csc_array(coo_array((value, (at_row, at_column)), shape=(m * bands, self.size)))

    def _prior(self) -> FloatArray:
        """(size,) weights that pull every unknown towards 0; a great one fixes it."""
        fixed = 1e12
        weight = np.full(self.size, 1.0 / self.asked.gain_sigma**2)
        gamma = fixed if self.asked.gamma_sigma == 0 else 1.0 / self.asked.gamma_sigma**2
        weight[self.gains : -1] = gamma
        largest = int(np.argmax(np.bincount(self.groups, minlength=1))) if self.images else 0
        weight[self.gains + largest * self.bands : self.gains + (largest + 1) * self.bands] = fixed
        weight[-1] = fixed if self.asked.falloff_sigma == 0 else 1.0 / self.asked.falloff_sigma**2
        return weight

    def solve(self, weight: FloatArray) -> FloatArray:
        """Weighted least squares; the few unknowns common to all images are eliminated last, as they would fill the factors."""
        weighted = diags_array(weight) @ self.matrix
        normal = csc_array(self.matrix.T @ weighted + diags_array(self.prior))
        right = weighted.T @ self.target
        g = self.gains
        factor = splu(csc_array(normal[:g, :g]), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        border = normal[:g, g:].toarray()
        inner = factor.solve(np.column_stack([right[:g], border]))
        common = np.linalg.solve(normal[g:, g:].toarray() - border.T @ inner[:, 1:], right[g:] - border.T @ inner[:, 0])
        return np.concatenate([inner[:, 0] - inner[:, 1:] @ common, common])

    def residuals(self, solution: FloatArray) -> FloatArray:
        return np.asarray(self.matrix @ solution - self.target)

    def balance(self, solution: FloatArray) -> Balance:
        # the fall-off brightens every picture, by a third of it on average over the image, where it could saturate: the gains take that back
        gain = np.exp(solution[: self.gains].reshape(self.images, self.bands) - solution[-1] / 3.0)
        curves = 1.0 + solution[self.gains : -1].reshape(-1, self.bands)
        after = _spread(self.residuals(solution))
        return Balance(gain, curves[self.groups], float(solution[-1]), _spread(self.target), after)


def _spread(residuals: FloatArray) -> float:
    return float(1.4826 * np.median(np.abs(residuals))) if len(residuals) else 0.0


def gain_of_mid_grey(gain: FloatArray, gamma: FloatArray) -> FloatArray:
    """(images, bands) what a value of `MID_GREY` is multiplied by, so that exposures of unlike gammas can be compared."""
    return np.asarray(gain * MID_GREY ** (gamma - 1.0))
