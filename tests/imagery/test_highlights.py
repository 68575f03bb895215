"""A flight over a plain with a white roof: where it is exposed for the roof, the balance lifts the roof beyond white."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage, balanced
from cityflow.core.pixels import ArrayPixels
from cityflow.imagery.colour_samples import PointColours, SampleParameters, pair_samples, point_colours
from cityflow.imagery.highlights import Tone, tone
from cityflow.imagery.radiometry import Balance, block_adjustment

CAMERA = Camera(160, 120, 150.0, 150.0, 80.0, 60.0)
COLUMNS, ROWS = 6, 3
BRIGHTEST = SampleParameters().brightest_share
ROOF = (95.0, 125.0, 15.0, 45.0)
"""Its ends in x and y, metres."""


def _views() -> list[OrientedImage]:
    down = np.diag([1.0, -1.0, -1.0])
    places = [(c * 25.0, r * 25.0) for r in range(ROWS) for c in range(COLUMNS)]
    return [OrientedImage(f"{k}", CAMERA, down, np.array([x, y, 100.0])) for k, (x, y) in enumerate(places)]


def _light(xy: np.ndarray, roof: float, seed: int) -> np.ndarray:
    """(N,) of patches of some metres, 0.05 to 0.5, and of a roof with sheets of unlike whites, at most `roof`."""
    cells = np.floor(xy / 4.0).astype(int)
    random = np.random.default_rng(seed)
    ground = random.uniform(0.05, 0.5, (97, 89))[cells[:, 0] % 97, cells[:, 1] % 89]
    sheets = random.uniform(0.85, 1.0, (97, 89))[cells[:, 0] % 97, cells[:, 1] % 89]
    x, y = xy.T
    on_roof = (x > ROOF[0]) & (x < ROOF[1]) & (y > ROOF[2]) & (y < ROOF[3])
    return np.asarray(np.where(on_roof, roof * sheets, ground))


def _flight(exposures: np.ndarray, roof: float, seed: int) -> tuple[list[ArrayPixels], Balance, Tone]:
    """The pictures of 8 bits, and what is found from them alone."""
    rng = np.random.default_rng([seed, 1])
    v, u = np.mgrid[:120, :160] + 0.5
    points = np.column_stack([rng.uniform((-50, -40), (175, 90), (4000, 2)), np.zeros(4000)])
    pictures, seen = [], []
    for view, exposure in zip(_views(), exposures, strict=True):
        rays = view.rays(np.column_stack([u.ravel(), v.ravel()]))
        light = _light((view.centre + rays * 100.0)[:, :2], roof, seed)
        values = 255 * exposure * light + rng.normal(0, 1.0, light.shape)
        grey = np.clip(np.rint(values), 0, 255).astype(np.uint8).reshape(120, 160)
        pictures.append(ArrayPixels(np.repeat(grey[..., None], 3, axis=2)))
        seen.append(point_colours(view, pictures[-1], points, SampleParameters(level=0)))
    balance = block_adjustment(pair_samples(seen), len(seen))
    return pictures, balance, tone(seen, balance, BRIGHTEST)


def _shown(pictures: list[ArrayPixels], balance: Balance, last: Tone) -> np.ndarray:
    """(images, pixels) greens as an ortho takes them."""
    v, u = (a.ravel() + 0.5 for a in np.mgrid[:120, :160])
    return np.array([
        balanced(p.array.reshape(-1, 3).astype(np.float32), ColourImage(
            view, p, tuple(balance.gain[k] * last.gain), tuple(balance.gamma[k]), balance.falloff, last.shoulder), u, v)[:, 1]
        for k, (view, p) in enumerate(zip(_views(), pictures, strict=True))
    ])  # fmt: skip


def _exposed_for_the_roof(seed: int) -> np.ndarray:
    """30 % less in the images that show the roof, up to 30 % more in the others."""
    column = np.arange(COLUMNS * ROWS) % COLUMNS
    return np.where(column >= 2, 0.7, np.random.default_rng(seed).uniform(1.1, 1.3, column.shape))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_photographs_show_below_white_stays_below_it(seed: int) -> None:
    pictures, balance, found = _flight(_exposed_for_the_roof(seed), 1.3, seed)
    raw = np.array([p.array[..., 1].ravel() for p in pictures])
    well = raw <= BRIGHTEST * 255
    assert well.mean() > 0.999, "the photographs are well exposed"
    assert (_shown(pictures, balance, Tone(1.0, 0.0))[well] >= 250).mean() > 0.02, "the balance alone cuts the roof off"
    shown = _shown(pictures, balance, found)
    assert (shown[well] >= 250).mean() < 0.002
    # a roof that keeps its sheets, and ground that is hardly darker
    roof, ground = (raw > 0.75 * 255) & well, raw < 0.3 * 255
    assert np.ptp(np.quantile(shown[roof], [0.05, 0.95])) > 15
    assert (shown[ground] / _shown(pictures, balance, Tone(1.0, 0.0))[ground]).min() > 0.9


def test_values_keep_their_order_and_images_still_agree() -> None:
    pictures, balance, found = _flight(_exposed_for_the_roof(4), 1.3, 4)
    before, after = (_shown(pictures, balance, t).ravel() for t in (Tone(1.0, 0.0), found))
    order = np.argsort(before, kind="stable")
    assert np.diff(after[order]).min() >= -1e-3
    assert found.gain == 1.0
    assert found.shoulder > 0


def test_photographs_exposed_alike_stay_as_they_are() -> None:
    assert _flight(np.full(COLUMNS * ROWS, 0.75), 1.25, 5)[2] == (1.0, 0.0)


def test_what_most_photographs_show_cut_off_may_be_white() -> None:
    """One image of a quarter of the exposure shows the roof below white: the survey is not made darker for it."""
    exposures = np.ones(COLUMNS * ROWS)
    exposures[COLUMNS + 4] = 0.25
    assert _flight(exposures, 3.0, 6)[2] == (1.0, 0.0)


def test_highlights_far_beyond_white_make_all_darker_first() -> None:
    """The parabola's top is where highlights end, and nothing falls behind it."""
    nowhere = np.empty(0, np.int64)
    seen = PointColours(np.arange(2000), np.log(np.linspace(0.1, 0.95, 2000))[:, None], np.zeros(2000), nowhere)
    found = tone([seen], Balance(np.full((1, 1), 4.0), np.ones((1, 1)), 0.0, 0.0, 0.0), BRIGHTEST)
    assert found.gain == pytest.approx(2 * BRIGHTEST / 3.8, rel=1e-3)
    assert 1 / (4 * found.shoulder) == pytest.approx(BRIGHTEST)


def test_nothing_seen_is_left_as_it_is() -> None:
    nothing = Balance(np.ones((0, 3)), np.ones((0, 3)), 0.0, 0.0, 0.0)
    assert tone([], nothing, BRIGHTEST) == (1.0, 0.0)
