"""Frames that were chosen of a video or a sequence of stills, as the task leaves them for the driver."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from cityflow.flow.typed import as_json, from_json


@dataclass(frozen=True, slots=True)
class SequenceEntry:
    """A photograph of the sequence.

    Attributes
    ----------
    file : its name;  number : of the frame, from 0 on;  time_s : since the start of the video
    overlap, parallax_px : with the one before it, see `adjustment.frame_choice.ChosenFrame`
    """

    file: str
    number: int
    time_s: float
    overlap: float | None
    parallax_px: float | None


@dataclass(frozen=True, slots=True)
class OtherFrame:
    """A frame that is no photograph, see `adjustment.frame_choice.BetweenFrames`."""

    time_s: float
    after: int
    share: float


@dataclass(frozen=True, slots=True)
class SequenceTable:
    """What was chosen of a sequence.

    Attributes
    ----------
    frames : in all;  counts : frames by kind;  pieces : parts that show nothing in common
    notes : for the user;  between : where others lie between those that were chosen
    """

    chosen: tuple[SequenceEntry, ...]
    frames: int
    counts: Mapping[str, int]
    pieces: int
    notes: tuple[str, ...] = ()
    between: tuple[OtherFrame, ...] = ()


def encode_sequence(table: SequenceTable) -> bytes:
    """As JSON."""
    return (json.dumps(as_json(table), indent=1, sort_keys=True) + "\n").encode()


def decode_sequence(data: bytes) -> SequenceTable:
    """Of what `encode_sequence` has made."""
    return from_json(SequenceTable, json.loads(data), "the chosen frames")
