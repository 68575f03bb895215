from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import ORTHO, Segments, joined_segments
from cityflow.splitting.directions.principal import (
    filtered,
    follows_principal,
    orientation_at,
    principal_directions,
)
from cityflow.splitting.directions.principal_histogram import Sample, apart, density, deviation_deg, mixture, peaks_of

METRE_SIGMA_DEG = 4.0


def lines(
    rng: np.random.Generator, aspect: float | FloatArray, slope: float, count: int, middle: tuple[float, float] = (0.0, 0.0),
    spread: float = 10.0,
) -> Segments:  # fmt: skip
    """Segments of a direction, each off by what its length allows."""
    length = rng.uniform(0.6, 8.0, count)
    sigma = np.radians(np.minimum(METRE_SIGMA_DEG / length**1.5, 6.0))
    a, s = np.radians(aspect) + rng.normal(0, 1, count) * sigma, np.radians(slope) + rng.normal(0, 1, count) * sigma
    d = np.column_stack([np.cos(s) * np.cos(a), np.cos(s) * np.sin(a), np.sin(s)]) * length[:, None]
    d *= rng.choice([-1, 1], count)[:, None]
    at = np.column_stack([rng.uniform(-spread, spread, (count, 2)) + middle, rng.uniform(0, 8, count)])
    kind = np.zeros(count, np.int64)
    return Segments(at - d / 2, at + d / 2, kind, kind.astype(np.uint8) + ORTHO, ("nadir",))


def anywhere(rng: np.random.Generator, count: int, middle: tuple[float, float] = (0.0, 0.0)) -> Segments:
    parts = [
        lines(rng, float(a), float(s), 1, middle)
        for a, s in zip(rng.uniform(0, 180, count), rng.uniform(0, 90, count), strict=True)
    ]
    return joined_segments(parts, ("nadir",))


def off(degrees: float, truth: float, period: float = 180.0) -> float:
    return abs(float(deviation_deg(np.array(degrees), truth, period)))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("aspect", [0.1, 44.0, 89.95, 133.0])
def test_aspects_are_right_to_a_fraction_of_a_degree_in_clutter(seed: int, aspect: float) -> None:
    rng = np.random.default_rng(seed)
    s = joined_segments(
        [
            lines(rng, aspect, 0, 80),
            lines(rng, aspect + 90, 0, 50),
            lines(rng, aspect + 90, 38, 40),
            anywhere(rng, 170),
        ],
        ("nadir",),
    )
    p = principal_directions(s)
    first, second = p.aspects_of(0)
    assert min(off(first.degrees, aspect), off(first.degrees, aspect + 90)) < 0.2
    assert off(second.degrees, first.degrees + 90) < 0.3
    assert first.sigma < 0.2
    assert any(off(q.degrees, 38, 1e9) < 1.5 for q in p.slopes[:2])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("turn", [2.0, 3.0])
def test_two_orientations_close_to_each_other_are_told_apart_and_placed(seed: int, turn: float) -> None:
    rng = np.random.default_rng(seed)
    west, east = (-25.0, 0.0), (25.0, 0.0)
    s = joined_segments(
        [lines(rng, 20, 0, 110, west), lines(rng, 110, 0, 80, west), lines(rng, 20 + turn, 0, 70, east),
         lines(rng, 110 + turn, 0, 60, east), anywhere(rng, 120)], ("nadir",),
    )  # fmt: skip
    p = principal_directions(s)
    here, there = orientation_at(s, p, np.array(west), 10.0), orientation_at(s, p, np.array(east), 10.0)
    assert here != there
    for orientation, truth in ((here, 20.0), (there, 20.0 + turn)):
        both = p.aspects_of(orientation)
        assert len(both) == 2
        assert all(min(off(a.degrees, truth), off(a.degrees, truth + 90)) < 0.35 for a in both)


@pytest.mark.parametrize("seed", range(6))
def test_one_orientation_is_not_taken_for_two(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    s = joined_segments([lines(rng, 20, 0, 150), lines(rng, 110, 0, 100), anywhere(rng, 80)], ("nadir",))
    p = principal_directions(s)
    near = [
        k for a, k in zip(p.aspects, p.orientation, strict=True) if min(off(a.degrees, 20), off(a.degrees, 110)) < 6
    ]
    assert set(near) == {0}


@pytest.mark.parametrize("count", [0, 1, 5])
def test_few_segments_tell_nothing(count: int) -> None:
    s = lines(np.random.default_rng(0), 20, 0, 6).take(np.arange(count))
    p = principal_directions(s)
    assert p.aspects == ()
    assert len(filtered(s, p)) == 0


def test_only_upright_segments_tell_no_aspect() -> None:
    s = lines(np.random.default_rng(0), 20, 89, 50)
    p = principal_directions(s)
    assert p.aspects == ()
    assert len(filtered(s, p)) > 45


def test_the_filter_keeps_what_follows_and_drops_the_rest() -> None:
    rng = np.random.default_rng(2)
    kinds = [
        lines(rng, 30, 0, 200), lines(rng, 120, 0, 150), lines(rng, 120, 40, 150), lines(rng, 75, 0, 40),
        lines(rng, 30, 62, 12), lines(rng, 77, 90, 60),
    ]  # fmt: skip
    s = joined_segments(kinds, ("nadir",))
    p = principal_directions(s)
    keep = np.split(follows_principal(s, p), np.cumsum([len(k) for k in kinds])[:-1])
    level, across, sloped, diagonal, odd, upright = (float(k.mean()) for k in keep)
    assert min(level, across, sloped) > 0.85
    assert upright > 0.9
    assert odd < 0.2
    found = any(off(a.degrees, 75) < 3 for a in p.aspects)
    assert diagonal < 0.2 or found


def test_the_order_of_ends_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    s = joined_segments([lines(rng, 30, 0, 60), lines(rng, 120, 0, 60)], ("nadir",))
    turned = Segments(s.end, s.start, s.frame, s.layer, s.frames)
    a, b = principal_directions(s), principal_directions(turned)
    assert [round(x.degrees, 6) for x in a.aspects] == [round(x.degrees, 6) for x in b.aspects]


def test_a_parabola_finds_the_maximum_between_bins() -> None:
    at = np.arange(40) + 0.5
    histogram = np.exp(-0.5 * ((at - 17.3) / 3) ** 2)
    (peak,) = peaks_of(histogram, (0.0, 40.0), False, 0.1, 5)
    assert abs(peak.degrees - 17.3) < 0.02
    assert abs(peak.sigma - 3) < 0.1


def test_a_maximum_at_the_seam_is_one() -> None:
    sample = Sample(np.array([89.8, 89.9, 0.1, 0.2]), np.ones(4), np.full(4, 0.3), (0.0, 90.0), True)
    peaks = apart(mixture(sample, peaks_of(density(sample, 0.25), sample.span, True, 0.2, 5))[0], 90.0, 1.0)
    assert len(peaks) == 1
    assert off(peaks[0].degrees, 0.0, 90.0) < 0.05
