"""Variance components: what residuals tell of groups of observations, and what they do not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

from adjustment.scenes import scene
from cityflow.adjustment.block import Block, residuals
from cityflow.adjustment.normal_equations import Normal, Prior
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import triangulated
from cityflow.adjustment.variance_components import (
    Redundancy,
    balance,
    pixel_sigma,
    redundancy_of,
    variance_factors,
)


def _found(redundant: float, trace: float) -> Redundancy:
    """Of 20 images whose positions and rotations tell alike much."""
    return Redundancy(np.zeros((20, 6, 6)), np.full(2, 60.0), np.full(2, redundant), np.diag(np.full(2, trace)))


def _away(squares: float) -> np.ndarray:
    """(20, 6) residuals whose squares, in standard deviations, are so large in each group."""
    return np.full((20, 6), np.sqrt(squares / 60.0))


BOTH = np.ones(2, bool)


def test_residuals_as_large_as_expected_change_nothing() -> None:
    assert np.allclose(variance_factors(_away(40.0), np.ones((20, 6)), _found(40.0, 30.0), BOTH), 1.0)


def test_an_estimate_goes_where_many_plain_steps_would_end() -> None:
    """Of 60 positions 40 are redundant, in the squares 25: residuals a tenth too small mean a variance that is too large by 16 %, not by 10 %."""
    factor = variance_factors(_away(36.0), np.ones((20, 6)), _found(40.0, 25.0), BOTH)
    assert np.allclose(factor, 1.0 - 4.0 / 25.0)


def test_what_is_known_stays_and_one_step_is_no_leap() -> None:
    factor = variance_factors(_away(24.0), np.ones((20, 6)), _found(40.0, 12.0), np.array([True, False]))
    assert factor.tolist() == [0.5, 1.0], "the equations alone would have a negative variance"


def test_what_residuals_do_not_tell_makes_no_variance_smaller() -> None:
    factor = variance_factors(_away(6.0), np.ones((20, 6)), _found(8.0, 2.0), BOTH)
    assert factor.tolist() == [1.0, 1.0]
    assert np.all(variance_factors(_away(12.0), np.ones((20, 6)), _found(8.0, 2.0), BOTH) > 1.4)
    assert np.all(variance_factors(_away(12.0), np.ones((20, 6)), _found(2.0, 0.5), BOTH) == 1.0)


def test_redundancy_is_the_trace_of_the_projection() -> None:
    truth = scene(4)
    block = triangulated(Block.of(truth.images, np.zeros(3)), truth.ties)
    left, size = residuals(block, truth.ties)[0], 6 * len(truth.images)
    weights = np.tile(np.repeat([1.0e6, 400.0], 3), len(truth.images))
    zeros = np.zeros_like(block.xyz)
    prior = Prior(csr_array(eye_array(size)), weights, np.zeros(size), zeros, zeros)
    normal = Normal(block, truth.ties, left, np.full(len(left), 4.0), prior, calibrated=False)
    found = redundancy_of(normal, weights.reshape(-1, 6), 0.0)
    inverse = np.concatenate([columns for _, columns in normal.pose_columns()], axis=1)
    project = np.eye(size) - np.sqrt(weights)[:, None] * inverse * np.sqrt(weights)
    position = np.tile(np.arange(6) >= 3, len(truth.images))
    for k, mine in enumerate((position, ~position)):
        assert found.shares[k] == pytest.approx(np.trace(project[np.ix_(mine, mine)]), rel=1e-9)
        for h, others in enumerate((position, ~position)):
            assert found.traces[k, h] == pytest.approx(np.sum(project[np.ix_(mine, others)] ** 2), rel=1e-9)
    assert np.allclose(found.covariances, normal.covariances())


def _ties(lengths: np.ndarray) -> Ties:
    point = np.repeat(np.arange(len(lengths)), lengths)
    image = np.concatenate([np.arange(n) for n in lengths])
    return Ties(point, image, image, np.zeros((len(point), 2)), np.ones(len(point)))


def test_good_observations_under_a_robust_loss_weigh_what_they_are_worth() -> None:
    """Of normal errors in two coordinates, Cauchy's loss keeps 96 % of the information, by weights of 0.825 in the mean and a slope of 0.698."""
    ties = _ties(np.full(400, 200))
    left = np.random.default_rng(3).normal(0, 0.7, (len(ties.point), 2))
    found = balance(left, ties, 0.7, 0.0)
    assert found.weights == pytest.approx(0.961 / 0.825, rel=0.02)
    assert found.residuals == pytest.approx(0.825 / 0.698, rel=0.02)


def test_residuals_of_short_and_long_tracks_tell_one_standard_deviation() -> None:
    rng = np.random.default_rng(5)
    ties = _ties(rng.integers(2, 9, 4000))
    left = (
        rng.normal(0, 0.5, (len(ties.point), 2))
        * np.sqrt((2 * ties.lengths - 3) / (2 * ties.lengths))[ties.point, None]
    )
    assert pixel_sigma(left, ties, 0.0) == pytest.approx(0.5, rel=0.02)
