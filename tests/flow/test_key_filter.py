import numpy as np

from cityflow.flow.key_filter import LEAST_BITS, SPARE, KeyFilter


def test_no_key_that_was_added_is_denied_and_few_others_are_taken_for_known() -> None:
    rng = np.random.default_rng(5)
    known = KeyFilter()
    most = LEAST_BITS * 2 // SPARE
    added, others = np.split(rng.integers(0, 2**64, (2, most), np.uint64, endpoint=False), 2)
    for part in np.array_split(added[0], 7):
        known.add(part)
    assert all(map(known.may_have, added[0].tolist()))
    assert sum(map(known.may_have, others[0].tolist())) < 0.07 * most
    assert known.has_room(0)
    assert not known.has_room(1)


def test_one_with_more_room_is_denser_by_far() -> None:
    keys = np.random.default_rng(6).integers(0, 2**64, 100_000, np.uint64)
    wide = KeyFilter(len(keys))
    wide.add(keys)
    assert wide.has_room(0)
    assert sum(map(wide.may_have, np.random.default_rng(7).integers(0, 2**64, 10_000, np.uint64).tolist())) < 500
