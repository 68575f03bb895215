"""Images of one painted plain, exposed in different ways: their balance is found again from what they share."""

from __future__ import annotations

import time

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import ArrayPixels
from cityflow.imagery.colour_samples import PairSamples, PointColours, SampleParameters, pair_samples, point_colours
from cityflow.imagery.radiometry import RadiometryParameters, block_adjustment, exposure_groups

CAMERA = Camera(320, 240, 300.0, 300.0, 160.0, 120.0)
LEVEL_2 = SampleParameters(level=2)


def _views(columns: int, rows: int) -> list[OrientedImage]:
    down = np.diag([1.0, -1.0, -1.0])
    return [
        OrientedImage(f"{r}_{c}", CAMERA, down, np.array([c * 25.0, r * 25.0, 100.0]))
        for r in range(rows)
        for c in range(columns)
    ]


def _reflectance(xyz: np.ndarray) -> np.ndarray:
    """(N, 3) shares of light, from shadow to bright roofs, in patches of some metres."""
    cells = np.floor(xyz[:, :2] / 6.0).astype(int)
    random = np.random.default_rng(5).uniform(0.06, 0.5, (97, 89, 3))
    return np.asarray(random[cells[:, 0] % 97, cells[:, 1] % 89])


def _picture(
    view: OrientedImage, gain: np.ndarray, gamma: np.ndarray, falloff: float, rng: np.random.Generator
) -> ArrayPixels:
    """What a camera shows whose balance would be (gain, gamma, falloff): the balance's formula the other way round."""
    v, u = np.mgrid[:240, :320] + 0.5
    uv = np.column_stack([u.ravel(), v.ravel()])
    rays = view.rays(uv)
    light = _reflectance(view.centre + rays * view.centre[2])
    r2 = np.sum((uv - (160, 120)) ** 2, axis=1) / (160**2 + 120**2)
    shown = (light * np.exp(-falloff * r2)[:, None] / gain) ** (1 / gamma)
    moved = rng.random(len(shown)) < 0.02  # cars, people
    shown[moved] = rng.uniform(0, 1, (moved.sum(), 1))
    values = 65535 * shown + rng.normal(0, 300, shown.shape)
    return ArrayPixels(np.clip(np.rint(values), 0, 65535).astype(np.uint16).reshape(240, 320, 3))


def _block(seed: int, gammas: tuple[float, float], falloff: float) -> tuple[np.ndarray, np.ndarray, list[PointColours]]:
    """True gains, true groups, and what 20 images show; the second half is exposed twice as long."""
    rng = np.random.default_rng(seed)
    views = _views(5, 4)
    group = (np.arange(20) >= 10).astype(int)
    gain = np.exp(rng.normal(0, 0.04, (20, 3)) + np.where(group, -0.35, 0.35)[:, None])
    gamma = np.array(gammas)[group]
    points = np.column_stack([rng.uniform(-50, 150, (6000, 2)), np.zeros(6000)])
    seen = [
        point_colours(v, _picture(v, gain[i], gamma[i], falloff, rng), points, LEVEL_2) for i, v in enumerate(views)
    ]
    return gain, group, seen


@pytest.mark.parametrize("seed", [0, 1])
def test_gains_come_back(seed: int) -> None:
    gain, group, seen = _block(seed, (1.0, 1.0), 0.0)
    made = block_adjustment(pair_samples(seen), 20)
    error = np.log(made.gain / gain)
    error -= np.median(error, axis=0)
    assert np.abs(error).max() < 0.04
    assert made.after < 0.02 < made.before
    found = exposure_groups(made.gain)
    assert np.array_equal(found, 1 - group)


@pytest.mark.parametrize("seed", [2, 3])
def test_curves_and_falloff_come_back(seed: int) -> None:
    """One group's camera brightens shadows, and the lens darkens corners: with both in the model, residuals are those of noise."""
    _, _, seen = _block(seed, (1.0, 1.5), 0.4)
    pairs = pair_samples(seen)
    plain = block_adjustment(pairs, 20, parameters=RadiometryParameters(gamma_sigma=0, falloff_sigma=0))
    groups = exposure_groups(plain.gain)
    full = block_adjustment(pairs, 20, groups)
    assert len(np.unique(groups)) == 2
    assert full.after < 0.6 * plain.after
    ratio = full.gamma[groups == groups[-1]][0] / full.gamma[groups == groups[0]][0]
    np.testing.assert_allclose(ratio, 1.5, atol=0.12)
    # where the fixed curve is that of the second camera, all numbers are smaller by its gamma
    assert full.falloff == pytest.approx(
        0.4 / (1.5 if np.allclose(full.gamma[groups == groups[-1]], 1.0) else 1.0), abs=0.08
    )


def test_gains_make_pictures_alike() -> None:
    _, _, seen = _block(4, (1.0, 1.4), 0.3)
    pairs = pair_samples(seen)
    groups = exposure_groups(block_adjustment(pairs, 20).gain)
    made = block_adjustment(pairs, 20, groups)
    raw = _disagreement(seen, np.ones((20, 3)), np.ones((20, 3)), 0.0)
    assert _disagreement(seen, made.gain, made.gamma, made.falloff) < 0.2 * raw


def _disagreement(seen: list[PointColours], gain: np.ndarray, gamma: np.ndarray, falloff: float) -> float:
    """Median, over points that five images see, of the range of the middle six tenths of their greens over the median green."""
    greens: list[list[float]] = [[] for _ in range(6000)]
    for i, s in enumerate(seen):
        even = np.exp(s.log_colour * gamma[i] + np.log(gain[i]) + falloff * s.radius2[:, None])
        for p, v in zip(s.point, even[:, 1], strict=True):
            greens[p].append(float(v))
    return float(np.median([np.ptp(np.quantile(v, [0.2, 0.8])) / np.median(v) for v in greens if len(v) >= 5]))


def test_hidden_and_overexposed_points_say_nothing() -> None:
    view = _views(1, 1)[0]
    array = np.full((240, 320, 3), 30000, np.uint16)
    array[:, 160:] = 65535
    points = np.array([[-20.0, 0, 0], [20.0, 0, 0], [500.0, 0, 0], [0.0, 0, 200.0]])
    seen = point_colours(view, ArrayPixels(array), points, LEVEL_2)
    assert seen.point.tolist() == [0]
    assert np.allclose(np.exp(seen.log_colour), 30000 / 65535)


def test_a_sensor_of_12_bits_is_dark_and_saturated_at_its_own_values() -> None:
    """In the upper fifteen sixteenths of 16 bits nothing can be; 800 of 4095 are no darkness."""
    view = _views(1, 1)[0]
    array = np.full((240, 320, 3), 800, np.uint16)
    array[:, 160:] = 4095
    points = np.array([[-20.0, 0, 0], [20.0, 0, 0]])
    seen = point_colours(view, ArrayPixels(array), points, LEVEL_2, white=4095.0)
    assert (seen.point.tolist(), seen.burnt.tolist()) == ([0], [1])
    assert np.allclose(np.exp(seen.log_colour), 800 / 65535)


def test_an_image_alone_is_left_as_it_is() -> None:
    nothing = PointColours(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0), np.empty(0, np.int64))
    pairs = pair_samples([nothing, nothing])
    assert len(pairs) == 0
    made = block_adjustment(pairs, 2)
    assert np.allclose(made.gain, 1.0)
    assert np.allclose(made.gamma, 1.0)


def test_a_large_block_is_solved_in_seconds() -> None:
    """100 by 100 images, each with four neighbours on either side."""
    n = 100
    rng = np.random.default_rng(0)
    truth = rng.normal(0, 0.3, (n * n, 3))
    at = np.arange(n * n).reshape(n, n)
    steps = [(0, 1), (1, 0), (1, 1), (0, 2)]
    first = np.concatenate([at[: n - r, : n - c].ravel() for r, c in steps])
    second = np.concatenate([at[r:, c:].ravel() for r, c in steps])
    light = np.log(rng.uniform(0.1, 0.5, (len(first), 3)))
    pairs = PairSamples(
        first, second, light - truth[first] + rng.normal(0, 0.02, light.shape), light - truth[second],
        np.full(len(first), 0.3), np.full(len(first), 0.3), np.full(len(first), 50), np.full(light.shape, 0.1),
    )  # fmt: skip
    start = time.process_time()
    made = block_adjustment(pairs, n * n, parameters=RadiometryParameters(rounds=2, gamma_sigma=0))
    assert time.process_time() - start < 20
    error = np.log(made.gain) - truth
    assert np.std(error - error.mean(axis=0)) < 0.03
