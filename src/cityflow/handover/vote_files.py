"""Votes for the depths over a ground tile as a file: who has compared them leaves it to all who read their points."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from cityflow.core.arrays import ByteArray
from cityflow.core.grid import Box
from cityflow.handover.array_file import decode_arrays, encode_arrays

VOTES = "votes.cfa"
ANYWHERE: Box = (-1e9, -1e9, -1e9, 1e9, 1e9, 1e9)


def encode_votes(votes: Mapping[str, ByteArray], boxes: Mapping[str, Box]) -> bytes:
    """Of each reference image by its name, (h, w) uint8 on the window of its depth map over the tile; 0: refuted or unknown.

    `boxes` are those of the points that are not refuted, world metres; an image without such points has none.
    """
    return encode_arrays({n: votes[n] for n in sorted(votes)}, {"boxes": {n: list(boxes[n]) for n in sorted(boxes)}})


def decode_votes(data: bytes, images: Collection[str]) -> dict[str, ByteArray]:
    """What `encode_votes` wrote, of some reference images.

    Raises
    ------
    CityflowError
        These are other bytes.
    """
    return decode_arrays(data, images.__contains__)[0]


def decode_boxes(data: bytes) -> dict[str, Box]:
    """Image → box of its points that are not refuted, world metres; files of before boxes were written tell nothing, so any place is in them."""
    names: list[str] = []

    def is_wanted(name: str) -> bool:
        names.append(name)
        return False

    told = decode_arrays(data, is_wanted)[1].get("boxes")
    return dict.fromkeys(names, ANYWHERE) if told is None else {name: tuple(box) for name, box in told.items()}
