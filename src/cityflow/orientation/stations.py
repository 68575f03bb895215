"""Which images were taken together: by heads of one system that fire at one time, or whose files are counted alike."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence

LEAST_SHARE = 0.5
"""Of the images that must belong to a station of two heads and more, for stations to be believed; set by hand."""
FEWEST = 3
"""Stations below which no two heads are compared."""


def stations(names: Sequence[str], heads: Sequence[int], taken: Sequence[str]) -> tuple[int | None, ...]:
    """The station of each image, None where it is known to belong to none.

    Parameters
    ----------
    names : of the images, with folders
    heads : number of each image's camera
    taken : times of exposure as the files have them; empty: unknown
    """
    if len(set(heads)) < 2:
        return (None,) * len(names)
    keys: list[Sequence[Hashable | None]] = [[t or None for t in taken]]
    tokens = [re.split(r"[^0-9A-Za-z]+|(?<=\D)(?=\d)|(?<=\d)(?=\D)", n) for n in names]
    if len({len(t) for t in tokens}) == 1:
        keys += [[tuple(t[:k] + t[k + 1 :]) for t in tokens] for k in range(len(tokens[0]))]
    for key in keys:
        found = _grouped(key, heads)
        counts: dict[int, int] = defaultdict(int)
        for station in found.values():
            counts[station] += 1
        if len(found) >= LEAST_SHARE * len(names) and len(counts) >= FEWEST:
            return tuple(found.get(k) for k in range(len(names)))
    return (None,) * len(names)


def _grouped(key: Sequence[Hashable | None], heads: Sequence[int]) -> Mapping[int, int]:
    """Number of an image → of its station: images of one key, of two heads at least, each head once."""
    members: dict[Hashable, list[int]] = {}
    for number, value in enumerate(key):
        if value is not None:
            members.setdefault(value, []).append(number)
    found: dict[int, int] = {}
    station = 0
    for group in members.values():
        own = [heads[k] for k in group]
        if len(group) > 1 and len(set(own)) == len(own):
            found |= dict.fromkeys(group, station)
            station += 1
    return found
