from __future__ import annotations

import numpy as np
import pytest

from cityflow.outlines.from_walls.wall_curves import fitted
from cityflow.outlines.from_walls.wall_sections import Part, Prices, parts

ORIGIN = np.array([85_000.0, 447_000.0])


def straight(rng: np.random.Generator, length: float, noise: float, count: int = 800) -> tuple[np.ndarray, np.ndarray]:
    """Points on a line in a direction of their own; and its normal."""
    angle = rng.uniform(0, 2 * np.pi)
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    s = rng.uniform(0, length, count)
    return ORIGIN + s[:, None] * along + rng.normal(0, noise, count)[:, None] * across, across


@pytest.mark.parametrize("seed", range(5))
def test_a_line_in_spite_of_windows_and_balconies(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xy, across = straight(rng, 10.0, 0.06)
    xy[:160] -= 0.15 * across
    xy[160:240] += 0.8 * across
    fit = fitted(xy, np.ones(len(xy)), across, False, 0.04)
    ends = ORIGIN + np.array([[0.0], [10.0]]) * np.array([across[1], -across[0]])
    assert np.abs(fit.distance(ends)).max() < 0.05
    assert fit.a == 0
    assert fit.radius == np.inf


@pytest.mark.parametrize(("radius", "turn_deg"), [(4.0, 110.0), (12.0, 60.0), (60.0, 20.0)])
def test_an_arc(radius: float, turn_deg: float) -> None:
    rng = np.random.default_rng(3)
    angle = np.radians(rng.uniform(-turn_deg / 2, turn_deg / 2, 1500))
    r = radius + rng.normal(0, 0.06, 1500)
    r[:100] += 0.6
    xy = ORIGIN + r[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    fit = fitted(xy, np.ones(1500), np.array([1.0, 0.0]), True, 0.04)
    true = ORIGIN + radius * np.array(
        [[np.cos(a), np.sin(a)] for a in np.radians(np.linspace(-0.45, 0.45, 9) * turn_deg)]
    )
    assert np.abs(fit.distance(true)).max() < 0.03
    assert np.abs(np.hypot(*(fit.at(fit.local(true)[0]) - ORIGIN).T) - radius).max() < 0.03
    if radius < 50:
        np.testing.assert_allclose(fit.radius, radius, rtol=0.05)


def test_sigma_tells_the_error() -> None:
    rng = np.random.default_rng(4)
    ratio = []
    for _ in range(60):
        xy, across = straight(rng, 12.0, 0.05, 600)
        # what matching does: errors that go together along metres
        s = (xy - ORIGIN) @ np.array([across[1], -across[0]])
        xy += (np.interp(s, np.arange(-1, 14), rng.normal(0, 0.06, 15)))[:, None] * across
        fit = fitted(xy, np.ones(len(xy)), across, False, 0.04)
        middle = ORIGIN + 6.0 * np.array([across[1], -across[0]])
        ratio.append(fit.distance(middle[None])[0] / fit.sigma)
    assert 0.6 < np.sqrt(np.mean(np.square(ratio))) < 1.7


def test_sections_of_two_houses_a_step_apart() -> None:
    rng = np.random.default_rng(5)
    x = np.arange(40) * 0.5
    middle = np.column_stack([x, np.where(x < 9.9, 0.0, 0.4) + rng.normal(0, 0.03, 40)])
    assert parts(middle, Prices(0.12)) == [Part(0, 19, False), Part(20, 39, False)]


def test_sections_of_one_wall_with_a_balcony() -> None:
    rng = np.random.default_rng(6)
    x = np.arange(40) * 0.5
    y = rng.normal(0, 0.05, 40)
    y[18:20] += 1.0
    assert parts(np.column_stack([x, y]), Prices(0.12)) == [Part(0, 39, False)]


def test_sections_of_a_bent_row_and_of_a_straight_wall_beside_it() -> None:
    rng = np.random.default_rng(7)
    angle = np.arange(0, np.radians(60), 0.5 / 15)
    bent = 15 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    way = np.array([np.cos(angle[-1]), np.sin(angle[-1])])
    way = np.array([-way[1], way[0]])
    middle = np.concatenate([bent, bent[-1] + np.arange(1, 20)[:, None] * 0.5 * way])
    found = parts(middle + rng.normal(0, 0.03, middle.shape), Prices(0.12))
    assert [p.curved for p in found] == [True, False]
    assert abs(found[0].last - len(bent) + 1) <= 1


def test_no_sections_no_parts() -> None:
    assert parts(np.zeros((1, 2)), Prices(0.1)) == [Part(0, 0, False)]
