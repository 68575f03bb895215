"""Pairs of frames in sequence: those that follow, and a few where the carrier comes back."""

from __future__ import annotations

import numpy as np

from cityflow.orientation.photo_pairs import PhotoPairParameters, photo_pairs


def test_frames_in_sequence_are_compared_with_those_that_follow_and_where_a_loop_closes() -> None:
    """Thirty frames on a circle; the last ones see what the first ones saw."""
    count = 30
    apart = np.abs(np.arange(count)[:, None] - np.arange(count)[None, :])
    alike = np.exp(-np.minimum(apart, count - apart) / 3.0)
    np.fill_diagonal(alike, 0.0)
    nowhere = np.full((count, 3), np.nan)
    parameters = PhotoPairParameters(following=3, loops=2)
    pairs = photo_pairs(alike, nowhere, parameters, in_sequence=True)
    assert {(i, i + d) for d in (1, 2, 3) for i in range(count - d)} <= set(pairs)
    assert (0, 29) in pairs
    assert (1, 29) in pairs
    assert len(pairs) <= 5 * count
    assert pairs == tuple(sorted(set(pairs)))
    # GNSS positions that are far off part no neighbours
    places = np.column_stack([np.arange(count) * 1000.0, np.zeros(count), np.zeros(count)])
    near = photo_pairs(alike, places, PhotoPairParameters(following=3, loops=2, nearest=2), in_sequence=True)
    assert {(i, i + d) for d in (1, 2, 3) for i in range(count - d)} <= set(near)
    assert (0, 29) not in near
