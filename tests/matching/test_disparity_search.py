"""Ranges of disparities from a coarser level whose values are known."""

from __future__ import annotations

import numpy as np

from cityflow.matching.disparity_search import MARGIN_PX, Search, Sight, hull_around, search_around, search_everywhere

WIDEST = (-40, 60)
NAN = np.float32(np.nan)


def test_a_pixel_searches_what_the_coarser_level_knows_around_it() -> None:
    """Disparity 3 in the left half and 10 in the right one: within two pixels of the step both, further off their own."""
    guide = np.full((20, 40), 3.0, np.float32)
    guide[:, 20:] = 10.0
    found = search_around(guide, WIDEST, 256)
    assert (found.low[:, :18] == 6 - MARGIN_PX).all()
    assert (found.high[:, :18] == 6 + MARGIN_PX).all()
    assert (found.low[:, 18:22] == 6 - MARGIN_PX).all()
    assert (found.high[:, 18:22] == 20 + MARGIN_PX).all()
    assert (found.low[:, 22:] == 20 - MARGIN_PX).all()


def test_where_little_is_known_the_range_is_that_of_a_wider_neighbourhood() -> None:
    guide = np.full((60, 120), NAN, np.float32)
    guide[30, 10], guide[30, 18], guide[30, 110] = 2.0, 5.0, 9.0
    found = search_around(guide, WIDEST, 256)
    own, unknown, far, further = (30, 10), (30, 14), (30, 30), (30, 64)
    assert (found.low[own], found.high[own]) == (4 - MARGIN_PX, 4 + MARGIN_PX)
    assert (found.low[unknown], found.high[unknown]) == (4 - MARGIN_PX, 10 + MARGIN_PX)
    assert (found.low[far], found.high[far]) == (4 - MARGIN_PX, 10 + MARGIN_PX)
    assert (found.low[further], found.high[further]) == (4 - MARGIN_PX, 18 + MARGIN_PX)


def test_where_nothing_is_known_heights_decide() -> None:
    found = search_around(np.full((8, 8), NAN, np.float32), WIDEST, 256)
    assert (found.low == WIDEST[0]).all()
    assert (found.high == WIDEST[1] - 1).all()
    bounded = search_around(np.full((8, 8), NAN, np.float32), WIDEST, 50)
    assert (bounded.high - bounded.low + 1 == 50).all()


def test_the_hull_holds_what_any_pixel_searches_in_whole_chunks() -> None:
    guide = np.random.default_rng(1).uniform(-15, 25, (30, 30)).astype(np.float32)
    guide[np.random.default_rng(2).random(guide.shape) < 0.6] = np.nan
    found = search_around(guide, WIDEST, 256)
    low, high = hull_around(guide, WIDEST) or (0, 0)
    assert low <= found.low.min() < low + 16
    assert high - 17 < found.high.max() < high
    assert low % 16 == 1
    assert high % 16 == 1
    assert hull_around(np.full((3, 3), -90.0, np.float32), WIDEST) is None, "nothing between the heights"


def test_chunks_hold_the_range_and_leave_out_what_an_image_does_not_show() -> None:
    search = Search(np.array([[-5, 20]], np.int32), np.array([[3, 40]], np.int32), corner=(1, 1), bits=1)
    # pixels 0 of the window stands in the first, 1 and 2 in the second of the two squares
    shape = (1, 3)
    low, high = search.hull() or (0, 0)
    partner = np.ones((1, shape[1] + high - low - 1), bool)
    sight = Sight(np.ones(shape, bool), partner, 1 - high)
    chunks = search.chunks(sight)
    for n, (least, most) in enumerate(((-5, 3), (20, 40), (20, 40))):
        shifts = range(16 * chunks.first[0, n], 16 * (chunks.first[0, n] + chunks.many[0, n]))
        assert -most in shifts
        assert -least in shifts
        assert len(shifts) <= most - least + 1 + 30
    assert chunks.start.tolist() == [0, *np.cumsum(chunks.many.ravel()).tolist()]
    partner[0, : 1 + high - 20] = False  # of pixel 1 all of its disparities, of pixel 2 all but the least
    assert (search.chunks(sight).many > 0).tolist() == [[True, False, True]]
    hidden = Sight(np.array([[False, True, True]]), np.ones_like(partner), 1 - high)
    assert (search.chunks(hidden).many > 0).tolist() == [[False, True, True]]


def test_disparities_that_were_not_searched_or_are_not_seen_go() -> None:
    search = search_everywhere((2, 6))
    shifts = np.array([[-2.0, -5.4, -5.6, -1.4, NAN, -3.0]], np.float32)
    partner = np.ones((1, 12), bool)
    sight = Sight(np.ones((1, 6), bool), partner, -6)
    partner[0, 5 + 6 - 3] = False
    found = search.inside(shifts, sight)
    np.testing.assert_array_equal(np.isnan(found), [[False, False, True, True, True, True]])
    np.testing.assert_allclose(found[0, :2], [2.0, 5.4])
