"""Directions and lengths of segments that are written down."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.splitting import ORTHO, SURFACE, Segments, joined_segments


def segments(ends: list[tuple[float, float, float]], layer: int = ORTHO) -> Segments:
    """From one place to others around it."""
    n, start = len(ends), np.array([100.0, 200.0, 10.0])
    return Segments(
        np.tile(start, (n, 1)), start + np.array(ends).reshape(-1, 3), np.zeros(n, np.int64), np.full(n, layer, np.uint8),
        ("nadir",),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("end", "aspect", "slope", "length"),
    [
        ((3.0, 0.0, 0.0), 0, 0, 3), ((0.0, 2.0, 0.0), 90, 0, 2), ((0.0, -2.0, 0.0), 90, 0, 2), ((-1.0, 1.0, 0.0), 135, 0, 2**0.5),
        ((-3.0, 0.0, 0.0), 0, 0, 3), ((3.0, 0.0, 4.0), 0, np.degrees(np.arctan(4 / 3)), 5), ((0.0, 3.0, -3.0), 90, 45, 18**0.5),
    ],
)  # fmt: skip
def test_directions_by_hand(end: tuple[float, float, float], aspect: float, slope: float, length: float) -> None:
    found = segments([end])
    assert found.aspect_deg[0] == pytest.approx(aspect, abs=1e-9)
    assert found.slope_deg[0] == pytest.approx(slope, abs=1e-9)
    assert found.length[0] == pytest.approx(length)


def test_an_upright_segment_has_a_slope_of_ninety_degrees() -> None:
    assert segments([(0.0, 0.0, 5.0), (0.0, 0.0, -5.0)]).slope_deg.tolist() == [90.0, 90.0]


def test_the_same_line_from_either_end_has_the_same_direction_below_180() -> None:
    """Also those that run as good as to the east, with what rounding leaves across."""
    rng = np.random.default_rng(1)
    ends = [*rng.normal(size=(50, 3)).tolist(), *[(5.0, y, 0.0) for y in (0.0, -0.0, 1e-13, -1e-13, -3e-14)]]
    one, other = (segments([tuple(sign * np.array(e)) for e in ends]) for sign in (1, -1))
    for found in (one.aspect_deg, other.aspect_deg):
        assert (found >= 0).all()
        assert (found < 180).all()
    apart = np.abs(one.aspect_deg - other.aspect_deg)
    assert np.minimum(apart, 180 - apart).max() < 1e-9


def test_aspects_near_zero_from_below_stay_below_180() -> None:
    """Differences of coordinates near the origin may be far below a picometre."""
    tiny = Segments(
        np.zeros((2, 3)), np.array([[1.0, -1e-20, 0.0], [-1.0, 1e-20, 0.0]]), np.zeros(2, np.int64), np.zeros(2, np.uint8),
        ("nadir",),
    )  # fmt: skip
    assert (tiny.aspect_deg < 180).all()


def test_joined_segments_keep_their_order_and_layers() -> None:
    both = joined_segments([segments([(1, 0, 0), (2, 0, 0)]), segments([(3, 0, 0)], SURFACE)], ("nadir", "east"))
    assert both.length.tolist() == [1, 2, 3]
    assert both.layer.tolist() == [ORTHO, ORTHO, SURFACE]
    assert both.take(both.layer == SURFACE).frames == ("nadir", "east")
    assert len(joined_segments([], ("nadir",))) == 0
    assert joined_segments([], ()).length.shape == (0,)
