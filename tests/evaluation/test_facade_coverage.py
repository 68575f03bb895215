"""A wall of 10 m x 6 m, partly covered with points."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.evaluation.facade_coverage import facade_figures, wall_samples

WALL = np.array([[0.0, 0.0, 0.0], [8.0, 6.0, 0.0], [8.0, 6.0, 6.0], [0.0, 0.0, 6.0]])
ACROSS = np.array([0.6, -0.8])


def points_on(s_end: float, noise: float, seed: int = 0) -> np.ndarray:
    """Points on the first `s_end` metres of the wall."""
    rng = np.random.default_rng(seed)
    s, z = np.meshgrid(np.arange(0.05, s_end, 0.1), np.arange(0.05, 6, 0.1))
    s, z = s.ravel(), z.ravel()
    xy = s[:, None] * np.array([0.8, 0.6]) + rng.normal(0, noise, len(s))[:, None] * ACROSS
    return np.column_stack([xy, z])


def test_samples_fill_the_wall() -> None:
    samples = wall_samples([WALL])
    assert len(samples.xyz) == 20 * 12
    assert np.allclose(samples.xyz[:, :2] @ ACROSS, 0)
    assert np.allclose(np.abs(samples.normal[:, :2] @ ACROSS), 1)


def test_gable_wall_has_no_samples_beside_the_gable() -> None:
    gable = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 0, 4], [5.0, 0, 8.7], [0.0, 0, 4]])
    assert len(wall_samples([gable]).xyz) * 0.25 == pytest.approx(10 * 4 + 10 * 4.7 / 2, abs=1.5)


def test_half_covered_wall() -> None:
    samples = wall_samples([WALL])
    found = facade_figures(points_on(4.9, 0.03), [WALL], samples, np.full(len(samples.xyz), 2))
    assert found.covered == pytest.approx(0.5, abs=0.01), "centres at 4.75 m are covered, at 5.25 m not"
    assert found.nmad == pytest.approx(0.03, rel=0.1)
    assert found.area_m2 == 60


def test_only_what_two_views_see_counts() -> None:
    samples = wall_samples([WALL])
    along = samples.xyz[:, :2] @ [0.8, 0.6]
    found = facade_figures(points_on(5.0, 0.0), [WALL], samples, np.where(along < 5, 3, 1))
    assert found.covered == 1
    assert found.covered_all == pytest.approx(0.55, abs=0.01), "the column behind the edge is within 0.3 m"
    assert found.area_m2 == 30


def test_points_far_off_cover_nothing() -> None:
    samples = wall_samples([WALL])
    away = points_on(10.0, 0.0) + np.array([*(0.35 * ACROSS), 0.0])
    assert facade_figures(away, [WALL], samples, np.full(len(samples.xyz), 2)).covered == 0
    assert np.isnan(facade_figures(np.empty((0, 3)), [WALL], samples, np.full(len(samples.xyz), 2)).nmad)
