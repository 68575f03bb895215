"""Votes for the depths over a ground tile as a file: who has compared them leaves it to all who read their points."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from cityflow.core.arrays import ByteArray
from cityflow.handover.array_file import decode_arrays, encode_arrays

VOTES = "votes.cfa"


def encode_votes(votes: Mapping[str, ByteArray]) -> bytes:
    """Of each reference image by its name, (h, w) uint8 on the window of its depth map over the tile; 0: refuted or unknown."""
    return encode_arrays({name: votes[name] for name in sorted(votes)}, {})


def decode_votes(data: bytes, images: Collection[str]) -> dict[str, ByteArray]:
    """What `encode_votes` wrote, of some reference images.

    Raises
    ------
    CityflowError
        These are other bytes.
    """
    return decode_arrays(data, images.__contains__)[0]
