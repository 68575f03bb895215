"""Which keys are surely not among millions: one bit each to look at, where a search takes microseconds a table."""

from __future__ import annotations

import numpy as np

LEAST_BITS = 1 << 20
SPARE = 32
"""Bits a key at least, when the filter was made anew: at most one key in sixteen is taken for a known one that is not. Set by hand."""


class KeyFilter:
    """Keys of 64 bits that are spread evenly, as digests are.

    >>> known = KeyFilter()
    >>> known.add(np.array([7, 9], np.uint64))
    >>> known.may_have(7), known.may_have(8)
    (True, False)
    """

    def __init__(self, room: int = 0) -> None:
        bits = max(LEAST_BITS, 1 << (max(room, 1) * SPARE - 1).bit_length())
        self._mask, self._most = bits - 1, bits * 2 // SPARE
        self._count = 0
        self._bytes = bytearray(bits // 8)

    def has_room(self, more: int) -> bool:
        """Whether so many keys may be added; else it has to be made anew, with more room."""
        return self._count + more <= self._most

    def add(self, keys: np.ndarray) -> None:
        """(N,) uint64."""
        low = keys & np.uint64(self._mask)
        own = np.left_shift(1, low & np.uint64(7), dtype=np.uint64).astype(np.uint8)
        np.bitwise_or.at(np.frombuffer(self._bytes, np.uint8), (low >> np.uint64(3)).astype(np.int64), own)
        self._count += len(keys)

    def may_have(self, key: int) -> bool:
        """False: the key was never added."""
        low = key & self._mask
        return bool(self._bytes[low >> 3] >> (low & 7) & 1)
