"""Which frames of a sequence are taken as photographs: enough of a step from one to the next, seen from another place, the sharpest of those near."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.adjustment.frame_tracking import overlap, parallax_px
from cityflow.adjustment.measured_frames import FrameTracker, SequenceFrame
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray

SHARP, BLURRED, STILL, DOUBLE = "sharp", "blurred", "still", "double"
BAND = 0.05
"""Overlap may be so much more or less than asked: the sharpest frame within is taken; set by hand, as are those below."""
STILL_PX = 0.3
"""Points that move less from one frame to the next do not move."""
AROUND_S = 1.0
"""A frame is compared with those before and after it within this time."""
DOUBLE_SHARE = 0.4
"""A frame that differs less from an earlier one than this share of what frames differ by from one to the next shows the same picture."""
NEAR_WIDTHS = 0.1
"""Frames between which points have moved less than this share of the width follow one another: none is a double of the other."""
ROWS_AT_ONCE = 512


class FrameParameters(Parameters):
    """How frames are chosen."""

    overlap: float = Field(0.85, ge=0.4, le=0.97, description="share of a frame that the next chosen one sees again")
    least_overlap: float = Field(
        0.5, ge=0.2, le=0.9, description="a camera that only turns: overlap below which a frame is taken all the same"
    )
    parallax_px: float = Field(
        1.0, ge=0, le=50,
        description="what no turn of the camera explains between chosen frames, at least; median over the frame at 640 pixels of width",
    )  # fmt: skip
    sharp_share: float = Field(
        0.8, ge=0, le=1, description="frames less sharp than this share of those around them are blurred"
    )


@dataclass(frozen=True, slots=True)
class ChosenFrame:
    """A frame that is taken: overlap with the one taken before it, and what no turn explains between both, pixels; None for the first of a piece."""

    number: int
    time_s: float
    overlap: float | None
    parallax_px: float | None


@dataclass(frozen=True, slots=True)
class BetweenFrames:
    """A frame that is not taken: seconds since the start, number of the frame taken before it, share of the way from there to the one taken next."""

    time_s: float
    after: int
    share: float


@dataclass(frozen=True, slots=True)
class FrameChoice:
    """What is taken of a sequence.

    Attributes
    ----------
    chosen : in their order;  between : the others, as far as it is known where they lie between those
     kinds : of each frame: sharp, blurred, still or double
    widest_px : farthest that points moved along the sequence, at 640 pixels of width;  pieces : parts that show nothing in common
    """

    chosen: tuple[ChosenFrame, ...]
    kinds: tuple[str, ...]
    widest_px: float
    pieces: int
    between: tuple[BetweenFrames, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """Frames by kind."""
        found = Counter(self.kinds)
        return {kind: found[kind] for kind in (SHARP, BLURRED, STILL, DOUBLE)}

    @property
    def moves(self) -> bool:
        """Whether any chosen frame was taken from another place than the one before."""
        return any(c.parallax_px is not None for c in self.chosen)


def choose_frames(frames: Iterable[tuple[float, PixelArray]], rate: float, parameters: FrameParameters) -> FrameChoice:
    """Choose frames of a sequence; of its pixels no more than two frames are in memory.

    Parameters
    ----------
    frames : seconds since the start, and (h, w, 3) or (h, w, 1) uint8 pixels, all of one size
    rate : frames a second, about
    """
    around = max(2, round(AROUND_S * rate))
    tracker, shape = FrameTracker(around), (0, 0)
    for time_s, pixels in frames:
        shape = tracker.add(time_s, pixels)
    found = tracker.frames
    if not found:
        return FrameChoice((), (), 0.0, 0)
    kinds = _kinds(found, around, max(shape), parameters)
    chosen = _chosen(found, kinds, shape, parameters)
    pieces = sum(c.overlap is None for c in chosen)
    return FrameChoice(
        tuple(chosen), tuple(kinds), max(f.way_px for f in found), pieces, _between(found, kinds, chosen)
    )


def _kinds(frames: Sequence[SequenceFrame], around: int, width: int, parameters: FrameParameters) -> list[str]:
    sharp = np.array([f.sharpness for f in frames])
    kinds = []
    doubles = _doubles(frames, around, width)
    for k, frame in enumerate(frames):
        usual = float(np.median(sharp[max(0, k - around) : k + around + 1]))
        is_still = frame.motion is not None and frame.motion.shift_px < STILL_PX
        kinds.append(
            BLURRED if sharp[k] < parameters.sharp_share * usual else DOUBLE if doubles[k] else STILL if is_still else SHARP
        )  # fmt: skip
    return kinds


def _doubles(frames: Sequence[SequenceFrame], around: int, width: int) -> BoolArray:
    """(N,) which frames show the picture of an earlier one that they do not follow."""
    pictures = np.array([f.thumbnail for f in frames])
    root = [f.number if f.parent < 0 else 0 for f in frames]
    for f in frames:
        root[f.number] = f.number if f.parent < 0 else root[f.parent]
    place, way = np.array(root), np.array([f.way_px for f in frames])
    usual = _usual_steps(
        pictures, np.array([f.motion is None or f.motion.shift_px >= STILL_PX for f in frames]), around
    )
    square = np.sum(pictures**2, axis=1)
    found: BoolArray = np.zeros(len(frames), bool)
    for first in range(0, len(frames), ROWS_AT_ONCE):
        rows = slice(first, min(first + ROWS_AT_ONCE, len(frames)))
        apart = square[rows, None] + square[None, :] - 2 * pictures[rows] @ pictures.T
        follows = (place[rows, None] == place[None, :]) & (np.abs(way[rows, None] - way[None, :]) < NEAR_WIDTHS * width)
        later = np.arange(len(frames))[None, :] >= np.arange(rows.start, rows.stop)[:, None]
        same = np.sqrt(np.maximum(apart, 0.0)) < DOUBLE_SHARE * usual[None, :]
        found[rows] = (same & ~follows & ~later).any(axis=1)
    return found


def _usual_steps(pictures: NDArray[np.float32], moves: BoolArray, around: int) -> FloatArray:
    """(N,) by what pictures of frames that move differ from the ones before them, median of those around each; 0 where none moves."""
    step = np.linalg.norm(np.diff(pictures, axis=0, prepend=pictures[:1]), axis=1)
    moving = np.flatnonzero(moves & (step > 0))
    if not len(moving):
        return np.zeros(len(pictures))
    near = np.searchsorted(moving, np.arange(len(pictures)))
    return np.array([np.median(step[moving[max(0, n - around) : n + around]]) for n in near])


def _chosen(
    frames: Sequence[SequenceFrame], kinds: Sequence[str], shape: tuple[int, int], parameters: FrameParameters
) -> list[ChosenFrame]:
    chosen: list[ChosenFrame] = []
    since: dict[int, FloatArray] = {}
    band: list[ChosenFrame] = []
    k = 0
    while k < len(frames):
        frame = frames[k]
        if frame.motion is not None and frame.parent in since:
            since[k] = frame.motion.homography @ since[frame.parent]
        taken = None
        if kinds[k] in (SHARP, STILL):
            # at the start of a piece what follows it closely may be sharper
            led = since.get(k)
            taken = (
                _first_of(frames, kinds, k, shape) if led is None else _next_of(frames, k, led, shape, band, parameters)
            )
        if taken is not None:
            chosen.append(taken)
            before = since.get(taken.number)
            turned = np.linalg.inv(before) if before is not None else None
            since = {n: h @ turned for n, h in since.items() if n >= taken.number} if turned is not None else {}
            since[taken.number] = np.eye(3)
            band.clear()
            k = taken.number
        k += 1
    return chosen


def _between(
    frames: Sequence[SequenceFrame], kinds: Sequence[str], chosen: Sequence[ChosenFrame]
) -> tuple[BetweenFrames, ...]:
    """Where the others lie, by how far points have moved."""
    found: list[BetweenFrames] = []
    for one, other in pairwise(chosen):
        first, whole = frames[one.number].way_px, frames[other.number].way_px - frames[one.number].way_px
        if other.overlap is None or whole <= 0:
            continue
        for frame in frames[one.number + 1 : other.number]:
            share = (frame.way_px - first) / whole
            if kinds[frame.number] != DOUBLE and frame.parent >= 0 and 0 <= share <= 1:
                found.append(BetweenFrames(frame.time_s, one.number, round(share, 4)))
    return tuple(found)


def _first_of(frames: Sequence[SequenceFrame], kinds: Sequence[str], first: int, shape: tuple[int, int]) -> ChosenFrame:
    """The sharpest frame that sees nearly the same as the first of a piece."""
    led, best = {first: np.eye(3)}, first
    for k in range(first + 1, len(frames)):
        moved = frames[k].motion
        if moved is None or frames[k].parent not in led:
            break
        led[k] = moved.homography @ led[frames[k].parent]
        if overlap(led[k], shape) < 1 - BAND:
            break
        if kinds[k] == SHARP and frames[k].sharpness > frames[best].sharpness:
            best = k
    return ChosenFrame(best, frames[best].time_s, None, None)


def _next_of(
    frames: Sequence[SequenceFrame], k: int, led: FloatArray, shape: tuple[int, int], band: list[ChosenFrame], parameters: FrameParameters
) -> ChosenFrame | None:  # fmt: skip
    """The frame that is taken now that frame `k` has been reached; None: go on. `band` gathers those that may be."""
    seen, asked = overlap(led, shape), parameters.overlap
    if seen > asked + BAND:
        return None
    moved = parallax_px(led, shape)
    here = ChosenFrame(k, frames[k].time_s, seen, round(moved, 3) if moved >= parameters.parallax_px else None)
    if seen >= asked - BAND:
        band.append(here)
        return None
    # left the band: the sharpest within, else the first beyond it; one that was only turned to where the view would be lost
    good = [c for c in band if c.parallax_px is not None]
    if good:
        return max(good, key=lambda c: (frames[c.number].sharpness, -c.number))
    if here.parallax_px is not None:
        return here
    if seen < parameters.least_overlap:
        return band[-1] if band else here
    band[:] = [here]
    return None
